"""How far off each pixel of a view is: `ray_errors` of the rays that the view sees, coarse first, then finer, in slices.

Problem. A plan's figures say how well a reflector is shown as a whole; an artist wants to see where, from here, now.
Idea. Every STEP-th pixel of the view has a ray; of these every eighth is measured first, then those between, so that a map of the whole view is there
soon and only becomes finer. What has no ray of its own yet shows its cell's. A slice takes as many rays as the last one says go into SLICE.
Limits. Rays are lines, as in errors_of: the blur of footprints is no error. What a method draws instead of gathering has no error here.
"""

import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from .. import methods
from ..asset import Asset, asset_of
from ..job import BakeJob
from ..kernel import Program
from ..lamp_hits import with_lamps
from ..rays import RayMap, Rays
from ..reflected_samples import lifted
from ..snapshot import Instance
from .errors import Measured, errors_of, measured, program_of
from .samples import Sample

STEP = 4  # px of the picture, along each side, that share a ray
STRIDES = (8, 4, 2, 1)  # of the rays that each round adds, along each side
SLICE = 0.06  # s
# Rays of a slice, whatever it takes: a kernel of thousands of nodes costs 0.08 s for 32 rays, 0.11 for 128 and 0.25 for 7,000 (`contact`, depth maps).
FEWEST = 32
FASTER = 4  # times as many rays as in the slice before, at most; the first has one, since what rays meet is made ready when it is first met


@dataclass(frozen=True)
class Heat:
    """What is known of a view's errors. Row 0 is the bottom; a pixel is STEP of the picture's."""

    degrees: np.ndarray  # (H, W) float32; nan where there is nothing to measure, or nothing was measured yet
    reflector: np.ndarray  # (H, W) int32, as the ray map's
    share: float  # of its rays that were measured
    mean: float  # degrees, of those
    seen: Measured  # of those


def is_measured(asset: Asset | None) -> bool:
    """Whether an asset's kernel answers its reflector's rays: what is drawn instead has no point that a ray is shown."""
    return asset is not None and asset.kind in methods.gathering()


def heat_of(rays: RayMap, assets: Mapping[str, Asset], reflectors: tuple[Instance, ...], job_of: Callable[[Instance], BakeJob]) -> Iterator[Heat | None]:
    """What becomes known, in the end of each round; None after a slice. rays: STEP px of the picture each; reflectors: the scene's, as the map numbers them;
    job_of: jobs_without_light's. Nothing where no reflector that is seen has something to measure."""
    found = [(index, asset_of(assets, reflector)) for index, reflector in enumerate(reflectors)]
    answering = {index: asset for index, asset in found if is_measured(asset)}
    wanted = np.isin(rays.reflector, list(answering))
    if not wanted.any():
        return
    programs: dict[int, Program] = {}  # by asset, which several reflectors may share
    job, degrees = job_of(reflectors[0]), np.full(rays.reflector.shape, np.nan, np.float32)
    sizes = dict.fromkeys(answering, 1)
    yield None
    for stride in STRIDES:
        grid = np.zeros_like(wanted)
        grid[::stride, ::stride] = True
        for index, asset in answering.items():
            if id(asset) not in programs:
                programs[id(asset)] = program_of(asset)
                yield None
            todo = np.flatnonzero(grid & np.isnan(degrees) & (rays.reflector == index))
            while len(todo):
                began, some, todo = time.perf_counter(), todo[: sizes[index]], todo[sizes[index] :]
                degrees.flat[some] = _errors(rays, some, asset, programs[id(asset)], job)
                if len(some) == sizes[index]:  # the last ones of a round tell nothing
                    may = len(some) * SLICE / max(time.perf_counter() - began, 1e-6)
                    sizes[index] = min(max(int(may), FEWEST), FASTER * len(some))
                yield None
        known = ~np.isnan(degrees)
        errors = degrees[known].astype(np.float64)
        share, mean = known.sum() / wanted.sum(), errors.mean() if len(errors) else 0.0
        yield Heat(_filled(degrees, rays.reflector, stride), rays.reflector, float(share), float(mean), measured(errors))


def _errors(rays: RayMap, pixels: np.ndarray, asset: Asset, program: Program, job: BakeJob) -> np.ndarray:
    """(N,) degrees. pixels: flat indices."""
    origin, direction, normal = (getattr(rays, name).reshape(-1, 3)[pixels] for name in ("origin", "direction", "normal"))
    some = Rays(lifted(origin, normal, job.scene.diagonal()), direction)
    truth = with_lamps(job.trace(some), some, job.scene, job.intersect)
    return errors_of(asset, Sample(some, truth, np.zeros(len(some))), program=program)[0]


def _filled(degrees: np.ndarray, reflector: np.ndarray, stride: int) -> np.ndarray:
    """What has no ray yet has the error of its cell's first pixel, where that shows the same reflector."""
    y, x = (n // stride * stride for n in np.indices(degrees.shape))
    return np.where(np.isnan(degrees) & (reflector[y, x] == reflector), degrees[y, x], degrees)
