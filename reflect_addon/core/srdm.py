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

Where we depart. Of rows with more than m / 2 spans the longest are kept. Everything that is decided is decided in whole
numbers: the texel of a sample from sines in steps of 2^-TURN_BITS (a turn is off by some 1e-6 radians, no sample by more
than 1e-3 texels), the split from depths in STEPS steps and errors in parts of 1 / PARTS of one. So NumPy and a compute shader
(gpu/srdm_build.py) choose the same points whatever their rounding; the table holds the map's own depths.
Limits. Maps of up to MAX_SIDE texels a side: beyond it these numbers outgrow 32 bits, and half floats cannot hold u.
"""

from dataclasses import dataclass

import numpy as np

from .errors import ReflectError

# u of unused points: beyond every map, so that a search along the row ends there, and a half float can hold it.
FILL = 32768.0
# Depth steps in which splits are chosen: 1.5e-5 of the range, below any error that m points leave. A power of two:
# the product with q is exact in float32, on every device.
STEPS = 65536
# Sines and cosines are whole multiples of 2^-TURN_BITS: as many bits as leave MAX_SIDE * 2.5 room in 31.
TURN_BITS = 19
MAX_SIDE = 1024
# Errors of segments are compared in parts of a depth step: STEPS * MAX_SIDE * PARTS fills 32 bits.
PARTS = 64


@dataclass(frozen=True)
class Rows:
    """The turned rows of a depth map before simplification, and their spans."""

    depth: np.ndarray  # (R, w) float32: q of the samples u = 0.5, 1.5, ...; NaN = background
    row: np.ndarray  # (S,) int, which row each span belongs to, rising
    first: np.ndarray  # (S,) int, the span's first sample
    last: np.ndarray  # (S,) int, its last one


def turns(n: int) -> np.ndarray:
    """(n, 2) int32: cosine and sine of pi i / n in steps of 2^-TURN_BITS."""
    angle = np.pi * np.arange(n) / n
    return np.rint(np.stack([np.cos(angle), np.sin(angle)], -1) * 2**TURN_BITS).astype(np.int32)


def check(w: int, n: int, m: int):
    """ReflectError when a map of w x w texels cannot be given n turns of m points."""
    if not (1 <= w <= MAX_SIDE and n >= 1 and 2 <= m <= MAX_SIDE):
        raise ReflectError(
            f"A depth map of {w} texels a side, {n} turns and {m} points cannot be simplified.",
            f"Choose 1 to {MAX_SIDE} texels, at least 1 turn and 2 to {MAX_SIDE} points.",
        )


def rotated_rows(depth: np.ndarray, n: int) -> np.ndarray:
    """(n * w, w) float32: the rows of the n turned maps, by the nearest texel; NaN outside the map (4.2, step 1)."""
    w = depth.shape[0]
    check(w, n, 2)
    # Twice the distances from the middle, so that they are whole; hence one bit more to shift away.
    twice = 2 * np.arange(w, dtype=np.int32) + 1 - w
    out = np.empty((n, w, w), np.float32)
    padded = np.pad(depth, 1, constant_values=np.nan).ravel()
    for i, (c, s) in enumerate(turns(n)):
        x = (twice * c + (w << TURN_BITS))[None, :] - (twice * s)[:, None]
        y = (twice * s + (w << TURN_BITS))[None, :] + (twice * c)[:, None]
        for v in (x, y):
            np.right_shift(v, TURN_BITS + 1, out=v)
            np.clip(v, -1, w, out=v)
        np.take(padded, (y + 1) * (w + 2) + (x + 1), out=out[i])
    return out.reshape(n * w, w)


def with_spans(depth: np.ndarray, m: int) -> Rows:
    """The rows' spans of scene samples (Fig 12); of a row with more than m // 2 the longest, the left ones on a tie."""
    count, w = depth.shape
    solid = np.zeros(count * (w + 1) + 1, bool)  # a background sample before each row and after the last one
    np.logical_not(np.isnan(depth), out=solid[:-1].reshape(count, w + 1)[:, 1:])
    edge = np.flatnonzero(solid[1:] != solid[:-1])
    row, first = np.divmod(edge[0::2], w + 1)
    last = edge[1::2] - row * (w + 1) - 1
    spans = np.bincount(row, minlength=count)
    if spans.max(initial=0) > m // 2:
        order = np.lexsort((first, first - last, row))  # by row, longest first
        kept = np.zeros(len(row), bool)
        kept[order] = np.arange(len(row)) - (np.cumsum(spans) - spans)[row] < m // 2
        row, first, last = row[kept], first[kept], last[kept]
    return Rows(depth, row, first, last)


def steps_of(depth: np.ndarray) -> np.ndarray:
    """int32 of depth's shape: depths in STEPS steps, 0 to STEPS - 1; 0 for background."""
    return np.fmin(np.fmax(depth * np.float32(STEPS), 0), STEPS - 1).astype(np.int32)


def table_of(rows: Rows, row: np.ndarray, sample: np.ndarray, begins: np.ndarray, ends: np.ndarray, m: int) -> np.ndarray:
    """(R, m, 2) float32 from chosen points, one entry each, sorted by row and u: which begin and which end a span."""
    count, w = rows.depth.shape
    table = np.zeros((count, m, 2), np.float32)
    table[..., 0] = -FILL
    used = np.bincount(row, minlength=count)
    place = np.arange(len(row)) - (np.cumsum(used) - used)[row]
    u = sample + 0.5 + np.where(ends, 0.5, 0.0) - np.where(begins, 0.5, 0.0)
    # The sign tells a beginning, so u = 0 (a map that its object fills to the edge) must not be.
    u = np.where(begins, -np.maximum(u, 0.25), u)
    table[row, place, 0], table[row, place, 1] = u, rows.depth[row, sample]
    return table


def packed(table: np.ndarray) -> np.ndarray:
    """(w, n * ceil(m / 2), 4) float32 from (n, w, m, 2): the texels that a look-up fetches, two points in each.

    Texel (x = i * ceil(m / 2) + c, y = j) holds the points 2 c and 2 c + 1 of row j of turn i as (u0, q0, u1, q1);
    an odd m is filled up by an unused point.
    """
    n, w, m, _ = table.shape
    out = np.zeros((w, n, m + m % 2, 2), np.float32)
    out[..., 0] = -FILL
    out[:, :, :m] = table.transpose(1, 0, 2, 3)
    return out.reshape(w, -1, 4)


def unpacked(texels: np.ndarray, n: int, m: int) -> np.ndarray:
    """(n, w, m, 2) float32: the table that packed() made into these texels."""
    w = len(texels)
    return np.ascontiguousarray(texels.reshape(w, n, m + m % 2, 2)[:, :, :m].transpose(1, 0, 2, 3), np.float32)


def halved(table: np.ndarray) -> np.ndarray:
    """packed() in float16, half the bytes: u is the same (a multiple of 0.5 up to MAX_SIDE), q is off by 2^-12 at most."""
    return packed(table).astype(np.float16)


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
