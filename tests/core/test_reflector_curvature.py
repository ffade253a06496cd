"""Kinds of curvature against formulas, whatever the scale, the windings and the shading."""

import numpy as np
import pytest
import reflector_shapes as shapes
from analytic import rotation
from tolerances import KIND_SHARE

from reflect_addon.core.reflector_curvature import CONCAVE, CONVEX, FLAT, SADDLE, kinds_of
from reflect_addon.core.reflector_topology import components, surface_of


def share_of(mesh):
    """(4,) share of area by kind."""
    surface = surface_of(*mesh)
    return np.bincount(kinds_of(surface), surface.area, minlength=4) / surface.area.sum()


def saddle():
    """z = x^2 - y^2."""

    def point(u, v):
        x, y = 2 * u - 1, 2 * v - 1
        return np.stack([x, y, x * x - y * y], -1)

    def normal(u, v):
        return np.stack([-2 * (2 * u - 1), 2 * (2 * v - 1), 1 + 0 * u], -1)

    return shapes.grid(point, normal, 24, 24)


CASES = {
    "sphere": (shapes.ellipsoid, CONVEX),
    "ellipsoid": (lambda: shapes.ellipsoid((1, 0.6, 0.3)), CONVEX),
    "flat-shaded sphere": (lambda: shapes.shaded(*shapes.ellipsoid()[:2], smooth_below=0), CONVEX),
    "hollow": (shapes.cap, CONCAVE),
    "cap": (lambda: shapes.cap(inward=False), CONVEX),
    "paraboloid inside": (shapes.paraboloid, CONCAVE),
    "paraboloid outside": (lambda: shapes.paraboloid(inward=False), CONVEX),
    "saddle": (saddle, SADDLE),
    "flat-shaded cube": (lambda: shapes.bevelled_cube(0.001, segments=2, smooth=False), FLAT),
}


@pytest.mark.parametrize("name", CASES)
def test_the_kind_is_the_formulas(name):
    make, kind = CASES[name]
    assert share_of(make())[kind] >= KIND_SHARE


def test_a_torus_is_convex_outside_and_a_saddle_inside():
    """Convex is where cos > 0: 1/2 + r / (pi R) of it; beyond, the lesser curvature has to be a tenth of the greater to count."""
    kinds = share_of(shapes.torus(1.0, 0.4))
    outer = 0.5 + 0.4 / np.pi
    # 1 / r = 2.5, so down to cos / (1 + 0.4 cos) = -0.25; area between two angles of the tube is a + 0.4 sin a.
    lesser = np.arccos(-0.25 / (1 + 0.4 * 0.25))
    most = (lesser + 0.4 * np.sin(lesser)) / np.pi
    assert outer < kinds[CONVEX] < most + 0.02 and kinds[CONVEX] + kinds[SADDLE] > 0.999


def test_a_tube_is_no_saddle_and_its_caps_are_flat():
    kinds = share_of(shapes.cylinder(0.5, 2.0))
    assert kinds[CONVEX] == pytest.approx(0.8, abs=0.01) and kinds[FLAT] == pytest.approx(0.2, abs=0.01)


@pytest.mark.parametrize("scale, away", [(1e-4, 0.0), (1e5, 0.0), (1.0, 1e4)])
def test_scale_and_place_change_nothing(scale, away, rng):
    positions, triangles, normals = shapes.torus(nu=32, nv=16)
    turn = rotation(rng)
    moved = share_of((scale * positions @ turn.T + away, triangles, normals @ turn.T))
    assert moved == pytest.approx(share_of((positions, triangles, normals)), abs=1e-3)


def test_windings_do_not_matter(rng):
    """Of a closed mesh the outside mirrors; of an open one the side that most normals look to."""
    positions, triangles, normals = shapes.ellipsoid()
    flipped = np.where((rng.random(len(triangles)) < 0.5)[:, None], triangles[:, ::-1], triangles)
    assert share_of((positions, flipped, normals[:, ::-1]))[CONVEX] >= KIND_SHARE
    assert share_of((positions, triangles[:, ::-1], -normals[:, ::-1]))[CONVEX] >= KIND_SHARE
    positions, triangles, normals = shapes.cap()
    assert share_of((positions, triangles[:, ::-1], normals[:, ::-1]))[CONCAVE] >= KIND_SHARE


def test_a_ridge_between_two_walls_is_a_crease_and_facets_of_a_tube_are_not():
    tall = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0.2], [0, 1, 0.2], [1, 2, 0], [0, 2, 0]], float)
    roof = shapes.shaded(tall, [[0, 1, 2], [0, 2, 3], [3, 2, 4], [3, 4, 5]], smooth_below=0)
    surface = surface_of(*roof)
    assert surface.crease.sum() == 1 and (kinds_of(surface) == FLAT).all()
    a = 2 * np.pi * np.arange(9) / 9
    ring = np.stack([np.cos(a), np.sin(a), 0 * a], -1)
    at, after = np.arange(9), (np.arange(9) + 1) % 9
    sides = np.concatenate([np.stack([at, after, after + 9], -1), np.stack([at, after + 9, at + 9], -1)])
    surface = surface_of(*shapes.shaded(np.concatenate([ring, ring + [0, 0, 3]]), sides, smooth_below=0))
    assert not surface.crease.any() and (kinds_of(surface) == CONVEX).all() and surface.two_sided.all()


def test_components_are_those_of_a_search(rng):
    pairs = rng.integers(0, 500, (400, 2))
    label = components(500, pairs)
    near = [[] for _ in range(500)]
    for a, b in pairs.tolist():
        near[a].append(b)
        near[b].append(a)
    seen = {}
    for start in range(500):
        stack = [start] if start not in seen else []
        while stack:
            node = stack.pop()
            if node not in seen:
                seen[node] = start
                stack += near[node]
    ours, theirs = np.unique(label, return_inverse=True)[1], np.array([seen[k] for k in range(500)])
    assert len(set(zip(ours.tolist(), theirs.tolist(), strict=True))) == len(set(ours)) == len(set(theirs.tolist()))
    assert components(3, np.zeros((0, 2), int)).tolist() == [0, 1, 2]
