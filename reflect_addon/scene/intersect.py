"""Rays against one instance's own triangles, through Blender's BVH tree: what billboards' alpha is made of."""

from collections.abc import Callable

import bpy  # noqa: F401  the pip module makes mathutils known
import numpy as np
from mathutils.bvhtree import BVHTree

from ..core.rays import Rays
from ..core.snapshot import Instance, SceneSnapshot


def intersector(scene: SceneSnapshot) -> Callable[..., np.ndarray]:
    """intersect(instance, rays, slots=None) -> (N,) float64 distances to its nearest triangle, inf = miss. slots: only
    triangles that show these of its materials. Trees are made once."""
    first = first_hits(scene)
    return lambda instance, rays, slots=None: first(instance, rays, slots)[0]


def first_hits(scene: SceneSnapshot) -> Callable[..., tuple[np.ndarray, np.ndarray]]:
    """first(instance, rays, slots=None) -> (distances as intersector's, (N, 3) float64 world unit normals of the triangles, 0 = miss)."""
    trees: dict[tuple, tuple[BVHTree, np.ndarray, float]] = {}

    def tree_of(instance: Instance, slots: tuple[int, ...] | None) -> tuple[BVHTree, np.ndarray, float]:
        key = (instance.name, slots)
        if key not in trees:
            vertices = scene.world_positions(instance)
            # The tree works in float32: centred and of unit size it keeps its digits anywhere and at any scale.
            low, high = scene.bounds([instance])
            origin, size = (low + high) / 2, float(np.max(high - low)) or 1.0
            local = ((vertices - origin) / size).tolist()
            triangles = scene.meshes[instance.mesh].triangles
            if slots is not None:
                triangles = triangles[np.isin(scene.slots(instance), slots)]
            trees[key] = (
                BVHTree.FromPolygons(local, triangles.tolist(), all_triangles=True),
                origin,
                size,
            )
        return trees[key]

    def first(instance: Instance, rays: Rays, slots: tuple[int, ...] | None = None) -> tuple[np.ndarray, np.ndarray]:
        tree, origin, size = tree_of(instance, slots)
        starts = ((np.asarray(rays.origin, np.float64) - origin) / size).tolist()
        out, normals = np.full(len(starts), np.inf), np.zeros((len(starts), 3))
        for i, (start, direction) in enumerate(zip(starts, np.asarray(rays.direction).tolist(), strict=True)):
            _, normal, _, distance = tree.ray_cast(start, direction)
            if distance is not None:
                out[i], normals[i] = distance * size, normal
        return out, normals

    return first
