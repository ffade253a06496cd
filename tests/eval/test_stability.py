"""evaluation/stability.py: no method gives what is not finite or takes a place where nothing is for a hit; and a wrong
hit shows."""

from dataclasses import replace
from functools import cache

import bpy  # noqa: F401  mathutils comes with it
import numpy as np
import pytest
import tolerances
from analytic import directions

from reflect_addon.core import methods
from reflect_addon.core.kernel import record, run_numpy
from reflect_addon.core.rays import Answer, Rays
from reflect_addon.evaluation import stability, stability_cases
from reflect_addon.evaluation.stability_scene import MATTE, MIRROR, Surfaces, ball, box, broken, scene_of, torus

CASES = {case.name: case for case in stability_cases.cases()}
RAYS = 600
# Maps of a quarter and views of half the bench's, which is slow in NumPy: what is looked for does not depend on how fine they are.
BAKE = {**stability.BAKE, "texels": 32, "views": 4}


@cache
def rows_of(name):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(stability, "BAKE", BAKE)
        return stability.measure(lambda share, what: None, RAYS, (CASES[name],))


@pytest.mark.parametrize("name", CASES)
def test_nothing_is_wrong(name):
    rows = rows_of(name)
    assert [row.method for row in rows] == list(methods.gathering())
    for row in rows:
        assert row.rays == RAYS and row.nonfinite == 0 and row.wrong == 0, row
        assert row.other < tolerances.STABILITY_OTHER, row
    assert max(row.hits for row in rows) > RAYS / 3


def test_any_scale_is_as_exact():
    """A power of two changes no digit: what differs between scales is what their own roundings make."""
    rows = [rows_of(f"scale {size}") for size in ("0.0001", "1", "100000")]
    for same in zip(*rows, strict=True):
        if same[0].method != "distance_map":  # its search divides differences of neighbouring distances
            assert max(row.ulps_999 for row in same) < tolerances.STABILITY_ULPS, same


def scene():
    shapes = {"Mirror": (ball(0.52), MIRROR), "Torus": (torus(0.4, 0.15, (2, 0, 0)), MATTE), "Room": (box((6, 6, 6), inside=True), MATTE)}
    return Surfaces(scene_of(shapes))


def test_a_wrong_hit_is_seen():
    surfaces = scene()
    case = replace(CASES["scale 1"], scene=surfaces.scene)
    assets = stability._baked(case, surfaces)
    rays = case.rays(np.random.default_rng(1), 300, assets)
    rays = Rays((rays.origin - stability_cases.AT).astype("f"), rays.direction)  # this mirror is at the origin
    for name, asset in assets.items():
        found = run_numpy(record(methods.get(name).trace, asset), asset, rays)
        good = stability.is_surface(rays, found)
        assert good.sum() > 200 and not stability.wrong_hits(surfaces, name, asset, rays, found).any()
        # In the middle of nowhere, and the same said to be no hit.
        lost = Answer(found.radiance, found.coverage, np.full_like(found.position, 1.5), found.status)
        wrong = stability.wrong_hits(surfaces, name, asset, rays, lost)
        assert np.array_equal(wrong, stability.is_surface(rays, lost)) and wrong.sum() > 200
        assert not stability.wrong_hits(surfaces, name, asset, rays, replace(lost, status=0 * lost.status + 2)).any()


def test_the_truth_against_closed_forms(rng):
    """Tracer and distances on a ball of many facets, and on a box."""
    surfaces = Surfaces(scene_of({"Mirror": (ball(0.5, (1e3, 0, 0), 40), MIRROR), "Box": (box((2, 3, 4)), MATTE)}))
    points = rng.uniform(-0.9, 0.9, (200, 3)) * [1, 1.5, 2]
    inside = np.min([1, 1.5, 2] - np.abs(points), axis=1)
    np.testing.assert_allclose(surfaces.distance(surfaces.scene.instances[1], points), inside, atol=1e-5)
    out = directions(rng, 200)
    distance = surfaces.distance(surfaces.scene.instances[0], [1e3, 0, 0] + 2 * out)
    np.testing.assert_allclose(distance, 1.5, atol=3e-3)  # of facets
    hits = surfaces.trace(Rays(([1e3, 0, 0] + 2 * out).astype("f"), (-out).astype("f")))
    assert hits.hit.all() and (hits.object == 0).all()
    np.testing.assert_allclose(np.linalg.norm(hits.position - [1e3, 0, 0], axis=1), 0.5, atol=3e-3)
    facing = (hits.normal * out).sum(1)
    assert facing.min() >= 0 and np.mean(facing > 0.99) > 0.98  # a pole's triangles have no normal


def test_a_broken_mesh_is_the_same_surface(rng):
    shape = torus(0.4, 0.15)
    assert len(broken(shape)[1]) == 5 * len(shape[1])
    whole, twice = (Surfaces(scene_of({"Mirror": (s, MIRROR)})) for s in (shape, broken(shape)))
    points = rng.uniform(-1, 1, (300, 3))
    found = [s.distance(s.scene.instances[0], points) for s in (whole, twice)]
    np.testing.assert_allclose(*found, rtol=1e-4, atol=1e-6)
