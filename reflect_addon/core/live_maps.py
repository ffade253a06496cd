"""A cube map drawn live as an asset, so that the kernels of baked ones answer from it [nielsen-2002 3.2; Szirmay-Kalos 2005].

Problem. The paper looks curved mirrors up by direction alone ("environment mapping only takes the reflection direction into account").
Idea. Views know how far everything is, so the map stores it and has the layout of baked ones (cubemap.py), coarser levels included; a method that
localises baked maps localises this one. `KIND` is that method, told of one layer.
What a planar mirror shows is stored as far as its image is, so that it moves behind the mirror as through a window; of a mirror in that
mirror, as far as that one's image.
Limits. One surface in each direction. What a curved mirror shows is as far as the mirror.
"""

from dataclasses import dataclass

import numpy as np

from . import cubemap
from .asset import Asset
from .curved_views import CurvedMirror
from .methods import layered_distance
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


def asset_of_map(reach: Reach, side: int, most: int, image: np.ndarray) -> Asset:
    """side: texels along a face's edge; most: the most that it may get, so that its kernel is the same then; image: stands for the texture
    that is drawn."""
    stride = layered_distance.DEFAULTS["stride"]
    return Asset(
        KIND, "", {"radiance_tx": image},
        uniforms={
            "center": tuple(map(float, reach.center)), "radiance_scale": 1.0, "distance_scale": reach.scale,
            "cube_size": float(side), "cube_coarsest": float(cubemap.level_count(side) - 1),
            "back_radiance_scale": 1.0, "back_distance_scale": 1.0,
            "layer_height": float(cubemap.image_size(side)[0]), "march_texels": side / 2 / stride,
        },
        options={"layers": 1, "steps": -(-most // stride), "iterations": layered_distance.DEFAULTS["iterations"]},
    )  # fmt: skip
