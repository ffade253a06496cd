"""Rays against one instance's own triangles, through Blender's BVH tree: what billboards' alpha is made of."""

from collections.abc import Callable

import bpy  # noqa: F401  the pip module makes mathutils known
import numpy as np
from mathutils.bvhtree import BVHTree

from ..core.rays import Rays
from ..core.snapshot import Instance, SceneSnapshot


def intersector(scene: SceneSnapshot) -> Callable[[Instance, Rays], np.ndarray]:
    """intersect(instance, rays) -> (N,) float64 distances to its nearest triangle, inf = miss. Trees are made once."""
    trees: dict[str, tuple[BVHTree, np.ndarray, float]] = {}

    def tree_of(instance: Instance) -> tuple[BVHTree, np.ndarray, float]:
        if instance.name not in trees:
            vertices = scene.world_positions(instance)
            # The tree works in float32: centred and of unit size it keeps its digits anywhere and at any scale.
            low, high = scene.bounds([instance])
            origin, size = (low + high) / 2, float(np.max(high - low)) or 1.0
            local = ((vertices - origin) / size).tolist()
            trees[instance.name] = (
                BVHTree.FromPolygons(local, scene.meshes[instance.mesh].triangles.tolist(), all_triangles=True),
                origin,
                size,
            )
        return trees[instance.name]

    def intersect(instance: Instance, rays: Rays) -> np.ndarray:
        tree, origin, size = tree_of(instance)
        starts = ((np.asarray(rays.origin, np.float64) - origin) / size).tolist()
        out = np.full(len(starts), np.inf)
        for i, (start, direction) in enumerate(zip(starts, np.asarray(rays.direction).tolist(), strict=True)):
            distance = tree.ray_cast(start, direction)[3]
            if distance is not None:
                out[i] = distance * size
        return out

    return intersect
