"""Which objects a reflector shows: what its rays meet, and what they meet after mirrors that they meet."""

import numpy as np

from ..job import BakeJob
from ..mirrors import mirror_of
from ..rays import Hits, Rays
from ..reflected_samples import LIFT
from .samples import Seen

BOUNCES = 3  # reflections in a row after the reflector's own


def met_by(job: BakeJob, seen: Seen) -> set[str]:
    """Names of objects. job: of the reflector; its trace tells normals."""
    shiny = {i.object_name for i in job.scene.instances if mirror_of(job.scene, i)}
    found: set[str] = set()
    for sample in (seen.planned, seen.held_out):
        rays, hits = sample.rays, sample.truth
        for _ in range(BOUNCES):
            found |= _names(hits)
            rays = _onward(rays, hits, shiny, LIFT * job.scene.diagonal())
            if not len(rays):
                break
            hits = job.trace(rays)
        else:
            found |= _names(hits)
    return found


def _names(hits: Hits) -> set[str]:
    return {hits.object_names[k] for k in np.unique(hits.object[hits.hit])}


def _onward(rays: Rays, hits: Hits, shiny: set[str], lift: float) -> Rays:
    """The rays that have met a mirror, off it."""
    mirrors = [k for k, name in enumerate(hits.object_names) if name in shiny]
    met = hits.hit & np.isin(hits.object, mirrors)
    direction, normal = rays.direction[met].astype(np.float64), hits.normal[met].astype(np.float64)
    off = direction - 2 * np.einsum("nx,nx->n", direction, normal)[:, None] * normal
    return Rays((hits.position[met] + lift * normal).astype(np.float32), off.astype(np.float32))
