"""Flicker: what a picture changes from frame to frame beyond going on as it did, beside what the truth does.

It is the root mean square of display values' second differences in time, at pixels that show the reflector in three frames one after
another. The truth's own is the product of two that differ in their noise alone, so that noise counts as no flicker.
"""

import numpy as np

from ..core.look import Look


def flicker(masks: list[np.ndarray], radiances: list[list[np.ndarray]], look: Look) -> tuple[float, float]:
    """(the method's, the truth's). masks: (H, W) bool of each frame; radiances: of each frame three (N, 3) of its mask's pixels: the
    method's and two truths'."""
    shown = [[_picture(mask, look, r) for r in three] for mask, three in zip(masks, radiances, strict=True)]
    sums, count = np.zeros(2), 0
    for before, now, after in zip(range(len(masks)), range(1, len(masks)), range(2, len(masks))):
        both = masks[before] & masks[now] & masks[after]
        own, first, second = (shown[before][i][both] - 2 * shown[now][i][both] + shown[after][i][both] for i in range(3))
        sums += np.square(own).sum(), (first * second).sum()
        count += own.size
    own, true = np.sqrt(np.maximum(sums, 0.0) / max(count, 1))
    return float(own), float(true)


def _picture(mask: np.ndarray, look: Look, radiance: np.ndarray) -> np.ndarray:
    picture = np.zeros((*mask.shape, 3), np.float32)
    picture[mask] = look.apply(radiance)
    return picture
