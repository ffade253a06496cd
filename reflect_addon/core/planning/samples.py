"""The rays that a plan is made for: what the given cameras see of each reflector, or, where nobody knows them, what viewers anywhere around it would.

Rays are drawn twice: PLANNED with, and HELD_OUT, which no choice has seen, to prove it with.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ..job import BakeJob
from ..lamp_hits import with_lamps
from ..rays import Hits, RayMap, Rays
from ..reflected_samples import LIFT, sample_rays, seen_by_viewers
from ..snapshot import Instance

PLANNED, HELD_OUT = 1500, 1500  # rays of a reflector: a 95th percentile of so many is known to a hundredth of the rays
# A reflector that covers less of the cameras' pixels than this is not seen: one of 500 x 500 pixels.
UNSEEN = 4e-6


@dataclass(frozen=True)
class Sample:
    """Rays off one reflector and what they meet."""

    rays: Rays
    truth: Hits


@dataclass(frozen=True)
class Seen:
    """One reflector as it is seen."""

    reflector: Instance
    share: float  # of the cameras' pixels that show it; of its own area among all reflectors' where there is no camera
    by_cameras: bool
    planned: Sample
    held_out: Sample


def seen_by_cameras(
    maps: Sequence[RayMap], closer: Sequence[RayMap], job_of: Callable[[Instance], BakeJob], reflectors: Sequence[Instance], seed: int = 11
) -> list[Seen]:
    """One for each reflector; without rays where no camera sees it. maps: of the same scene, and closer looks at parts of them."""
    rng = np.random.default_rng(seed)
    pixels = max(sum(m.reflector.size for m in maps), 1)
    found = []
    for reflector in reflectors:
        index = maps[0].reflector_names.index(reflector.name)
        masks = [m.reflector == index for m in (*maps, *closer)]
        origin, direction, normal = (
            np.concatenate([getattr(m, name)[mask] for m, mask in zip((*maps, *closer), masks, strict=True)]) for name in ("origin", "direction", "normal")
        )
        job = job_of(reflector)
        order = rng.permutation(len(origin))[: PLANNED + HELD_OUT]
        start = (origin[order] + normal[order] * LIFT * job.scene.diagonal()).astype(np.float32)
        found.append(_seen(job, Rays(start, direction[order].astype(np.float32)), sum(m.sum() for m in masks[: len(maps)]) / pixels, True))
    return found


def seen_around(job_of: Callable[[Instance], BakeJob], reflectors: Sequence[Instance], seed: int = 11) -> list[Seen]:
    """One for each reflector, seen from anywhere whence the way to it is free."""
    areas = [_area(job_of(r)) for r in reflectors]
    found = []
    for reflector, area in zip(reflectors, areas, strict=True):
        job = job_of(reflector)
        rays, hits = seen_by_viewers(job, *sample_rays(job, PLANNED + HELD_OUT, seed))
        found.append(_seen(job, rays, area / max(sum(areas), 1e-300), False, hits))
    return found


def _seen(job: BakeJob, rays: Rays, share: float, by_cameras: bool, hits: Hits | None = None) -> Seen:
    hits = job.trace(rays) if hits is None else hits
    hits = with_lamps(hits, rays, job.scene, job.intersect)
    half = -(-len(rays) // 2)
    parts = [Sample(Rays(rays.origin[s], rays.direction[s]), hits.part(s)) for s in (slice(0, half), slice(half, None))]
    return Seen(job.reflector, float(share), by_cameras, *parts)


def _area(job: BakeJob) -> float:
    corners = job.scene.world_positions(job.reflector)[job.scene.meshes[job.reflector.mesh].triangles]
    return float(np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=-1).sum() / 2)
