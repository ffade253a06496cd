"""What the eye sees: FLIP and SSIM over the reflector's pixels of two display-referred pictures.

FLIP: Andersson et al. 2020, through the package flip-evaluator; SSIM: Wang et al. 2004, through scikit-image. Neither
is needed to run Reflect: without them the number is None and a sentence says so.
"""

from collections.abc import Callable

import numpy as np

_SSIM_WINDOW = 7  # px, scikit-image's default: smaller pictures are padded to it


def flip(picture: np.ndarray, truth: np.ndarray, mask: np.ndarray) -> tuple[float | None, str]:
    """(mean FLIP over the mask, note). Pictures (H, W, 3) display-encoded 0..1, row order does not matter.

    Outside the mask both pictures are the truth's: what surrounds a reflection masks it as in the real frame, and only
    the reflection is judged. None with a note when the mask is empty or the package is missing.
    """
    return _masked(_flip_map, "flip-evaluator", "FLIP", picture, truth, mask)


def ssim(picture: np.ndarray, truth: np.ndarray, mask: np.ndarray) -> tuple[float | None, str]:
    """(mean SSIM over the mask, note), as flip()."""
    return _masked(_ssim_map, "scikit-image", "SSIM", picture, truth, mask)


def _masked(measure: Callable, package: str, name: str, picture, truth, mask) -> tuple[float | None, str]:
    mask = np.asarray(mask, bool)
    if not mask.any():
        return None, f"{name} is not given: no reflector pixel to judge."
    truth = _displayable(truth)
    picture = np.where(mask[..., None], _displayable(picture), truth)
    try:
        values = measure(picture, truth)
    except ImportError:
        return None, f"{name} is not given: the Python package {package} is not installed."
    return float(np.mean(values[mask], dtype=np.float64)), ""


def _flip_map(picture: np.ndarray, truth: np.ndarray) -> np.ndarray:
    from flip_evaluator import evaluate

    values, _, _ = evaluate(truth, picture, "LDR", inputsRGB=True, applyMagma=False, computeMeanError=False)
    return np.asarray(values, np.float32).reshape(truth.shape[:2] + (-1,))[..., 0]


def _ssim_map(picture: np.ndarray, truth: np.ndarray) -> np.ndarray:
    from skimage.metrics import structural_similarity

    height, width = truth.shape[:2]
    pad = [(0, max(_SSIM_WINDOW - height, 0)), (0, max(_SSIM_WINDOW - width, 0)), (0, 0)]
    picture, truth = np.pad(picture, pad, mode="edge"), np.pad(truth, pad, mode="edge")
    _, values = structural_similarity(truth, picture, channel_axis=-1, data_range=1.0, full=True)
    return values.mean(-1)[:height, :width]


def _displayable(picture: np.ndarray) -> np.ndarray:
    """float32 in 0..1; what a screen would show of NaN and infinities: black and white."""
    picture = np.nan_to_num(np.asarray(picture, np.float32), nan=0.0, posinf=1.0, neginf=0.0)
    return np.ascontiguousarray(np.clip(picture, 0.0, 1.0))
