"""The rays of a light field's slabs through trace(), in as few bundles as is good: a slab or a part of one at a time, so that
memory is bounded and what is finished outlasts an interruption; all slabs at once where starting a render takes longer than
tracing its rays."""

from collections.abc import Callable

import numpy as np

from .job import BakeJob
from .lamp_hits import with_lamps
from .light_field import Cell, bundle
from .light_field_slab import rows_of_views
from .rays import Hits, Rays
from .spaces import FACE_NAMES

# Texels of all slabs up to which they are traced together.
TOGETHER = 1 << 19


class SlabTracer:
    """traced(rays) of bake_slab, for the slabs of `wanted` in their order. job.stage hears how far it is."""

    def __init__(self, job: BakeJob, cell: Cell, wanted: dict[int, Callable | None]):
        self._job, self._hide = job, tuple({r.object_name for r in job.reflectors()})
        self._parts = [(face, rows) for face in wanted for rows in rows_of_views(cell)]
        self._done, self._hits, self._at = 0, None, 0
        if self._parts and len(wanted) * cell.slab_side() ** 2 <= TOGETHER:
            bundles = [bundle(cell, face, rows, wanted[face])[0] for face, rows in self._parts]
            rays = Rays(*(np.concatenate([getattr(b, name) for b in bundles]) for name in ("origin", "direction")))
            job.stage(0.0, 1.0, f"{len(wanted)} slabs")
            self._hits = self._trace(rays)

    def __call__(self, rays: Rays) -> Hits:
        if self._hits is not None:
            self._at += len(rays)
            return self._hits.part(slice(self._at - len(rays), self._at))
        count = len(self._parts)
        self._job.stage(self._done / count, (self._done + 1) / count, f"slab {FACE_NAMES[self._parts[self._done][0]]}")
        self._done += 1
        return self._trace(rays)

    def _trace(self, rays: Rays) -> Hits:
        if not len(rays):
            nothing = np.zeros((0, 3), np.float32)
            return Hits(nothing, nothing, nothing, np.zeros(0, np.int32), np.zeros(0, bool))
        hits = self._job.trace(rays, hide=self._hide, samples=int(self._job.settings["samples"]))
        return with_lamps(hits, rays, self._job.scene, self._job.intersect, self._hide)
