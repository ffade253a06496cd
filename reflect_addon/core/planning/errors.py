"""How far off answers are, in degrees: how large the way from the point that the ray meets to the point that is shown looks from the ray's start.

The `angle` of results.json (core/metrics.py) is that between the directions of both, and 0 for whatever lies on the ray: a wall that is shown
where something stands before it. Here the way counts whichever direction it has, as its length over the ray's, so that this angle is never
less than that one. A ray that shows the sky for a surface, or a surface for the sky, is WRONG.
"""

from dataclasses import dataclass

import numpy as np

from .. import methods
from ..asset import Asset
from ..kernel import Counts, Program, record, run_numpy
from ..metrics import is_surface
from ..rays import Answer, Hits, Rays
from ..spaces import STATUS_NONE
from .goal import PROMISED
from .samples import Sample

WRONG = {"degrees": 90.0, "pixels": 1e4}  # what a false or a missed hit counts as; nothing is more
# Degrees at which one wrong place is as wrong as another: what is compared when no tolerance is asked for is a mean up to here.
ELSEWHERE = 10.0

EXACT = 0.02  # degrees: nobody sees less, a pixel of a picture a metre away is three times as much
DEVIATIONS = 2.0  # standard ones, of the share of rays that a sample tells: one promise in forty fails by chance


@dataclass(frozen=True)
class Measured:
    """Errors of a bundle of rays, in a goal's unit."""

    p95: float  # what PROMISED of the rays keep within
    promised: float  # the same, for other rays of the kind: not exceeded by DEVIATIONS of what so many rays can tell
    mean: float  # each at most ELSEWHERE
    wrong: float  # share of rays that show a surface for the sky, or the sky for a surface


def errors_of(asset: Asset, sample: Sample, unit: str = "degrees", program: Program | None = None) -> tuple[np.ndarray, Counts]:
    """(degrees or pixels that the asset's answers to the sample's rays are off, (N,), the work that they were). program: program_of(asset), for those who
    ask in many parts."""
    counts = Counts()
    answer = run_numpy(program or program_of(asset), asset, sample.rays, counts=counts)
    return in_unit(ray_errors(answer, sample.truth, sample.rays), sample.pixel, unit), counts


def program_of(asset: Asset) -> Program:
    """Its method's kernel, recorded: as much time as a few hundred rays."""
    return record(methods.get(asset.kind).trace, asset)


def in_unit(error: np.ndarray, pixel: np.ndarray, unit: str) -> np.ndarray:
    """ray_errors in a goal's unit. pixel: (N,) degrees of one pixel, as samples.py has them."""
    if unit == "degrees":
        return error
    return np.where(error < WRONG["degrees"], np.minimum(error / np.maximum(pixel, 1e-9), WRONG[unit]), WRONG[unit])


def ray_errors(answer: Answer, truth: Hits, rays: Rays) -> np.ndarray:
    """(N,) degrees."""
    origin = rays.origin.astype(np.float64)
    shown = is_surface(answer.position, origin) & (answer.status != STATUS_NONE)
    both = shown & truth.hit
    error = np.where(shown != truth.hit, WRONG["degrees"], 0.0)
    way = np.linalg.norm(answer.position[both].astype(np.float64) - truth.position[both], axis=-1)
    error[both] = np.degrees(np.arctan2(way, np.linalg.norm(truth.position[both] - origin[both], axis=-1)))
    return error


def measured(error: np.ndarray, unit: str = "degrees") -> Measured:
    """Of in_unit's errors; nothing is wrong with no ray."""
    if not len(error):
        return Measured(0.0, 0.0, 0.0, 0.0)
    safe = min(PROMISED + DEVIATIONS * np.sqrt(PROMISED * (1 - PROMISED) / len(error)), 1.0)
    p95, promised = np.percentile(error, (100 * PROMISED, 100 * safe))
    return Measured(float(p95), float(promised), float(np.minimum(error, ELSEWHERE).mean()), float(np.mean(error >= WRONG[unit])))


def foretold(coarse: np.ndarray, coarser: np.ndarray, times: float, unit: str = "degrees") -> Measured:
    """What `times` as many texels a side will bring, from a try and one with half as many a side: in_unit's errors of the same rays by both.

    Of the share of rays that are off by more than x, a part s is what the stand-in leaves out, whatever its texels, and a part e lies along edges, in bands as
    wide as texels: s + e in the one try, s + 2 e in the other, s + e / times then (Richardson's extrapolation of a first order, for each x). Errors
    that shrink where they are, and do not only become rarer, are less than that, which is right for a promise. The mean, by which stand-ins are compared, is taken
    to fall on by the factor by which it fell."""
    if not len(coarse):
        return measured(coarse, unit)
    levels = np.concatenate([[0.0], np.sort(coarse)])
    share = _extrapolated(_beyond(coarse, levels), _beyond(coarser, levels), times)
    share = np.maximum.accumulate(share[::-1])[::-1]  # no more rays are beyond a larger error
    left = 1 - PROMISED
    p95, promised = (float(levels[np.argmax(share <= max(most, 0.0))]) for most in (left, left - DEVIATIONS * np.sqrt(PROMISED * left / len(coarse))))
    before, now = measured(coarser, unit), measured(coarse, unit)
    fell = min(now.mean / before.mean, 1.0) if before.mean > 0 else 1.0
    return Measured(p95, promised, float(now.mean * fell ** np.log2(times)), float(_extrapolated(now.wrong, before.wrong, times)))


def _beyond(error: np.ndarray, levels: np.ndarray) -> np.ndarray:
    return 1.0 - np.searchsorted(np.sort(error), levels, side="right") / len(error)


def _extrapolated(coarse, coarser, times: float):
    always = np.clip(2 * coarse - coarser, 0.0, coarse)
    return always + (coarse - always) / times
