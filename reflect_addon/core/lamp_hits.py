"""Where rays meet lamps.

Lamps are no objects: a traced ray shows a lamp but reports the surface, or the sky, behind it (scene/raytrace.py). A map of
distances would so show every lamp at the wrong place, and nothing in it is brighter; and whoever judges hit points by such
a truth would call a lamp's stand-in, right where the lamp is, a false hit.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from .rays import Hits, Rays
from .snapshot import Instance, SceneSnapshot


def with_lamps(
    hits: Hits,
    rays: Rays,
    scene: SceneSnapshot,
    intersect: Callable[[Instance, Rays], np.ndarray],  # BakeJob's
    hide: tuple[str, ...] = (),
) -> Hits:
    """The hits, with rays that meet the shining side of a lamp before anything else ending there."""
    position, normal, hit, of = hits.position.copy(), hits.normal.copy(), hits.hit.copy(), hits.object.copy()
    names = list(hits.object_names)
    for lamp in scene.lamps:
        if lamp.object_name in hide or not lamp.visible_glossy:
            continue
        side = shining(scene, lamp)
        some = np.flatnonzero(_pass(scene, lamp, rays))
        origin, direction = rays.origin[some], rays.direction[some]
        nearest = np.where(hit[some], np.linalg.norm(position[some].astype(np.float64) - origin, axis=-1), np.inf)
        distance = intersect(lamp, Rays(origin, direction))
        met = (distance < nearest) & (direction @ side <= 0.0)
        at, here = some[met], origin[met].astype(np.float64) + direction[met] * distance[met, None]
        position[at], normal[at], hit[at] = here, side, True
        of[at] = len(names)
        names.append(lamp.object_name)
    return replace(hits, position=position, normal=normal, hit=hit, object=of, object_names=tuple(names))


def _pass(scene: SceneSnapshot, lamp: Instance, rays: Rays) -> np.ndarray:
    """(N,) bool: rays whose line passes a sphere around the lamp; the others, nearly all, need no search."""
    low, high = scene.bounds([lamp])
    to = (low + high) / 2 - rays.origin
    beside = to - rays.direction * np.einsum("nx,nx->n", to, rays.direction)[:, None]
    return np.linalg.norm(beside, axis=-1) <= 0.501 * np.linalg.norm(high - low)


def shining(scene: SceneSnapshot, lamp: Instance) -> np.ndarray:
    """(3,) the unit normal of a flat lamp, which is not there for rays from behind; 0 for one that shines all around."""
    corners = scene.world_positions(lamp)[scene.meshes[lamp.mesh].triangles]
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    together, alone = cross.sum(0), np.linalg.norm(cross, axis=-1).sum()
    return together / np.linalg.norm(together) if np.linalg.norm(together) > 0.5 * alone else np.zeros(3)
