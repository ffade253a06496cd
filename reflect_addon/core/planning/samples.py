"""The rays that a plan is made for: what the given cameras see of each reflector, or, where nobody knows them, what viewers anywhere around it would.

Rays are drawn twice: PLANNED with, and HELD_OUT, which no choice has seen, to prove it with.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ..job import BakeJob
from ..lamp_hits import with_lamps
from ..rays import Hits, RayMap, Rays
from ..reflected_samples import lifted, sample_rays, seen_by_viewers
from ..snapshot import Instance

PLANNED, HELD_OUT = 1500, 1500  # rays of a reflector: a 95th percentile of so many is known to a hundredth of the rays
# A reflector that covers less of the cameras' pixels than this is not seen: one of 500 x 500 pixels.
UNSEEN = 4e-6


@dataclass(frozen=True)
class Sample:
    """Rays off one reflector and what they meet."""

    rays: Rays
    truth: Hits
    pixel: np.ndarray  # (N,) degrees: how large a pixel of the picture looks from each ray's start, where the ray ends; 0 without a picture


@dataclass(frozen=True)
class Seen:
    """One reflector as it is seen."""

    reflector: Instance
    share: float  # of the cameras' pixels that show it; of its own area among all reflectors' where there is no camera
    by_cameras: bool
    planned: Sample
    held_out: Sample


def seen_by_cameras(
    maps: Sequence[RayMap], closer: Sequence[RayMap], scales: Sequence[float], job_of: Callable[[Instance], BakeJob], reflectors: Sequence[Instance],
    seed: int = 11,
) -> list[Seen]:  # fmt: skip
    """One for each reflector; without rays where no camera sees it. maps: of the same scene, and closer looks at parts of them; scales: what a pixel of the
    picture is of one of each map's, maps and closer ones."""
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
        across = np.concatenate([_pixel_ways(m, mask) * s for m, mask, s in zip((*maps, *closer), masks, scales, strict=True)])[order]
        start = lifted(origin[order], normal[order], job.scene.diagonal())
        found.append(_seen(job, Rays(start, direction[order].astype(np.float32)), sum(m.sum() for m in masks[: len(maps)]) / pixels, across))
    return found


def seen_around(job_of: Callable[[Instance], BakeJob], reflectors: Sequence[Instance], seed: int = 11) -> list[Seen]:
    """One for each reflector, seen from anywhere whence the way to it is free."""
    areas = [_area(job_of(r)) for r in reflectors]
    found = []
    for reflector, area in zip(reflectors, areas, strict=True):
        job = job_of(reflector)
        rays, hits = seen_by_viewers(job, *sample_rays(job, PLANNED + HELD_OUT, seed))
        found.append(_seen(job, rays, area / max(sum(areas), 1e-300), None, hits))
    return found


def _seen(job: BakeJob, rays: Rays, share: float, across: np.ndarray | None, hits: Hits | None = None) -> Seen:
    """across: (N, 2) of _pixel_ways; None where no camera says what is seen."""
    hits = job.trace(rays) if hits is None else hits
    hits = with_lamps(hits, rays, job.scene, job.intersect)
    pixel = np.zeros(len(rays))
    if across is not None and len(rays):
        far = np.linalg.norm(hits.position.astype(np.float64) - rays.origin, axis=-1)
        pixel = np.degrees(np.arctan2(across[:, 0] + across[:, 1] * far, far))
    half = -(-len(rays) // 2)
    parts = [Sample(Rays(rays.origin[s], rays.direction[s]), hits.part(s), pixel[s]) for s in (slice(0, half), slice(half, None))]
    return Seen(job.reflector, float(share), across is not None, *parts)


def _pixel_ways(ray_map: RayMap, mask: np.ndarray) -> np.ndarray:
    """(N, 2) of a reflector's pixels: how far the next pixel's ray starts from this one's, m, and how far both part over a metre, as means of the pixels beside
    and above. Where these show something else, the median of the others."""
    found = np.full((*mask.shape, 2), np.nan)
    for axis in (0, 1):
        low, high = [slice(None)] * 2, [slice(None)] * 2
        low[axis], high[axis] = slice(None, -1), slice(1, None)
        low, high = tuple(low), tuple(high)
        both = mask[low] & mask[high]
        ways = [np.linalg.norm((getattr(ray_map, n)[high] - getattr(ray_map, n)[low]).astype(np.float64), axis=-1) for n in ("origin", "direction")]
        new = np.where(both[..., None], np.stack(ways, -1), np.nan)
        found[low] = np.where(np.isnan(found[low]), new, np.where(np.isnan(new), found[low], (found[low] + new) / 2))
    some = found[mask]
    known = ~np.isnan(some[:, 0])
    some[~known] = np.median(some[known], axis=0) if known.any() else 0.0
    return some


def _area(job: BakeJob) -> float:
    corners = job.scene.world_positions(job.reflector)[job.scene.meshes[job.reflector.mesh].triangles]
    return float(np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=-1).sum() / 2)
