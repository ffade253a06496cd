"""Where rays meet lamps.

Lamps are no objects: a traced ray shows a lamp but reports the surface behind it (scene/raytrace.py). A map of
distances would so show every lamp at the wrong place, and nothing in it is brighter.
"""

from dataclasses import replace

import numpy as np

from .job import BakeJob
from .rays import Hits, Rays
from .snapshot import Instance


def with_lamps(job: BakeJob, rays: Rays, hits: Hits, hide: tuple[str, ...]) -> Hits:
    """The hits, ended at the lamps that mirrors show; these belong to no object."""
    position, hit, owner = hits.position, hits.hit, hits.object
    for lamp in job.scene.lamps:
        if lamp.object_name in hide or not lamp.visible_glossy:
            continue
        away = np.linalg.norm(position.astype(np.float64) - rays.origin, axis=-1)
        nearer = (distance := job.intersect(lamp, rays)) < np.where(hit, away, np.inf)
        nearer &= rays.direction @ _shining(job, lamp) <= 0.0
        at = rays.origin.astype(np.float64) + rays.direction * np.where(nearer, distance, 0.0)[:, None]
        position = np.where(nearer[:, None], at, position).astype(np.float32)
        hit, owner = hit | nearer, np.where(nearer, -1, owner).astype(np.int32)
    return replace(hits, position=position, hit=hit, object=owner)


def _shining(job: BakeJob, lamp: Instance) -> np.ndarray:
    """(3,) the normal of a flat lamp, which is not there for rays from behind; 0 for one that shines all around."""
    corners = job.scene.world_positions(lamp)[job.scene.meshes[lamp.mesh].triangles]
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    together, alone = cross.sum(0), np.linalg.norm(cross, axis=-1).sum()
    return together if np.linalg.norm(together) > 0.5 * alone else np.zeros(3)
