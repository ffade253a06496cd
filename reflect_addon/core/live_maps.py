"""A cube map drawn live as an asset, so that the kernels of baked ones answer from it [nielsen-2002 3.2; Szirmay-Kalos 2005].

Problem. The paper looks curved mirrors up by direction alone ("environment mapping only takes the reflection direction into account").
Idea. Views know how far everything is, so the map stores it and has the layout of baked ones (cubemap.py), coarser levels included; a method that
localises baked maps localises this one. `KIND` is that method, told of one layer.
What a planar mirror shows is stored as far as its image is, so that it moves behind the mirror as through a window; of a mirror in that
mirror, as far as that one's image. Better still, a ray that meets such a mirror is mirrored there and followed on (map_mirrors.py).
Limits. One surface in each direction. What a curved mirror shows is as far as the mirror.
"""

from dataclasses import dataclass

import numpy as np

from . import cubemap, map_mirrors, spaces
from .asset import Asset
from .curved_views import CurvedMirror
from .kernel import Hit, Ray
from .methods import layered_distance
from .mirror_planes import MirrorPlane
from .snapshot import SceneSnapshot, corners_of

KIND = layered_distance.NAME


@dataclass(frozen=True)
class Reach:
    """Around a map's centre."""

    center: np.ndarray  # (3,) world, m
    farthest: float  # m: no surface of the scene is farther, nor its image in a planar mirror

    @property
    def scale(self) -> float:
        """What distances are stored divided by."""
        return self.farthest / cubemap.FARTHEST


def reach_of(scene: SceneSnapshot, curved: CurvedMirror) -> Reach:
    corners = np.concatenate([corners_of(scene.bounds(things)) for things in (scene.instances, scene.lamps) if len(things)])
    beyond = float(np.linalg.norm(np.ptp(corners, axis=0)))  # of what a planar mirror shows, from the mirror
    return Reach(curved.center, max(float(np.linalg.norm(corners - curved.center, axis=1).max()) + beyond, 1e-20))


def asset_of_map(
    reach: Reach, side: int, most: int, image: np.ndarray, curved: CurvedMirror, met: tuple[MirrorPlane, ...], bounces: int
) -> Asset:
    """side: texels along a face's edge; most: the most that it may get, so that its kernel is the same then; image: stands for the texture
    that is drawn; met: planes that its rays are mirrored in, so many times."""
    stride = layered_distance.DEFAULTS["stride"]
    return Asset(
        KIND, "", {"radiance_tx": image},
        uniforms={
            "center": tuple(map(float, reach.center)), "radiance_scale": 1.0, "distance_scale": reach.scale,
            "cube_size": float(side), "cube_coarsest": float(cubemap.level_count(side) - 1),
            "back_radiance_scale": 1.0, "back_distance_scale": 1.0,
            "layer_height": float(cubemap.image_size(side)[0]), "march_texels": side / 2 / stride,
            **(map_mirrors.uniforms_of(curved, met) if met else {}),
        },
        options={
            "layers": 1, "steps": -(-most // stride), "iterations": layered_distance.DEFAULTS["iterations"],
            "mirrors": tuple(len(plane.outline) for plane in met), "ball": map_mirrors.meets_ball(curved), "bounces": bounces,
        },
    )  # fmt: skip


def trace(k, asset, ray) -> Hit:
    """What the map shows where the ray ends, after the mirrors on its way."""
    bounces, center = asset.options["bounces"], asset.uniforms["center"]
    if not bounces or not asset.options["mirrors"]:
        return layered_distance.trace(k, asset, ray)

    def step(i, origin, direction, width, spread, share, gone, seen, footprint, solid):
        here = Ray(origin, direction, width, spread)
        met = layered_distance.meet(k, asset, here)
        mirror = map_mirrors.nearest(k, asset, origin - center, direction)
        at = k.name("at", origin + direction * mirror.distance)
        on = k.name("on", direction - 2.0 * k.dot(direction, mirror.normal) * mirror.normal)
        ends = (mirror.distance >= met.far) | (i > bounces - 0.5)
        if not asset.options["ball"]:
            ends = ends | map_mirrors.comes_back(k, asset, at - center, on)
        ends = k.name("ends", ends)
        return (
            k.select(ends, origin, at), k.select(ends, direction, on), k.select(ends, width, width + spread * mirror.distance),
            k.select(ends, spread, k.sqrt(spread * spread + mirror.roughness * mirror.roughness)),
            k.select(ends, share, share * mirror.reflectance), k.select(ends, gone, gone + mirror.distance),
            met.seen, met.footprint, k.select(met.solid, 1.0, 0.0),
        ), ends  # fmt: skip

    start = (ray.origin, ray.direction, ray.width, ray.spread, k.vec3(1.0, 1.0, 1.0), 0.0, ray.direction, ray.spread, 0.0)
    origin, _, _, _, share, gone, seen, footprint, solid = k.loop(bounces + 1, start, step)
    radiance, distance = cubemap.look_up(k, asset, seen, footprint)
    place = center + k.normalize(seen) * distance
    # The place of an image, as far behind the first mirror as the light has come.
    image = ray.origin + ray.direction * (gone + k.length(place - origin))
    return Hit(radiance * share, k.select(gone > 0.0, image, place), 1.0, k.select(solid > 0.5, spaces.STATUS_HIT, spaces.STATUS_FELL_BACK))
