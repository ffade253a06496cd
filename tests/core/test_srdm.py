"""core/srdm*.py: rows, spans and poly-lines against shapes in closed form, brute force, and the paper's own figures."""

from fractions import Fraction
from heapq import heappop, heappush
from itertools import combinations, groupby
from math import ceil

import numpy as np
import pytest
import tolerances
import trimesh
from mesh_scenes import depth_map

from reflect_addon.core import srdm, srdm_greedy, srdm_optimal
from reflect_addon.core.errors import ReflectError

SIMPLIFY = [srdm_greedy.simplify, srdm_optimal.simplify]


def test_rows_of_the_first_turn_are_the_map_and_of_a_right_angle_its_columns(rng):
    depth = rng.random((16, 16)).astype(np.float32)
    rows = srdm.rotated_rows(depth, 2).reshape(2, 16, 16)
    assert np.array_equal(rows[0], depth)
    assert np.array_equal(rows[1], depth[:, ::-1].T), "u runs up, v to the left"


def test_every_turn_sees_a_disc_alike():
    """A round thing in the middle has the same rows in every turn, up to the nearest texel."""
    w = 64
    y, x = np.mgrid[:w, :w] + 0.5 - w / 2
    radius = np.hypot(x, y)  # of a texel in the map, and of a sample in a turned row
    solid = ~np.isnan(srdm.rotated_rows(np.where(radius < 20, 0.5, np.nan).astype(np.float32), 12).reshape(12, w, w))
    near = np.sqrt(0.5)  # from a sample to the middle of its texel, at most
    assert np.all(solid[:, radius < 20 - near]) and not np.any(solid[:, radius > 20 + near])


def turned(w: int, n: int):
    """(x, y), each (n, w, w) float64: where the samples of the turned rows lie, by the header's formula."""
    angle, centred = np.pi * np.arange(n)[:, None, None] / n, np.arange(w) + 0.5 - w / 2
    u, v = centred[None, None, :], centred[None, :, None]
    return w / 2 + u * np.cos(angle) - v * np.sin(angle), w / 2 + u * np.sin(angle) + v * np.cos(angle)


def test_samples_lie_where_the_turns_angle_puts_them():
    w, n = 64, 18
    depth = np.arange(w * w, dtype=np.float32).reshape(w, w)
    x, y = turned(w, n)
    inside = (x >= 0) & (x < w) & (y >= 0) & (y < w)
    clear = np.minimum(np.abs(x - np.rint(x)), np.abs(y - np.rint(y))) > tolerances.SRDM_SAMPLE  # of a texel's edge
    want = np.where(inside, np.floor(y) * w + np.floor(x), np.nan)
    got = srdm.rotated_rows(depth, n).reshape(n, w, w)
    assert np.array_equal(got[clear], want[clear], equal_nan=True) and clear.mean() > 0.9


def test_whole_sines_move_no_sample_of_the_largest_map_far():
    angle = np.pi * np.arange(180) / 180
    off = srdm.turns(180) / 2**srdm.TURN_BITS - np.stack([np.cos(angle), np.sin(angle)], -1)
    assert np.hypot(*off.T).max() * srdm.MAX_SIDE * np.sqrt(0.5) < tolerances.SRDM_SAMPLE
    assert np.array_equal(srdm.turns(2), np.eye(2) * 2**srdm.TURN_BITS), "a right angle is exact"


def test_what_cannot_be_simplified_is_said():
    for w, n, m in ((srdm.MAX_SIDE + 1, 1, 8), (16, 0, 8), (16, 1, 1)):
        with pytest.raises(ReflectError, match=f"{w} texels a side, {n} turns and {m} points"):
            srdm.check(w, n, m)


