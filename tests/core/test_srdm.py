"""core/srdm*.py: rows, spans and poly-lines against shapes in closed form, brute force, and the paper's own figures."""

from itertools import combinations

import numpy as np
import pytest
import tolerances
import trimesh
from mesh_scenes import first_hits

from reflect_addon.core import srdm, srdm_greedy, srdm_optimal

SIMPLIFY = [srdm_greedy.simplify, srdm_optimal.simplify]


def depth_map(mesh: trimesh.Trimesh, w: int, half_angle=np.radians(15)):
    """(q (w, w) float32, z of q): the mesh seen along -Z by a pinhole camera whose image it just fills, hither and yon at it."""
    center = mesh.bounds.mean(0)
    radius = np.linalg.norm(mesh.vertices - center, axis=1).max()
    eye = center + [0, 0, radius / np.sin(half_angle)]
    at = ((np.arange(w) + 0.5) / w * 2 - 1) * np.tan(half_angle)
    direction = np.stack([*np.meshgrid(at, at), np.full((w, w), -1.0)], -1).reshape(-1, 3)
    _, z = first_hits(mesh, np.broadcast_to(eye, direction.shape), direction)
    z = np.where(np.isfinite(z), z, np.nan).reshape(w, w)
    hither, yon = np.nanmin(z), np.nanmax(z)
    q = (1 / z - 1 / yon) / (1 / hither - 1 / yon)
    return q.astype(np.float32), lambda v: 1 / (1 / yon + v * (1 / hither - 1 / yon)), yon - hither


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


def test_spans_are_the_runs_of_the_scene():
    n = np.nan
    depth = np.float32([[n, 1, 1, n, 0.5, n, n, 0.25], [n] * 8, [1] * 8])
    spans = srdm.with_spans(depth, 6)
    assert list(zip(spans.row, spans.first, spans.last, strict=True)) == [(0, 1, 2), (0, 4, 4), (0, 7, 7), (2, 0, 7)]
    fewer = srdm.with_spans(depth, 4)  # two spans at most: the longest, the left one on a tie
    assert list(zip(fewer.row, fewer.first, strict=True)) == [(0, 1), (0, 4), (2, 0)]


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
