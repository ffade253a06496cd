"""Lamps as ends of rays: Cycles adds a lamp's light to a ray but tells the surface, or the sky, behind it.

Whoever judges hit points by such a truth would call a lamp's stand-in, right where the lamp is, a false hit.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from .rays import Hits, Rays
from .snapshot import Instance, SceneSnapshot


def with_lamps(hits: Hits, rays: Rays, scene: SceneSnapshot, intersect: Callable[[Instance, Rays], np.ndarray]) -> Hits:
    """The hits, with rays that meet the shining side of a lamp before anything else ending there. intersect: BakeJob's."""
    position, normal, hit, of = hits.position.copy(), hits.normal.copy(), hits.hit.copy(), hits.object.copy()
    names = list(hits.object_names)
    nearest = np.where(hit, np.linalg.norm(position.astype(np.float64) - rays.origin, axis=-1), np.inf)
    for lamp in scene.lamps:
        if not lamp.visible_glossy:
            continue
        shining = scene.meshes[lamp.mesh].corner_normals.reshape(-1, 3).mean(0) @ lamp.world_from_object[:3, :3].T
        distance = intersect(lamp, rays)
        met = distance < nearest
        # Area lamps shine to one side; a ball's normals have no mean.
        if np.linalg.norm(shining) > 0.5 * np.cbrt(abs(np.linalg.det(lamp.world_from_object[:3, :3]))):
            met &= rays.direction @ shining < 0
        else:
            shining = np.zeros(3)
        nearest[met] = distance[met]
        position[met] = (rays.origin.astype(np.float64) + rays.direction * np.where(met, distance, 0.0)[:, None])[met]
        normal[met], hit[met], of[met] = shining / max(np.linalg.norm(shining), 1e-30), True, len(names)
        names.append(lamp.object_name)
    return replace(hits, position=position, normal=normal, hit=hit, object=of, object_names=tuple(names))
