"""What rays meet, without any light: `trace` as scene/raytrace.py has it, by Blender's BVH trees alone.

Problem. A plan asks where rays end, of many stand-ins, and throws them away; a Cycles render takes half a second before its first ray.
Idea. Each instance has a tree (intersect.py); a ray asks those alone whose box it meets, the nearest box first, and none behind what it has met.
Limits. Meshes only, as the snapshot has them: no hair, no volumes, no holes of transparent materials. Radiance is zero.
"""

from collections.abc import Callable

import numpy as np

from ..core.rays import Hits, Rays
from ..core.snapshot import Instance, SceneSnapshot
from ..core.spaces import FAR


def geometric_tracer(scene: SceneSnapshot, first: Callable[[Instance, Rays], tuple[np.ndarray, np.ndarray]]) -> Callable[..., Hits]:
    """trace(rays, hide=names of objects, samples=1, ...) -> Hits, radiance 0, normals those of flat triangles, towards the ray's start. first:
    intersect.first_hits of the same scene."""
    seen = [i for i in scene.instances if i.visible_glossy and len(scene.meshes[i.mesh].triangles)]
    boxes = np.array([scene.bounds([i]) for i in seen]).reshape(-1, 2, 3)
    names = tuple(dict.fromkeys(i.object_name for i in scene.instances))
    number = {name: k for k, name in enumerate(names)}

    def trace(rays: Rays, hide=(), samples: int = 1, *, glossy: bool = False, **_progress) -> Hits:
        count = len(rays)
        nearest, of, normal = np.full(count, np.inf), np.full(count, -1, np.int32), np.zeros((count, 3), np.float32)
        entries = np.stack([_entry(box, rays) for box in boxes], -1) if len(seen) else np.zeros((count, 0))
        for k in np.argsort(np.where(np.isfinite(entries), entries, 1e30).mean(0)) if count else ():
            if seen[k].object_name in hide:
                continue
            some = np.flatnonzero(entries[:, k] < nearest)
            if len(some):
                distance, facing = first(seen[k], Rays(rays.origin[some], rays.direction[some]))
                closer = distance < nearest[some]
                nearest[some[closer]], of[some[closer]], normal[some[closer]] = distance[closer], number[seen[k].object_name], facing[closer]
        hit = np.isfinite(nearest)
        position = rays.origin + rays.direction * np.where(hit, nearest, FAR)[:, None]
        normal *= np.where(np.einsum("nx,nx->n", normal, rays.direction) > 0, -1.0, 1.0)[:, None].astype(np.float32)
        nothing = np.zeros((count, 3), np.float32)
        return Hits(nothing, position.astype(np.float32), normal, of, hit, names, nothing if glossy else None)

    return trace


def _entry(box: np.ndarray, rays: Rays) -> np.ndarray:
    """(N,) where rays enter a box, 0 from inside, inf where they pass it. box: (2, 3) low and high."""
    middle, half = box.mean(0), 0.5 * (box[1] - box[0])
    half = half + 1e-6 * max(half.max(), np.abs(middle).max())  # a box of a plane has no thickness, and float32 rays start beside it
    with np.errstate(divide="ignore", invalid="ignore"):
        inverse = 1.0 / rays.direction.astype(np.float64)
        a, b = ((middle + side * half - rays.origin) * inverse for side in (-1.0, 1.0))
        inside = (np.abs(rays.origin - middle) <= half) | (rays.direction != 0)  # parallel to a side and beyond it: never
        low, high = np.fmax.reduce(np.fmin(a, b), axis=-1), np.fmin.reduce(np.fmax(a, b), axis=-1)
    met = inside.all(-1) & (high >= np.maximum(low, 0.0))
    return np.where(met, np.maximum(low, 0.0), np.inf)
