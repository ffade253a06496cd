"""Pictures of errors: false colours that read in print, in the dark, and without red or green."""

import numpy as np

# Black, violet, orange, pale yellow: rising lightness throughout.
_STOPS = np.array([[0.0, 0.0, 0.02], [0.34, 0.06, 0.43], [0.74, 0.21, 0.33], [0.98, 0.55, 0.04], [0.99, 1.0, 0.64]])
FALSE_HIT = (0.1, 0.75, 0.95)  # shows a surface where the ray meets the sky
MISSED_HIT = (0.2, 0.35, 0.95)  # shows sky where the ray meets a surface
OUTSIDE = 0.22  # grey of pixels that are not judged

DIFFERENCE_FULL = 0.5  # of the display range: what the brightest false colour stands for
HIT_DECADES = (-4.0, 0.0)  # log10 of the hit error / diagonal, from black to brightest


def false_colour(values: np.ndarray) -> np.ndarray:
    """(..., 3) of values 0..1."""
    at = np.clip(np.nan_to_num(values, nan=0.0), 0, 1)
    x = np.linspace(0, 1, len(_STOPS))
    return np.stack([np.interp(at, x, _STOPS[:, c]) for c in range(3)], -1)


def difference_map(picture: np.ndarray, truth: np.ndarray, mask: np.ndarray) -> np.ndarray:
    """(H, W, 3): largest channel difference of two display-encoded pictures, DIFFERENCE_FULL at the bright end."""
    difference = np.abs(np.clip(picture, 0, 1) - np.clip(truth, 0, 1)).max(-1) / DIFFERENCE_FULL
    return np.where(mask[..., None], false_colour(difference), OUTSIDE).astype(np.float32)


def hit_error_map(error: np.ndarray, mask: np.ndarray) -> np.ndarray:
    """(H, W, 3) of core.metrics.hit_distance_error, (N,) for the mask's pixels, on a logarithmic scale."""
    low, high = HIT_DECADES
    with np.errstate(divide="ignore", invalid="ignore"):
        shade = (np.log10(np.abs(error)) - low) / (high - low)
    colours = false_colour(shade)
    colours[error == np.inf] = FALSE_HIT
    colours[error == -np.inf] = MISSED_HIT
    colours[np.isnan(error)] = 0.0  # both show sky: nothing to judge, nothing wrong
    out = np.full(mask.shape + (3,), OUTSIDE, np.float32)
    out[mask] = colours
    return out
