"""Which slabs and directions some reflected ray can reach: what none does is neither traced nor given memory.

Problem. Behind a mirror on a wall is the wall: no viewer stands there and no reflected ray goes there.
Idea. Rays from all over the reflector's surface, as viewers anywhere would see them (reflected_samples.py); those whose
viewer would stand in or behind something else are dropped. What is left says, in BINS x BINS parts of each slab's
directions, where rays go, with a part's room around each.
Limits. A reflector that moves along a way, or that shares its cell, may look anywhere. Decided without tracing, so that
the memory is known before the bake; 4096 rays a reflector miss what fewer than one in a thousand does.
"""

from dataclasses import dataclass
from itertools import product

import numpy as np

from . import spaces
from .job import BakeJob
from .light_field import SLABS
from .rays import Rays
from .reflected_samples import COUNT, VIEW, sample_rays

BINS = 8  # parts of a slab's directions along each of its axes


@dataclass(frozen=True)
class Reach:
    """(SLABS, BINS, BINS) bool: parts of the slabs' directions, by (face, t, s), that rays go to."""

    parts: np.ndarray

    def slabs(self) -> tuple[int, ...]:
        """Faces that any ray goes to."""
        return tuple(int(f) for f in np.flatnonzero(self.parts.any((1, 2))))

    def is_everything(self) -> bool:
        return bool(self.parts.all())

    def of(self, face: int):
        """wanted() for light_field.bundle; None where the whole slab is reached."""
        if self.parts[face].all():
            return None

        def wanted(_rows, _point, direction):
            axis = face // 2
            s, t = (_bin(direction[..., (axis + n) % 3] / np.abs(direction[..., axis])) for n in (1, 2))
            return self.parts[face, t, s]

        return wanted


EVERYTHING = Reach(np.ones((SLABS, BINS, BINS), bool))


def reach_of(job: BakeJob, moves: bool) -> Reach:
    """What the job's reflectors can reach."""
    if moves or job.together or not len(job.scene.meshes[job.reflector.mesh].triangles):
        return EVERYTHING
    rays, towards = sample_rays(job, COUNT, seed=9)
    if _is_open(job):
        rays = Rays(np.concatenate([rays.origin] * 2), np.concatenate([rays.direction, -rays.direction]))
        towards = np.concatenate([towards, -towards])
    free = _seen(job, Rays(rays.origin, towards))
    if not free.any():
        return EVERYTHING
    # A part's room around each, across the slabs' edges too: there two slabs are blended.
    direction = rays.direction[free].astype(np.float64)
    direction /= np.abs(direction).max(-1, keepdims=True)
    parts = np.zeros((SLABS, BINS, BINS), bool)
    for around in product((-2 / BINS, 0.0, 2 / BINS), repeat=3):
        face, s, t = spaces.cube_coordinates(direction + around)
        parts[face, _bin(t), _bin(s)] = True
    return Reach(parts)


def _is_open(job: BakeJob) -> bool:
    """Whether the reflector's mesh has an edge of one triangle: its back may be seen, and mirrors too."""
    triangles = job.scene.meshes[job.reflector.mesh].triangles
    edges = np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    return bool((np.unique(edges, axis=0, return_counts=True)[1] == 1).any())


def _bin(coordinate: np.ndarray) -> np.ndarray:
    """Parts from slopes; those beyond 45 degrees belong to the last."""
    return np.clip(((coordinate + 1) / 2 * BINS).astype(int), 0, BINS - 1)


def _seen(job: BakeJob, towards: Rays) -> np.ndarray:
    """(N,) bool: whether a viewer could stand there: nothing of the others lies within VIEW of the reflector's radius."""
    low, high = job.scene.bounds([job.reflector])
    clear = VIEW * float(np.linalg.norm(high - low)) / 2
    free = np.ones(len(towards), bool)
    for other in job.scene.instances:
        if other.object_name == job.reflector.object_name:
            continue
        other_low, other_high = job.scene.bounds([other])
        if (other_low > high + clear).any() or (other_high < low - clear).any():
            continue
        some = np.flatnonzero(free)
        distance = job.intersect(other, Rays(towards.origin[some], towards.direction[some]))
        free[some[distance < clear]] = False
    return free
