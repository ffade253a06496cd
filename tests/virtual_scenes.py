"""A mirror among things, baked through Embree for `virtual_objects`, and the truth of the rays that a frame has."""

from dataclasses import dataclass, replace

import numpy as np
import trimesh
from analytic import smooth
from mesh_scenes import job, smooth_mirror, snapshot, tracer

from reflect_addon.core import methods, surface_radiance
from reflect_addon.core.asset import Asset
from reflect_addon.core.methods import layered_distance, virtual_objects
from reflect_addon.core.rays import Hits, RayMap
from reflect_addon.core.snapshot import SceneSnapshot

BELOW = {**layered_distance.DEFAULTS, "resolution": 32, "samples": 1, "sky_error": 0}
SURFACES = {**surface_radiance.DEFAULTS, "surface_samples": 1, "surface_tolerance": 0.02}
# Rays of the truth start so far above the mirror's facets, m.
LIFT = 2e-4


def paint(position, owner):
    """Radiance of what stands at a place; each thing has its own brightness."""
    return smooth(3 * position) + 0.2 * owner[:, None]


def ball(radius=0.5, place=(0, 0, 0.5), steps=5):
    return smooth_mirror(trimesh.creation.icosphere(steps, radius)).apply_translation(place)


def hollow(radius=0.5, place=(0, 0, 0), steps=4):
    """A bowl: half of a ball, open above, a sheet that mirrors on both sides."""
    shape = trimesh.creation.icosphere(steps, radius)
    shape.update_faces(shape.triangles_center[:, 2] < 0)
    shape.remove_unreferenced_vertices()
    return smooth_mirror(shape).apply_translation(place)


def among_things(mirror=None, **more) -> SceneSnapshot:
    """The mirror (a ball by default) on a floor, with a torus and a rock beside it."""
    found = snapshot(
        ball() if mirror is None else mirror,
        Torus=trimesh.creation.torus(0.35, 0.15).apply_translation((1.0, 0.9, 0.5)),
        Rock=trimesh.creation.icosphere(3, 0.3).apply_translation((1.2, -0.6, 0.35)),
        Floor=trimesh.creation.box((6, 6, 0.01)).apply_translation((0, 0, -0.005)),
        **more,
    )
    return replace(found, light_hash="day")


@dataclass(frozen=True)
class Baked:
    scene: SceneSnapshot
    assets: dict[str, Asset]
    surfaces: Asset


def baked(scene: SceneSnapshot, surfaces: Asset | None = None, **settings) -> Baked:
    """Assets of all reflectors, joined, and the surfaces, where they were not baked before."""
    assets = {}
    for reflector in scene.reflectors():
        asked = {**virtual_objects.DEFAULTS, "map_texels": 256, **BELOW, **settings}
        own = replace(job(scene, asked, paint=paint), reflector=reflector)
        assets[reflector.name] = virtual_objects.bake(own).joined(methods.get(layered_distance.NAME).bake(own))
    return Baked(scene, assets, surfaces or surface_radiance.bake(scene, tracer(scene, paint), scene.instances, SURFACES))


def truth(scene: SceneSnapshot, ray_map: RayMap) -> Hits:
    """Of the covered pixels, through Embree."""
    mask, rays = ray_map.covered(), ray_map.rays()
    lifted = replace(rays, origin=(rays.origin + LIFT * ray_map.normal[mask]).astype(np.float32))
    return tracer(scene, paint)(lifted)
