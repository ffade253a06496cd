"""Simplified rotated depth maps: every row that a ray's projection may follow, as a poly-line [popescu-2006 4.1, 4.2].

Problem. A ray's projection onto a depth map crosses some ninety texels; walking them is too slow (4.1).
Idea. Turn the depth map by n angles theta_i = pi i / n, so that every projection runs nearly along a row of one of them,
and replace each row by m points. A perspective projection maps lines to lines also in (u, 1/z), so both the poly-line and
the ray are straight there, and the row's intersection is that of line segments.

Coordinates. The map is w x w texels; u, v in texels, texel centres at + 0.5, the turn is about the middle (w/2, w/2):
x = w/2 + (u - w/2) cos theta - (v - w/2) sin theta, y = w/2 + (u - w/2) sin theta + (v - w/2) cos theta.
Depth q is 1/z normalised: 1 on the hither plane, 0 on the yon plane (Fig 10); background is NaN.

A table is (n, w, m, 2) float32: points (u, q) by rising u. A negative u begins a span: nothing joins it to the point
before, so no rubber band is made. A span reaches half a texel beyond its outer samples, to its texels' edges. What is
left of a row is filled up with (-FILL, 0).

Where we depart. Of rows with more than m / 2 spans the longest are kept. The split is chosen from depths in 65536 steps,
in whole numbers: so NumPy and a compute shader choose the same points whatever their rounding.
"""

from dataclasses import dataclass

import numpy as np

# u of unused points: beyond every map, so that a search along the row ends there, and a half float can hold it.
FILL = 32768.0
# Depth steps in which splits are chosen: 1.5e-5 of the range, below any error that m points leave.
STEPS = 65535


@dataclass(frozen=True)
class Rows:
    """The turned rows of a depth map before simplification, and their spans."""

    depth: np.ndarray  # (R, w) float32: q of the samples u = 0.5, 1.5, ...; NaN = background
    row: np.ndarray  # (S,) int, which row each span belongs to, rising
    first: np.ndarray  # (S,) int, the span's first sample
    last: np.ndarray  # (S,) int, its last one


def rotated_rows(depth: np.ndarray, n: int) -> np.ndarray:
    """(n * w, w) float32: the rows of the n turned maps, by the nearest texel; NaN outside the map (4.2, step 1)."""
    w = depth.shape[0]
    centred = np.arange(w, dtype=np.float64) + 0.5 - w / 2
    out = np.empty((n, w, w), np.float32)
    padded = np.pad(depth, 1, constant_values=np.nan)
    for i in range(n):
        c, s = np.cos(np.pi * i / n), np.sin(np.pi * i / n)
        x = np.floor(w / 2 + centred[None, :] * c - centred[:, None] * s).astype(int)
        y = np.floor(w / 2 + centred[None, :] * s + centred[:, None] * c).astype(int)
        out[i] = padded[np.clip(y, -1, w) + 1, np.clip(x, -1, w) + 1]
    return out.reshape(n * w, w)


def with_spans(depth: np.ndarray, m: int) -> Rows:
    """The rows' spans of scene samples (Fig 12); of a row with more than m // 2 the longest, the left ones on a tie."""
    solid = np.pad(~np.isnan(depth), ((0, 0), (1, 1)))
    step = np.diff(solid.astype(np.int8), axis=1)
    row, first = np.nonzero(step == 1)
    last = np.nonzero(step == -1)[1] - 1
    order = np.lexsort((first, first - last, row))  # by row, longest first
    start = np.searchsorted(row, row)
    kept = np.zeros(len(row), bool)
    kept[order] = np.arange(len(row)) - start[order] < m // 2
    return Rows(depth, row[kept], first[kept], last[kept])


def steps_of(depth: np.ndarray) -> np.ndarray:
    """(R, w) int64: depths in STEPS steps, 0 for background."""
    return np.floor(np.nan_to_num(depth) * np.float32(STEPS) + np.float32(0.5)).astype(np.int64)


def table_of(rows: Rows, row: np.ndarray, sample: np.ndarray, begins: np.ndarray, ends: np.ndarray, m: int) -> np.ndarray:
    """(R, m, 2) float32 from chosen points, one entry each, sorted by row and u: which begin and which end a span."""
    count, w = rows.depth.shape
    table = np.zeros((count, m, 2), np.float32)
    table[..., 0] = -FILL
    place = np.arange(len(row)) - np.searchsorted(row, row)
    u = sample + 0.5 + np.where(ends, 0.5, 0.0) - np.where(begins, 0.5, 0.0)
    # The sign tells a beginning, so u = 0 (a map that its object fills to the edge) must not be.
    u = np.where(begins, -np.maximum(u, 0.25), u)
    table[row, place, 0], table[row, place, 1] = u, rows.depth[row, sample]
    return table


def packed(table: np.ndarray) -> np.ndarray:
    """(w, n * ceil(m / 2), 4) float32: two points a texel, texel (x = i * ceil(m / 2) + c, y = j) of turn i, row j has points
    2c and 2c + 1 as (u0, q0, u1, q1)."""
    n, w, m = table.shape[:3]
    if m % 2:
        table = np.concatenate([table, np.broadcast_to(np.float32([-FILL, 0]), (n, w, 1, 2))], 2)
    return np.ascontiguousarray(table.reshape(n, w, -1, 4).transpose(1, 0, 2, 3)).reshape(w, -1, 4)


def heights(table: np.ndarray, w: int) -> np.ndarray:
    """(R, w) float64: q of the poly-lines at the samples; NaN where there is none. For errors and pictures."""
    count, m = table.shape[:2]
    out = np.full((count, w), np.nan)
    u = np.arange(w) + 0.5
    for k in range(m - 1):
        a, b = np.abs(table[:, k, 0, None].astype(np.float64)), table[:, k + 1, 0, None].astype(np.float64)
        # The outer points lie at the texels' edges but hold the outer samples' depths: those of Fig 12 are between.
        share = np.clip((u - a) / np.maximum(b - a, 1e-9), 0, 1)
        value = table[:, k, 1, None] + share * (table[:, k + 1, 1, None] - table[:, k, 1, None])
        out = np.where((u >= a) & (u <= b) & np.isnan(out), value, out)
    return out
