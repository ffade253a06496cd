"""HDR radiance as values in [0, 1] for images of few bits a texel (core/bc1.py): a logarithm, per channel.

    e = log2(1 + c / base) / stops,  stops = log2(1 + peak / base);  c = base (2^(e stops) - 1)

`base` is a share of the image's median: below it the curve is nearly linear, so black needs no exception; above it equal steps
of e are equal factors of c, up to the peak, however bright. docs/decisions.md ("Block-compressed images") compares bases,
roots instead of the logarithm, and ratios of channels.
"""

from collections.abc import Mapping

import numpy as np

from . import bc1

BASE = 1 / 16  # of the median of what is not black
# At most: with a darker base float32 and 5:6:5 bits have nothing left for the middle. A sun of 7e4 in a scene of 0.1 needs 23.
MOST_STOPS = 28.0
_LEAST = 1e-20  # a darker peak is black: its base would be no float32 that GPUs keep
_SAMPLES = 1 << 20  # values that the median is taken of
_ROWS = 32  # texel rows encoded at a time


def curve(radiance: np.ndarray) -> dict[str, float]:
    """The uniforms `code_base` and `code_stops` for (H, W, 3) radiance; what is not above 0 or not finite counts as black."""
    peak = max((float(_clean(radiance[row : row + _ROWS]).max()) for row in range(0, len(radiance), _ROWS)), default=0.0)
    if peak < _LEAST:
        return {"code_base": 1.0, "code_stops": 1.0}
    step = max(radiance.size // (3 * _SAMPLES), 1)
    some = _clean(radiance.reshape(-1, 3)[::step])
    middle = float(np.median(some[some > 0])) if (some > 0).any() else peak
    base = max(BASE * middle, peak / (2.0**MOST_STOPS - 1.0))
    return {"code_base": base, "code_stops": float(np.log2(1.0 + peak / base))}


def encode(radiance: np.ndarray, uniforms: Mapping[str, float]) -> np.ndarray:
    """float32 in [0, 1], of the same shape; negative and non-finite radiance becomes 0."""
    code = np.log2(1.0 + _clean(radiance) * np.float32(1.0 / uniforms["code_base"]))
    code *= np.float32(1.0 / uniforms["code_stops"])
    return np.minimum(code, 1.0, out=code)


def compress(radiance: np.ndarray) -> tuple[np.ndarray, dict[str, float]]:
    """((H / 4, W / 4, 8) uint8 blocks of (H, W, 3) radiance, the uniforms), in memory that does not grow with H."""
    uniforms = curve(radiance)
    parts = [bc1.encode(encode(radiance[row : row + _ROWS], uniforms)) for row in range(0, len(radiance), _ROWS)]
    return np.concatenate(parts), uniforms


def decode(k, uniforms: Mapping, code):
    """Radiance of a code, as a kernel (uniforms: asset.uniforms) or, with NumPy for k, of arrays."""
    return (k.exp2(code * uniforms["code_stops"]) - 1.0) * uniforms["code_base"]


def _clean(radiance: np.ndarray) -> np.ndarray:
    return np.maximum(np.nan_to_num(np.asarray(radiance, np.float32), nan=0.0, posinf=0.0, neginf=0.0), 0.0)
