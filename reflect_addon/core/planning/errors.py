"""How far off answers are, in degrees: the point that is shown against the point that the ray meets, seen from its start.

It is the `angle` of results.json (core/metrics.py), with one difference: a ray that shows the sky instead of a surface, or a surface instead of
the sky, counts as WRONG, so that a stand-in is not good by leaving out what is hard.
"""

from dataclasses import dataclass

import numpy as np

from ..metrics import angle_between, is_surface
from ..rays import Answer, Hits, Rays
from ..spaces import STATUS_NONE
from .goal import PROMISED

WRONG = 90.0  # degrees that a false or a missed hit counts as
# Degrees at which one wrong place is as wrong as another: what is compared when no tolerance is asked for is a mean up to here.
ELSEWHERE = 10.0

DEVIATIONS = 2.0  # standard ones, of the share of rays that a sample tells: one promise in forty fails by chance


@dataclass(frozen=True)
class Measured:
    """Errors of a bundle of rays."""

    rays: int
    median: float  # degrees
    p95: float  # degrees, that PROMISED of the rays keep within
    promised: float  # the same, for other rays of the kind: not exceeded by DEVIATIONS of what so many rays can tell
    mean: float  # degrees, each at most ELSEWHERE
    wrong: float  # share of rays that show a surface for the sky, or the sky for a surface


def ray_errors(answer: Answer, truth: Hits, rays: Rays) -> np.ndarray:
    """(N,) degrees."""
    origin = rays.origin.astype(np.float64)
    shown = is_surface(answer.position, origin) & (answer.status != STATUS_NONE)
    both = shown & truth.hit
    error = np.where(shown != truth.hit, WRONG, 0.0)
    error[both] = angle_between(answer.position[both] - rays.origin[both], truth.position[both] - rays.origin[both])
    return np.minimum(error, WRONG)


def measured(error: np.ndarray) -> Measured:
    """Of ray_errors; nothing is wrong with no ray."""
    if not len(error):
        return Measured(0, 0.0, 0.0, 0.0, 0.0, 0.0)
    safe = min(PROMISED + DEVIATIONS * np.sqrt(PROMISED * (1 - PROMISED) / len(error)), 1.0)
    median, p95, promised = np.percentile(error, (50, 100 * PROMISED, 100 * safe))
    return Measured(len(error), float(median), float(p95), float(promised), float(np.minimum(error, ELSEWHERE).mean()), float(np.mean(error >= WRONG)))
