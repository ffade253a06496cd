"""How wrong an answer is: errors of radiance, of hit points, and of what the eye sees. Arrays in, numbers out.

All means are taken over reflector pixels only. A number that cannot be given (no ray to judge, a missing package) is
None, never NaN: it must survive JSON and be legible in a table. Values that are not finite count as black in the error
measures, so that they cost what they look like, and are counted apart (`nonfinite`).
"""

from dataclasses import dataclass

import numpy as np

from .rays import Answer, Hits, Rays
from .spaces import FAR, STATUS_NONE

# relMSE divides by truth^2 + this: keeps black pixels from ruling the mean (Rousselle et al. 2011, section 6).
RELATIVE_FLOOR = 1e-2
# Median relative difference divides by |truth| + this: the light of a pixel that display shows as black.
DARKEST = 1e-4


@dataclass(frozen=True)
class HitErrors:
    """Where the shown point lies against where the ray really ended; None where no ray can be judged."""

    hit_p50: float | None  # |answer - truth| / scene diagonal, over rays where both end on a surface
    hit_p95: float | None
    angle_p50: float | None  # degrees between the two points seen from the ray's origin
    angle_p95: float | None
    false_hit: float | None  # share of all rays: the answer shows a surface, the ray meets the sky
    missed_hit: float | None  # share of all rays: the answer shows sky or nothing, the ray meets a surface


def rmse(radiance: np.ndarray, truth: np.ndarray) -> float | None:
    """Root of the mean squared difference over rays and channels; (N, 3) scene-linear each."""
    a, t = _finite(radiance), _finite(truth)
    return float(np.sqrt(np.mean((a - t) ** 2))) if a.size else None


def relmse(radiance: np.ndarray, truth: np.ndarray) -> float | None:
    """Mean of (a - t)^2 / (t^2 + RELATIVE_FLOOR): one lamp's reflection does not drown everything else."""
    a, t = _finite(radiance), _finite(truth)
    return float(np.mean((a - t) ** 2 / (t**2 + RELATIVE_FLOOR))) if a.size else None


def median_relative(radiance: np.ndarray, truth: np.ndarray) -> float | None:
    """Median over rays of the largest channel difference over the truth's largest channel."""
    a, t = _finite(radiance), _finite(truth)
    if not a.size:
        return None
    return float(np.median(np.abs(a - t).max(-1) / (np.abs(t).max(-1) + DARKEST)))


def nonfinite(*arrays: np.ndarray) -> int:
    """Number of NaN or infinite values in the arrays."""
    return int(sum(np.count_nonzero(~np.isfinite(a)) for a in arrays))


def is_surface(position: np.ndarray, origin: np.ndarray) -> np.ndarray:
    """(N,) bool: the point is on a surface; FAR / 2 or more from the origin it is the sky, not finite is nothing."""
    with np.errstate(invalid="ignore", over="ignore"):
        distance = np.linalg.norm(np.asarray(position, np.float64) - origin, axis=-1)
    return np.isfinite(distance) & (distance < FAR / 2)


def hit_distance_error(answer: Answer, truth: Hits, rays: Rays, diagonal: float) -> np.ndarray:
    """(N,) float64: |answer - truth| / diagonal; inf = false hit, -inf = missed hit, nan = both show sky."""
    if diagonal <= 0:
        raise ValueError(f"the scene's diagonal must be positive, not {diagonal}")
    origin = rays.origin.astype(np.float64)
    shown = is_surface(answer.position, origin) & (answer.status != STATUS_NONE)
    real = np.asarray(truth.hit, bool)
    with np.errstate(invalid="ignore", over="ignore"):
        length = np.linalg.norm(answer.position.astype(np.float64) - truth.position, axis=-1) / diagonal
    return np.select([shown & real, shown, real], [length, np.inf, -np.inf], np.nan)


def hit_errors(answer: Answer, truth: Hits, rays: Rays, diagonal: float) -> HitErrors:
    """The hit-point measures of the design's table."""
    error = hit_distance_error(answer, truth, rays, diagonal)
    if not len(error):
        return HitErrors(None, None, None, None, None, None)
    both = np.isfinite(error)
    angle = _angle(answer.position[both] - rays.origin[both], truth.position[both] - rays.origin[both])
    return HitErrors(
        *_percentiles(error[both]),
        *_percentiles(angle),
        false_hit=float(np.mean(error == np.inf)),
        missed_hit=float(np.mean(error == -np.inf)),
    )


def _angle(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Degrees between vectors. atan2 of cross and dot: acos loses everything below 0.02 degrees."""
    a, b = a.astype(np.float64), b.astype(np.float64)
    return np.degrees(np.arctan2(np.linalg.norm(np.cross(a, b), axis=-1), np.sum(a * b, -1)))


def _percentiles(values: np.ndarray) -> tuple[float | None, float | None]:
    return tuple(float(v) for v in np.percentile(values, (50, 95))) if len(values) else (None, None)


def _finite(values: np.ndarray) -> np.ndarray:
    values = np.asarray(values, np.float64)
    return np.where(np.isfinite(values), values, 0.0)
