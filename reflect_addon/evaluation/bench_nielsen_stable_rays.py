"""Rays among mirrors, followed through Blender's BVH trees: a tracer of the stability table's cases, for their bakes and for their truth.

Metals send on what meets them, by Schlick's curve, and nothing of their own. Normals are those of faces: what round mirrors show is coarse.
"""

from dataclasses import replace

import numpy as np

from ..core.rays import Hits, Rays
from .bench_nielsen_stable_cases import Case
from .stability_scene import MIRROR, Surfaces

DEPTH = 4  # mirrors on a ray's way
LIFT = 2e-5  # units that a reflected ray starts above its surface: trees are good to 1e-6 of an object


class Reflecting:
    """A tracer of a case."""

    def __init__(self, case: Case, surfaces: Surfaces):
        self.surfaces, self.lift = surfaces, LIFT * case.size
        self.mirrors = [index for index, instance in enumerate(case.scene.instances) if instance.is_reflector]

    def trace(self, rays: Rays, hide=(), samples: int = 1, **unused) -> Hits:
        return self.followed(rays, DEPTH, hide)[0]

    def followed(self, rays: Rays, most: int, hide=()) -> tuple[Hits, np.ndarray]:
        """(what the rays meet first, with the radiance that they bring; (N,) mirrors that they meet, `most` at most)."""
        hits = self.surfaces.trace(rays, hide)
        met = np.isin(hits.object, self.mirrors).astype(int)
        again = np.flatnonzero(met)
        radiance = hits.radiance.copy()
        radiance[again] = 0.0
        if len(again) and most > 1:
            normal, direction = hits.normal[again].astype(np.float64), rays.direction[again].astype(np.float64)
            cosine = -(normal * direction).sum(-1, keepdims=True)
            onward = Rays((hits.position[again] + self.lift * normal).astype(np.float32), (direction + 2 * cosine * normal).astype(np.float32))
            further, more = self.followed(onward, most - 1)
            base = np.array(MIRROR.base_color)
            radiance[again] = (base + (1 - base) * (1 - np.clip(cosine, 0, 1)) ** 5) * further.radiance
            met[again] += more
        return replace(hits, radiance=radiance), met