def test_spans_are_the_runs_of_the_scene():
    n = np.nan
    depth = np.float32([[n, 1, 1, n, 0.5, n, n, 0.25], [n] * 8, [1] * 8])
    spans = srdm.with_spans(depth, 6)
    assert list(zip(spans.row, spans.first, spans.last, strict=True)) == [(0, 1, 2), (0, 4, 4), (0, 7, 7), (2, 0, 7)]
    fewer = srdm.with_spans(depth, 4)  # two spans at most: the longest, the left one on a tie
    assert list(zip(fewer.row, fewer.first, strict=True)) == [(0, 1), (0, 4), (2, 0)]


@pytest.mark.parametrize("together", [1, 7, 1 << 40])
def test_how_many_samples_are_looked_at_together_changes_nothing(together, monkeypatch, rng):
    depth = (np.rint(rng.random((40, 40)) * 8) / 8).astype(np.float32)  # of ties
    depth[rng.random((40, 40)) < 0.05] = np.nan
    rows = srdm.with_spans(srdm.rotated_rows(depth, 3), 12)
    want = srdm_greedy.simplify(rows, 12)
    monkeypatch.setattr(srdm_greedy, "_TOGETHER", together)
    assert np.array_equal(srdm_greedy.simplify(rows, 12), want)


@pytest.mark.parametrize("simplify", SIMPLIFY)
def test_tables_mark_where_spans_begin_and_reach_the_texels_edges(simplify):
    n = np.nan
    table = simplify(srdm.with_spans(np.float32([[n, 0.5, 0.5, n, 0.25, n], [n] * 6]), 6), 6)
    assert np.array_equal(table[0, :4], np.float32([[-1, 0.5], [3, 0.5], [-4, 0.25], [5, 0.25]]))
    assert np.all(table[0, 4:, 0] == -srdm.FILL) and np.all(table[1, :, 0] == -srdm.FILL)


@pytest.mark.parametrize("simplify", SIMPLIFY)
def test_no_rubber_band_and_nothing_lost(simplify, rng):
    """Poly-lines cover exactly the texels of the spans that were kept, and rise in u."""
    depth = np.where(rng.random((200, 32)) < 0.8, rng.random((200, 32)), np.nan).astype(np.float32)
    rows = srdm.with_spans(depth, 8)
    kept = np.zeros(depth.shape, bool)
    for row, first, last in zip(rows.row, rows.first, rows.last, strict=True):
        kept[row, first : last + 1] = True
    table = simplify(rows, 8)
    assert np.array_equal(~np.isnan(srdm.heights(table, 32)), kept)
    used = np.abs(table[..., 0]) < srdm.FILL
    assert np.all((np.diff(np.abs(table[..., 0])) > 0)[used[:, 1:]])


@pytest.mark.parametrize("simplify", SIMPLIFY)
def test_bent_lines_are_met_exactly(simplify):
    """Four corners need four points, wherever they are."""
    u = np.arange(64)
    depth = np.interp(u, [0, 10, 45, 63], [0.1, 0.9, 0.2, 0.8]).astype(np.float32)[None]
    table = simplify(srdm.with_spans(depth, 4), 4)
    assert np.allclose(table[0, :, 1], depth[0, [0, 10, 45, 63]])


