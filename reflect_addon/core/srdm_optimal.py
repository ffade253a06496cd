"""Rows simplified as well as m points can: dynamic programming over which samples to keep.

Problem. The paper's greedy split never takes a point back, so early splits stay where a later one makes them useless.
Idea. Of all poly-lines through m of a row's samples, ends of spans included, take the one with the least sum of squared
depth errors [Perez and Vidal 1994, "Optimum polygonal approximation of digitized curves"]. Prefix sums give the error of
any segment at once, so a row of L samples costs m L^2 steps.
Limits. Seconds where greedy takes a fraction of one: for assets that are kept, not for objects that move.
"""

import numpy as np

from .srdm import Rows, table_of

# Bytes of one (rows, L, L) block: keeps the work inside the processor's cache.
BLOCK = 1 << 24


def simplify(rows: Rows, m: int) -> np.ndarray:
    """(R, m, 2) float32 table of the rows' best poly-lines."""
    chosen = []
    which, start = np.unique(rows.row, return_index=True)
    length = np.add.reduceat(rows.last - rows.first + 1, start) if len(start) else np.zeros(0, int)
    order = np.argsort(length, kind="stable")
    while len(order):
        # Rows of about the same length together: a block is as wide as its longest row.
        longest = length[order[-1]]
        take = max(int(BLOCK / (8 * longest * longest)), 1)
        block, order = order[-take:], order[:-take]
        chosen.append(_block(rows, which[block], start[block], longest, m))
    if not chosen:
        return table_of(rows, *np.zeros((2, 0), int), *np.zeros((2, 0), bool), m)
    row, sample, begins, ends = (np.concatenate(parts) for parts in zip(*chosen, strict=True))
    order = np.lexsort((ends, sample, row))
    return table_of(rows, row[order], sample[order], begins[order], ends[order], m)


def _block(rows: Rows, which: np.ndarray, start: np.ndarray, longest: int, m: int):
    """(row, sample, begins, ends) of the points of some rows; `start`: each row's first span."""
    position, begin, end = _laid_out(rows, which, start, longest)
    count = len(which)
    q = np.where(position >= 0, rows.depth[which[:, None], np.maximum(position, 0)], 0).astype(np.float64)
    cost = _segment_costs(position.astype(np.float64), q, begin, end)
    # best[j]: least error of the samples up to j when j and as many before it as there were steps are kept.
    best = np.full((count, longest), np.inf)
    best[:, 0] = 0.0
    back, bests = [], [best]
    for _ in range(m - 1):
        total = best[:, :, None] + cost
        came = np.argmin(total, axis=1)
        best = np.take_along_axis(total, came[:, None], 1)[:, 0]
        back.append(came)
        bests.append(best)
    at = (position >= 0).sum(1) - 1
    # A span of a single sample is one step here and two points in the table.
    single = (begin & end).sum(1)
    final = np.array([b[np.arange(count), at] for b in bests])  # (m, count): error with k + 1 kept samples
    allowed = np.arange(m)[:, None] + 1 + single <= m
    kept = np.argmin(np.where(allowed, final, np.inf), axis=0)
    out_row, out_slot = [], []
    for step in range(m - 1, -1, -1):
        on = kept >= step
        out_row.append(np.flatnonzero(on))
        out_slot.append(at[on])
        if step:
            at = np.where(on, back[step - 1][np.arange(count), at], at)
    r, k = np.concatenate(out_row), np.concatenate(out_slot)
    first, last = begin[r, k], end[r, k]
    both = first & last
    row = np.concatenate([r, r[both]])
    slot = np.concatenate([k, k[both]])
    is_first = np.concatenate([first, np.zeros(both.sum(), bool)])
    is_last = np.concatenate([last & ~both, np.ones(both.sum(), bool)])
    return which[row], position[row, slot], is_first, is_last


def _laid_out(rows: Rows, which: np.ndarray, start: np.ndarray, longest: int):
    """(position, begin, end), each (rows, longest): the samples of a row's spans one after the other; position -1 past
    the last; begin and end: whether it is the first or the last sample of a span."""
    spans = np.searchsorted(rows.row, which, "right") - start
    span = np.concatenate([np.arange(s, s + c) for s, c in zip(start, spans, strict=True)])
    size = rows.last[span] - rows.first[span] + 1
    owner = np.repeat(np.repeat(np.arange(len(which)), spans), size)
    within = np.arange(size.sum()) - np.repeat(np.cumsum(size) - size, size)
    slot = np.arange(len(owner)) - np.searchsorted(owner, owner)
    position = np.full((len(which), longest), -1)
    begin, end = np.zeros((2, len(which), longest), bool)
    position[owner, slot] = np.repeat(rows.first[span], size) + within
    begin[owner, slot] = within == 0
    end[owner, slot] = within == np.repeat(size, size) - 1
    return position, begin, end


def _segment_costs(k: np.ndarray, q: np.ndarray, begin: np.ndarray, end: np.ndarray) -> np.ndarray:
    """(rows, L, L) float64: sum of squared errors of the segment from sample i to j; inf where there can be none."""
    zero = np.zeros((len(q), 1))
    s_q, s_qq, s_kq = (np.concatenate([zero, np.cumsum(v, 1)], 1) for v in (q, q * q, k * q))
    i, j = np.triu_indices(q.shape[1], 1)
    dk, dq = k[:, j] - k[:, i], q[:, j] - q[:, i]
    slope = dq / np.where(dk > 0, dk, 1)
    n = dk + 1
    sum_q, sum_qq, sum_kq = (s[:, j + 1] - s[:, i] for s in (s_q, s_qq, s_kq))
    a = sum_qq - 2 * q[:, i] * sum_q + n * q[:, i] ** 2
    b = sum_kq - k[:, i] * sum_q - q[:, i] * dk * n / 2
    c = dk * n * (2 * dk + 1) / 6
    inside = np.cumsum(begin, 1)[:, j] == np.cumsum(begin, 1)[:, i]
    across = end[:, i] & begin[:, j] & (j == i + 1)
    error = np.where(across, 0.0, np.where(inside & (k[:, j] >= 0), np.maximum(a - 2 * slope * b + slope**2 * c, 0), np.inf))
    out = np.full((len(q), q.shape[1], q.shape[1]), np.inf)
    out[:, i, j] = error
    return out
