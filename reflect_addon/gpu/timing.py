"""Milliseconds without a GPU timer: N against 2 N submissions, each ended by a read-back; the difference is N frames.

Whatever is compared is timed in turns, and a ratio is the median of the turns' own ratios: what else the machine does
falls on all of them alike. On software OpenGL only ratios of figures from one run mean anything.

Where the processor draws, its own time says what a frame costs even while others use the machine: `processor_clock`.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from time import perf_counter, process_time

import numpy as np


@dataclass(frozen=True)
class Work:
    """Something to be timed."""

    submit: Callable[[], object]  # one frame
    finish: Callable[[], object]  # waits for all that was submitted


@dataclass(frozen=True)
class Times:
    ms: np.ndarray  # (works, turns) float64, of one frame each

    def median(self, work: int) -> float:
        return float(np.median(self.ms[work]))

    def spread(self, work: int) -> float:
        """Half the range between the quartiles, ms."""
        low, high = np.percentile(self.ms[work], [25, 75])
        return float(high - low) / 2

    def ratio(self, work: int, base: int) -> float | None:
        """How many times as long as the base; None where the base took no measurable time."""
        usable = self.ms[base] > 0
        return float(np.median(self.ms[work, usable] / self.ms[base, usable])) if usable.any() else None


def processor_clock() -> Callable[[], float]:
    """Seconds of this process's threads, on a device that is one of them; elsewhere seconds of the wall clock."""
    from .device import describe

    return process_time if describe()["device"] == "SOFTWARE" else perf_counter


def time_in_turns(
    works: Sequence[Work], turns: int, frames: int, clock: Callable[[], float] = perf_counter
) -> Times:
    """Each work `turns` times, one after the other, after a warm-up. A difference below zero is noise and counts as zero."""
    for work in works:
        for _ in range(2):
            work.submit()
        work.finish()
    return Times(np.array([[_time(work, frames, clock) for work in works] for _ in range(turns)]).T.reshape(len(works), turns))


def frame_seconds(work: Work) -> float:
    """About how long a frame takes, after one that warms up."""
    for _ in range(2):
        start = perf_counter()
        work.submit()
        work.finish()
    return perf_counter() - start


def close_ratio(
    work: Work, base: Work, turns: int, frames: int, clock: Callable[[], float] = perf_counter
) -> float:
    """How many times as long as the base a work takes that takes about as long: the median of whole runs' ratios, the one
    and the other going first in turns.

    A run's read-back counts here, which moves a ratio near 1 by less than it scatters where that is left out: a difference
    of two runs is three times as uncertain as their sum. Many short runs tell more than few long ones.
    """
    pair = (work, base)
    for one in pair:
        _spent(one, 2, clock)
    ratios = []
    for turn in range(turns):
        ms = {which: _spent(pair[which], frames, clock) for which in ((0, 1) if turn % 2 else (1, 0))}
        ratios.append(ms[0] / ms[1])
    return float(np.median(ratios))


def _time(work: Work, frames: int, clock) -> float:
    once, twice = (_spent(work, count, clock) for count in (frames, 2 * frames))
    return max(twice - once, 0.0) / frames * 1e3


def _spent(work: Work, frames: int, clock) -> float:
    """Seconds of so many frames and the read-back that waits for them."""
    start = clock()
    for _ in range(frames):
        work.submit()
    work.finish()
    return clock() - start