def plain_greedy(depth, m):
    """The samples that a priority queue keeps of one row (4.2), in plain Python; a span's ends are two, be they one."""
    q = [min(int(float(v) * srdm.STEPS), srdm.STEPS - 1) if v == v else None for v in depth]
    runs = [[k for k, _ in run] for solid, run in groupby(enumerate(q), lambda item: item[1] is not None) if solid]
    spans = [(run[0], run[-1]) for run in sorted(runs, key=lambda run: (-len(run), run[0]))[: m // 2]]
    queue, kept = [], [k for span in spans for k in span]

    def push(a, b):
        offs = [(abs((q[k] - q[a]) * (b - a) - (q[b] - q[a]) * (k - a)), -k) for k in range(a + 1, b)]
        off, left = max(offs, default=(0, 0))
        if off:
            heappush(queue, (-ceil(Fraction(off * srdm.PARTS, b - a)), -left, a, b))

    for span in spans:
        push(*span)
    while queue and len(kept) < m:
        _, k, a, b = heappop(queue)
        kept.append(k)
        push(a, k)
        push(k, b)
    return sorted(kept)


@pytest.mark.parametrize("m", [2, 3, 8, 13])
def test_greedy_is_the_papers_queue(m, rng):
    """Few depths, so that ties are many."""
    depth = np.where(rng.random((60, 40)) < 0.85, rng.integers(0, 6, (60, 40)) / 5, np.nan).astype(np.float32)
    table = srdm_greedy.simplify(srdm.with_spans(depth, m), m)
    for row, points in zip(depth, table, strict=True):
        u = np.abs(points[points[:, 0] != -srdm.FILL, 0])
        want = plain_greedy(row, m)
        assert len(u) == len(want)
        assert np.abs(u - 0.5 - want).max(initial=0) <= 0.5 and np.array_equal(points[: len(u), 1], row[want])


def test_texels_hold_two_points_each(rng):
    table = rng.random((3, 5, 7, 2)).astype(np.float32)
    texels = srdm.packed(table)
    assert texels.shape == (5, 3 * 4, 4) and texels.dtype == np.float32
    assert np.array_equal(texels[2, 1 * 4 + 2], [*table[1, 2, 4], *table[1, 2, 5]])
    assert np.array_equal(texels[2, 1 * 4 + 3], [*table[1, 2, 6], -srdm.FILL, 0])
    assert np.array_equal(srdm.unpacked(texels, 3, 7), table)


def test_half_size_keeps_u_and_rounds_q(rng):
    """P13's second half: u is exact for the largest map, q is off by half a step of halves below 1."""
    depth = np.where(rng.random((40, srdm.MAX_SIDE)) < 0.99, rng.random((40, srdm.MAX_SIDE)), np.nan).astype(np.float32)
    table = srdm_greedy.simplify(srdm.with_spans(depth, 16), 16)[None]
    half, full = srdm.halved(table), srdm.packed(table)
    assert half.nbytes * 2 == full.nbytes == table.nbytes
    off = np.abs(half.astype(np.float64) - full)
    assert off[..., 0::2].max() == 0 and off[..., 1::2].max() <= 2.0**-12


def test_the_optimum_is_that_of_all_choices(rng):
    depth = rng.random((20, 9)).astype(np.float32)
    table = srdm_optimal.simplify(srdm.with_spans(depth, 5), 5)
    k = np.arange(9)
    for row, points in zip(depth.astype(np.float64), table, strict=True):
        best = min(np.sum((np.interp(k, [0, *c, 8], row[[0, *c, 8]]) - row) ** 2) for c in combinations(range(1, 8), 3))
        chosen = np.clip(np.abs(points[:, 0]) - 0.5, 0, 8).round().astype(int)
        assert np.sum((np.interp(k, chosen, row[chosen]) - row) ** 2) == pytest.approx(best, rel=1e-6, abs=1e-12)


def test_the_papers_bunny(shared):
    """5.2's table (P16): mean error of z at n = 60, of the object's depth range; and the optimum against it."""
    mesh = trimesh.load(shared / "models" / "stanford-bunny.obj", force="mesh")
    depth, z_of, extent = depth_map(mesh, 256)
    rows = srdm.rotated_rows(depth, 60)

    def error(some, table):
        off = np.abs(z_of(srdm.heights(table, 256)) - z_of(some.astype(np.float64)))
        return np.mean(np.where(np.isnan(off), extent, off)[~np.isnan(some)]) / extent

    for m, paper in tolerances.SRDM_BUNNY.items():
        table = srdm_greedy.simplify(srdm.with_spans(rows, m), m)
        assert error(rows, table) <= paper, m
        assert table.nbytes == 60 * 256 * m * 2 * 4
    some = rows[::37]  # the optimum takes seconds for all
    for m in tolerances.SRDM_BUNNY:
        spans = srdm.with_spans(some, m)
        assert error(some, srdm_optimal.simplify(spans, m)) <= 0.75 * error(some, srdm_greedy.simplify(spans, m)), m
