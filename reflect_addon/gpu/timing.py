"""Milliseconds without a GPU timer: N against 2 N submissions, each ended by a read-back; the difference is N frames.

On software OpenGL only ratios of figures from one run mean anything.
"""

from collections.abc import Callable
from dataclasses import dataclass
from time import perf_counter

import numpy as np


@dataclass(frozen=True)
class FrameTime:
    ms: float  # ray map to resolve, median per frame
    spread: float  # ms, half the range between the quartiles
    ray_map_ms: float  # of which the ray map


def time_submissions(submit: Callable, finish: Callable, repeats: int, frames: int) -> tuple[float, float]:
    """(median, half the interquartile range) in ms of one submit(). finish() waits for all of them.

    A difference below zero is noise and counts as zero.
    """
    for _ in range(2):
        submit()
    finish()
    samples = []
    for _ in range(repeats):
        spent = []
        for count in (frames, 2 * frames):
            start = perf_counter()
            for _ in range(count):
                submit()
            finish()
            spent.append(perf_counter() - start)
        samples.append(max(spent[1] - spent[0], 0.0) / frames * 1e3)
    low, high = np.percentile(samples, [25, 75])
    return float(np.median(samples)), float(high - low) / 2
