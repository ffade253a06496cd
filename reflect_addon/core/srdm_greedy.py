"""Rows simplified as in the paper: the worst segment is split where it is worst, until m points are used [4.2].

All rows take a step at once: a step looks at each row's worst segment only, so the work falls with the segments'
lengths as it would with the paper's priority queue.

Where we depart. Ties are decided (the paper does not say): the first of a segment's samples that are equally far off, and
of segments that are equally bad the one whose worst sample is farthest left. A segment's priority is one whole number
of 32 bits, its error in parts of a depth step over its worst sample counted from the right, so the largest decides
both. gpu/glsl/srdm.comp.glsl does the same with the same numbers.
"""

from collections.abc import Callable

import numpy as np

from .srdm import MAX_SIDE, PARTS, Rows, steps_of, table_of

_PLACE = MAX_SIDE - 1  # the bits of a priority that hold a sample
# Samples that are looked at together: a dozen arrays of them stay in a processor's cache, those of all rows do not.
_TOGETHER = 1 << 15


def simplify(rows: Rows, m: int, seen: Callable[[np.ndarray, np.ndarray], object] | None = None) -> np.ndarray:
    """(R, m, 2) float32 table of the rows' greedy poly-lines.

    `seen(row, samples)` is told how many samples are looked at in each row, step by step: work that can be counted.
    """
    count, w = rows.depth.shape
    q = steps_of(rows.depth).ravel()
    # Segments of each row: first and last sample (counted over all rows), and priority; 0 for one that needs no split.
    slots = max(m - 1, 1)
    base = w * np.arange(count)
    used = np.bincount(rows.row, minlength=count)  # segments
    place = np.arange(len(rows.row)) - (np.cumsum(used) - used)[rows.row]
    first, last = base[rows.row] + rows.first, base[rows.row] + rows.last
    a, b = np.zeros((2, count, slots), np.int64)
    priority = np.zeros((count, slots), np.uint32)
    a[rows.row, place], b[rows.row, place] = first, last
    priority[rows.row, place] = _priority(q, first, last, rows.first)
    if seen:
        seen(rows.row, rows.last - rows.first)
    points = 2 * used
    chosen = []
    row = np.flatnonzero(points)
    while True:
        row = row[points[row] < m]
        ahead = priority[row, : used[row].max(initial=1)]
        slot = np.argmax(ahead, axis=1)
        worst = ahead[np.arange(len(row)), slot]
        split = worst > 0
        row, slot, worst = row[split], slot[split], worst[split]
        if not len(row):
            break
        left, right, fresh = a[row, slot], b[row, slot], used[row]
        if seen:
            seen(row, right - left)
        middle = base[row] + _PLACE - (worst & _PLACE).astype(np.int64)
        chosen.append(middle)
        b[row, slot] = a[row, fresh] = middle
        b[row, fresh] = right
        starts = np.concatenate([left, middle])
        both = _priority(q, starts, np.concatenate([middle, right]), starts % w)
        priority[row, slot], priority[row, fresh] = both[: len(row)], both[len(row) :]
        used[row] += 1
        points[row] += 1
    return _table(rows, first, last, np.concatenate([np.zeros(0, np.int64), *chosen]), m)


def _priority(q: np.ndarray, a: np.ndarray, b: np.ndarray, column: np.ndarray) -> np.ndarray:
    """(S,) uint32 priorities of the segments from a to b (places in q); column: a's sample in its row."""
    out = np.zeros(len(a), np.uint32)
    some = np.flatnonzero(b - a > 1)
    if not len(some):
        return out
    a, b, column = a[some], b[some], column[some]
    length = (b - a).astype(np.int32)
    stop = np.cumsum(length - 1, dtype=np.int64)
    cuts = np.unique([0, *np.searchsorted(stop, np.arange(_TOGETHER, stop[-1], _TOGETHER)), len(a)])
    parts = [slice(*cut) for cut in zip(cuts[:-1], cuts[1:], strict=True)]
    largest = np.concatenate([_largest(q, a[part], b[part], length[part]) for part in parts])
    off, k = largest // MAX_SIDE, _PLACE - largest % MAX_SIDE
    error = (off * PARTS + length - 1) // length  # rounded up: only what is met exactly has none
    out[some] = np.where(off > 0, error * MAX_SIDE + (_PLACE - column - k), 0)
    return out


def _largest(q: np.ndarray, a: np.ndarray, b: np.ndarray, length: np.ndarray) -> np.ndarray:
    """(S,) int64: how far each segment's worst sample is off it, times its length, above the bits that hold the sample."""
    inner = length - 1
    stop = np.cumsum(inner, dtype=np.int32)
    start = stop - inner
    k = np.arange(1, stop[-1] + 1, dtype=np.int32)
    k -= np.repeat(start, inner)
    # At most STEPS * MAX_SIDE, in place: another array would be another way through memory.
    off = q[k + np.repeat(a, inner)]
    off -= np.repeat(q[a], inner)
    off *= np.repeat(length, inner)
    risen = np.repeat(q[b] - q[a], inner)
    risen *= k
    off -= risen
    np.abs(off, out=off)
    # The sample below the error: the largest sum is the largest error, the first one on a tie.
    both = off.astype(np.int64)
    both *= MAX_SIDE
    both += _PLACE - k
    return np.maximum.reduceat(both, start)


def _table(rows: Rows, first: np.ndarray, last: np.ndarray, splits: np.ndarray, m: int) -> np.ndarray:
    """The chosen samples in order. Each has two places, since a span of one sample begins and ends with it."""
    count, w = rows.depth.shape
    kind = np.zeros(2 * count * w, np.uint8)
    kind[2 * splits], kind[2 * first], kind[2 * last + 1] = 1, 2, 3
    at = np.flatnonzero(kind)
    row, sample = np.divmod(at >> 1, w)
    return table_of(rows, row, sample, kind[at] == 2, kind[at] == 3, m)
