"""The large planes of a mesh: the same with and without the bound that keeps the search short."""

import time

import numpy as np
import pytest

from reflect_addon.core import flat_parts


def tilted(rng, count, size, centre=(0, 0, 0)):
    """(count, 3, 3) triangles of about this size, each with a plane of its own, around the centre."""
    return np.asarray(centre) + rng.normal(size=(count, 1, 3)) + size * rng.normal(size=(count, 3, 3))


def plane(rng, count, height):
    """(count, 3, 3) small triangles of one horizontal plane."""
    corners = rng.uniform(-3, 3, (count, 1, 3)) + 0.2 * rng.normal(size=(count, 3, 3))
    corners[..., 2] = height
    return corners


def planes_of(corners):
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    parts = flat_parts._planes(corners, cross, np.linalg.norm(cross, axis=-1) / 2)
    return sorted(sorted(part.tolist()) for part in parts)


@pytest.mark.parametrize("seed", range(5))
def test_the_bound_loses_no_plane(monkeypatch, seed):
    rng = np.random.default_rng(seed)
    corners = np.concatenate([tilted(rng, 400, 0.05), plane(rng, 200, 1.0), plane(rng, 150, -1.0), plane(rng, 9, 0.5)])
    corners = corners @ np.linalg.qr(rng.normal(size=(3, 3)))[0].T + rng.normal(size=3) * 10
    with_bound = planes_of(corners)
    monkeypatch.setattr(flat_parts, "_area_around", lambda normal, offset, area: np.full(len(area), np.inf))
    assert with_bound == planes_of(corners) and len(with_bound) >= 2


def test_ten_thousand_small_planes_take_no_time():
    """Pairs of triangles, as quads have them, with normals of their own: without the bound 40,000 of them took 10 s."""
    rng = np.random.default_rng(0)
    one = tilted(rng, 20000, 0.02)
    corners = np.concatenate([one, one[:, [0, 2, 1]] + 1e-6])
    start = time.process_time()
    assert planes_of(corners) == []
    assert time.process_time() - start < 3.0
