"""core/coarse_surface.py: fewer triangles, places within a cell, flat stays flat, nothing tears, and the light's mean stays."""

from dataclasses import replace

import numpy as np
import pytest

from reflect_addon.core.coarse_surface import LEAST, SHARE, chosen, clustered, coarser
from reflect_addon.core.surface_asset import SurfaceMesh

SIDE = 41


def sheet(z=lambda x, y: 0 * x) -> SurfaceMesh:
    """A square of 2 m, refined evenly; brighter along x."""
    x, y = (a.ravel() for a in np.meshgrid(np.linspace(-1, 1, SIDE), np.linspace(-1, 1, SIDE)))
    at = np.arange(SIDE * SIDE).reshape(SIDE, SIDE)
    a, b, c, d = at[:-1, :-1].ravel(), at[:-1, 1:].ravel(), at[1:, 1:].ravel(), at[1:, :-1].ravel()
    triangles = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]).astype(np.int32)
    border = np.maximum(np.abs(x), np.abs(y)) == 1
    weights = np.where(border[:, None], [0.5, 0.5, 0.0], [0.4, 0.3, 0.3]).astype(np.float32)
    weights[(np.abs(x) == 1) & (np.abs(y) == 1)] = 1.0, 0.0, 0.0
    count = len(x)
    return SurfaceMesh(
        np.stack([x, y, z(x, y)], 1).astype(np.float32), np.tile(np.float32([0, 0, 1]), (count, 1)), np.repeat(1 + x[:, None], 3, 1).astype(np.float32),
        triangles, np.zeros(count, np.int32), weights, np.ones(count, np.float32), 2, "sheet",
    )  # fmt: skip


def area(mesh) -> float:
    a, b, c = (mesh.positions[mesh.triangles[:, i]].astype(float) for i in range(3))
    return 0.5 * float(np.cross(b - a, c - a)[:, 2].sum())


def test_each_has_fewer_triangles_than_the_one_before():
    mesh = sheet()
    found = coarser(mesh)
    counts = [len(mesh.triangles), *(len(one.triangles) for one in found)]
    assert len(found) >= 2 and all(b <= SHARE * a for a, b in zip(counts, counts[1:], strict=False))
    assert all(a.cell < b.cell for a, b in zip(found, found[1:], strict=False))
    assert coarser(replace(mesh, triangles=mesh.triangles[: LEAST - 1])) == ()


@pytest.mark.parametrize("cell", [0.11, 0.3, 0.7])
def test_a_flat_square_stays_one(cell):
    """Its corners and edges too, all of it covered once, to what cells of its corners cut; light is the mean of a cell."""
    mesh, found = sheet(), clustered(sheet(), cell)
    assert len(found.triangles) < len(mesh.triangles) and not found.positions[:, 2].any()
    assert np.abs(found.positions).max() == 1
    corners = {(a, b) for a in (-1.0, 1.0) for b in (-1.0, 1.0)}
    assert corners <= {tuple(p) for p in found.positions[:, :2].astype(float)}
    assert area(found) == pytest.approx(area(mesh), rel=1e-5)
    assert np.abs(found.radiance[:, 0] - (1 + found.positions[:, 0])).max() <= cell


def test_light_of_two_sides_is_not_mixed():
    """Two sheets in the same cells, one dark and seen from below."""
    top = sheet()
    count = len(top.positions)
    both = replace(
        top, positions=np.concatenate([top.positions, top.positions]), normals=np.concatenate([top.normals, -top.normals]),
        radiance=np.concatenate([top.radiance + 5, 0 * top.radiance]), triangles=np.concatenate([top.triangles, top.triangles[:, ::-1] + count]),
        face=np.zeros(2 * count, np.int32), weights=np.concatenate([top.weights, top.weights]), side=np.ones(2 * count, np.float32),
    )  # fmt: skip
    found = clustered(both, 0.3)
    lit = found.radiance[:, 0] > 0
    assert found.radiance[lit].min() >= 5 and lit.sum() == (~lit).sum()
    assert not (lit[found.triangles].any(1) & ~lit[found.triangles].all(1)).any()


def test_cells_are_no_larger_than_pixels():
    """The coarsest that is still fine enough, whatever its object's size; none where pixels are finer."""
    cells = [0.1, 0.2, 0.4]
    for scale in (1.0, 5.0):
        for pixel in (0.01, 0.19, 0.3, 0.9, 100.0):
            index = chosen(cells, scale, pixel)
            assert index < 0 or cells[index] * scale <= pixel
            assert index + 1 == len(cells) or cells[index + 1] * scale > 0.5 * pixel
    assert chosen(cells, 1.0, 0.0) == -1 and chosen([], 1.0, 1.0) == -1
