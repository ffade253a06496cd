"""How far straight edges depart from the chords that are drawn for them, in a ball whose reflections are exact (core/virtual_mesh.py)."""

import numpy as np
import pytest
import tolerances
from analytic import unit

from reflect_addon.core.virtual_mesh import BEND, NEAR, PICTURE, WIDEST, widest


def image(points):
    """((N, 2) where a ball of radius 1 about the origin shows points to an eye far along z, (N,) the normal's angle there), by halving: in
    the plane of point and eye what is reflected at an angle p from z leaves at 2 p."""
    across, up = np.hypot(points[:, 0], points[:, 1]), points[:, 2]
    low, high = np.zeros(len(points)), np.minimum(np.arctan2(across, up), np.pi / 2)
    for _ in range(60):
        p = (low + high) / 2
        before = np.sin(2 * p) * (up - np.cos(p)) < np.cos(2 * p) * (across - np.sin(p))
        low, high = np.where(before, p, low), np.where(before, high, p)
    return np.sin(p)[:, None] * points[:, :2] / np.maximum(across, 1e-300)[:, None], p


def bend(ends):
    """((E,) largest distance of images of points on edges (E, 2, 3) to the chord between the ends' images, (E,) largest angle there)."""
    (a, angle), (b, other) = (image(ends[:, k]) for k in (0, 1))
    along = unit(b - a)
    normal, off = np.stack([-along[:, 1], along[:, 0]], 1), np.zeros(len(a))
    for share in np.linspace(0, 1, 9)[1:-1]:
        between, p = image(ends[:, 0] * (1 - share) + ends[:, 1] * share)
        off, angle = np.maximum(off, np.abs(((between - a) * normal).sum(1))), np.maximum(angle, p)
    return off, np.maximum(angle, other)


def edges(rng, distance, angle, count=4000):
    """(E, 2, 3) edges about such a distance from the ball's middle, as wide as the mesh allows: seen under `angle` from the ball's box."""
    middle, way = unit(rng.normal(size=(count, 3))) * distance, unit(rng.normal(size=(count, 3)))
    length = np.full(count, angle * distance)
    for _ in range(30):
        ends = np.stack([middle - way * length[:, None] / 2, middle + way * length[:, None] / 2], 1)
        apart = np.linalg.norm(np.maximum(np.abs(ends) - 1, 0), axis=-1).min(1)
        length = angle * np.maximum(apart, NEAR * 2)
    behind = (ends[..., 2] < 0) & (np.hypot(ends[..., 0], ends[..., 1]) < 1.01)
    return ends[(np.linalg.norm(ends, axis=-1) > 1).all(1) & ~behind.any(1)]


def bound(angle):
    """The docstring's k."""
    return np.sin(angle) * (2 * np.cos(angle) ** 2 + 1) / (4 * np.cos(angle) ** 2)


def test_the_ball_shows_what_it_reflects(rng):
    points = unit(rng.normal(size=(1000, 3))) * rng.uniform(1.2, 9, (1000, 1))
    points = points[(points[:, 2] > 0) | (np.hypot(points[:, 0], points[:, 1]) > 1.01)]
    place, angle = image(points)
    normal = np.column_stack([place, np.cos(angle)])
    np.testing.assert_allclose(unit(unit(points - normal) + [0, 0, 1]), normal, atol=1e-9)


@pytest.mark.parametrize("angle", [0.05, 0.2])
def test_far_edges_bend_as_derived(rng, angle):
    off, p = bend(edges(rng, 1e5, angle))
    most = bound(p) * angle**2 / 8
    inner = np.sin(p) ** 2 < 0.75
    assert (off[inner] <= most[inner] * tolerances.CHORD_HIGHER_ORDERS).all()
    assert (off[inner] / most[inner]).max() > 0.9  # and some do bend so much
    assert np.median(off) < angle**2 / 25


@pytest.mark.parametrize("distance", [1.1, 1.5, 3.0, 10.0, 1e5])
def test_the_widest_edges_bend_by_no_more_pixels_than_said(rng, distance):
    off, p = bend(edges(rng, distance, WIDEST))
    inner = np.sin(p) ** 2 < 0.5
    assert inner.sum() > 200 and off[inner].max() * PICTURE / 2 <= BEND


def test_halves_bend_a_quarter(rng):
    ends = edges(rng, 6.0, 0.2)
    whole, p = bend(ends)
    half, _ = bend(np.stack([ends[:, 0], ends.mean(1)], 1))
    seen = (np.sin(p) ** 2 < 0.5) & (whole > 1e-5)
    assert np.median(half[seen] / whole[seen]) == pytest.approx(0.25, rel=0.1)


def test_finer_pictures_ask_for_narrower_edges():
    assert widest(BEND, 4 * PICTURE) == pytest.approx(WIDEST / 2) and widest(4 * BEND, PICTURE) == pytest.approx(2 * WIDEST)
