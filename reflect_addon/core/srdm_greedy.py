"""Rows simplified as in the paper: the worst segment is split where it is worst, until m points are used [4.2].

All rows take a step at once: a step looks at each row's worst segment only, so the work falls with the segments'
lengths as it would with the paper's priority queue.
"""

import numpy as np

from .srdm import Rows, steps_of, table_of


def simplify(rows: Rows, m: int) -> np.ndarray:
    """(R, m, 2) float32 table of the rows' greedy poly-lines."""
    q = steps_of(rows.depth)
    count = len(q)
    # Segments of each row: first and last sample, error and where it is worst. Slots past a row's segments have error -1.
    slots = max(m - 1, 1)
    place = np.arange(len(rows.row)) - np.searchsorted(rows.row, rows.row)
    a, b = (np.zeros((count, slots), np.int64) for _ in range(2))
    error, worst = np.full((count, slots), -1.0, np.float32), np.zeros((count, slots), np.int64)
    begins, ends = (np.zeros((count, slots), bool) for _ in range(2))
    a[rows.row, place], b[rows.row, place] = rows.first, rows.last
    begins[rows.row, place] = ends[rows.row, place] = True
    error[rows.row, place], worst[rows.row, place] = _worst(q, rows.row, rows.first, rows.last)
    used = np.bincount(rows.row, minlength=count)  # segments
    points = 2 * used
    while True:
        active = np.flatnonzero((points < m) & (error.max(1) > 0))
        if not len(active):
            break
        slot = np.argmax(error[active], axis=1)
        left, middle, right = a[active, slot], worst[active, slot], b[active, slot]
        fresh = used[active]
        b[active, slot] = a[active, fresh] = middle
        b[active, fresh], ends[active, fresh] = right, ends[active, slot]
        ends[active, slot] = False
        error[active, slot], worst[active, slot] = _worst(q, active, left, middle)
        error[active, fresh], worst[active, fresh] = _worst(q, active, middle, right)
        used[active] += 1
        points[active] += 1
    return _table(rows, a, b, begins, ends, used, m)


def _worst(q: np.ndarray, row: np.ndarray, a: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(error float32, sample) of the largest depth error of the segments from sample a to sample b, the first on a tie."""
    length = b - a
    inner = np.maximum(length - 1, 0)
    start = np.cumsum(inner) - inner
    total = int(inner.sum())
    error, at = np.zeros(len(row), np.float32), a.copy()
    if total:
        some = np.flatnonzero(inner)
        owner = np.repeat(np.arange(len(row)), inner)
        k = np.arange(total) - start[owner] + 1
        rise = q[row, b] - q[row, a]
        off = np.abs((q[row[owner], a[owner] + k] - q[row, a][owner]) * length[owner] - rise[owner] * k)
        largest = np.maximum.reduceat(off, start[some])
        is_largest = np.flatnonzero(off == np.repeat(largest, inner[some]))
        first = is_largest[np.searchsorted(is_largest, start[some])]
        error[some] = largest.astype(np.float32) / length[some].astype(np.float32)
        at[some] = a[some] + k[first]
    return error, at


def _table(rows: Rows, a, b, begins, ends, used, m: int) -> np.ndarray:
    """Each segment gives its first point, and the last of a span its last one too."""
    row, slot = np.nonzero(np.arange(a.shape[1]) < used[:, None])
    last = ends[row, slot]
    points = np.concatenate([a[row, slot], b[row, slot][last]])
    owner = np.concatenate([row, row[last]])
    is_first = np.concatenate([begins[row, slot], np.zeros(last.sum(), bool)])
    is_last = np.concatenate([np.zeros(len(row), bool), np.ones(last.sum(), bool)])
    order = np.lexsort((is_last, points, owner))
    return table_of(rows, owner[order], points[order], is_first[order], is_last[order], m)
