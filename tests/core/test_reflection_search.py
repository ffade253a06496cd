"""Searches for reflection points against formulas: they find them, say so only where it is so, and end."""

import analytic_reflectors as shapes
import numpy as np
import pytest
import tolerances
from analytic import unit

from reflect_addon.core import reflection_search as search
from reflect_addon.core import virtual_status as status
from reflect_addon.core.kernel import evaluate, record_function
from reflect_addon.core.reflector_map import build
from reflect_addon.evaluation import known_reflectors as known

SIDE = 256
MARGIN = 6 / SIDE  # three texels
COUNT = 2000
ANALYTIC = {**shapes.OPEN, **{name: shapes.ROUND[name] for name in ("sphere", "ellipsoid")}}


@pytest.fixture(scope="module")
def maps():
    """Maps by name, made once."""
    made = {}
    return lambda name, reflector, side=SIDE: made.setdefault((name, side), known.map_of(reflector, side))


@pytest.mark.parametrize("name", ANALYTIC)
def test_finds_the_reflection_point(maps, rng, name):
    reflector = ANALYTIC[name]
    eye, vertex, point = known.pairs_of_interest(rng, reflector, COUNT, MARGIN)
    answer = known.search(search.newton, maps(name, reflector), eye, vertex)
    found = answer["status"] == status.CONVERGED
    assert (found & (shapes.off(answer, point) <= tolerances.POINT)).mean() >= tolerances.POINTS_FOUND
    height = ((vertex - point) * reflector.surface(unit(point))[1]).sum(-1, keepdims=True)
    virtual = vertex - 2 * height * reflector.surface(unit(point))[1]
    miss = np.linalg.norm(answer["virtual"][:, :3] - virtual, axis=-1) / np.linalg.norm(vertex, axis=-1)
    assert np.quantile(miss[found], tolerances.POINTS_FOUND) <= tolerances.VIRTUAL_POINT


@pytest.mark.parametrize("name", ["sphere", "ellipsoid", "paraboloid"])
def test_error_falls_with_the_square_of_the_resolution(maps, rng, name):
    eye, vertex, point = known.pairs_of_interest(rng, ANALYTIC[name], 500, 6 / 64)
    errors = [np.median(shapes.off(known.search(search.newton, maps(name, ANALYTIC[name], n), eye, vertex), point)) for n in (64, 128, 256)]
    low, high = tolerances.SEARCH_ORDER
    assert all(low < order < high for order in -np.diff(np.log2(errors)))


def test_shortest_ways_are_alhazens(rng):
    eye, vertex, point = known.pairs_of_interest(rng, shapes.ROUND["sphere"], 500)
    np.testing.assert_allclose(shapes.alhazen(eye, vertex), point, atol=1e-9)


@pytest.mark.parametrize("kernel", [search.newton, search.midpoint])
@pytest.mark.parametrize("name", shapes.ROUND)
def test_hidden_is_never_reflected(maps, rng, name, kernel):
    reflector = shapes.ROUND[name]
    eye, vertex = known.random_pairs(rng, 1000)
    vertex = -unit(eye) * np.linalg.norm(vertex, axis=-1, keepdims=True) + rng.normal(size=eye.shape) * 0.3
    hidden = reflector.hidden(eye, vertex) & (np.linalg.norm(vertex, axis=-1) > 1)
    answer = known.search(kernel, maps(name, reflector), eye[hidden], vertex[hidden])
    assert np.isin(answer["status"], (status.HIDDEN, status.FAILED)).all()
    if kernel is search.newton:
        assert (answer["status"] == status.HIDDEN).mean() >= tolerances.HIDDEN_FOUND.get(name, 1.0)


def test_hidden_vertices_are_images(maps, rng):
    """The virtual vertex of a hidden V is the point that the sphere shows at V: searched for itself, V is its image."""
    sphere = shapes.ROUND["sphere"]
    eye = unit(rng.normal(size=(500, 3))) * 3
    vertex = -unit(eye) * rng.uniform(1.1, 2, (500, 1))
    behind = known.search(search.newton, maps("sphere", sphere), eye, vertex)
    again = known.search(search.newton, maps("sphere", sphere), eye, behind["virtual"][:, :3])
    assert (behind["status"] == status.HIDDEN).all()
    reflected = again["status"] == status.CONVERGED
    np.testing.assert_allclose(again["virtual"][reflected, :3], vertex[reflected], atol=tolerances.HIDDEN_IMAGE)
    assert reflected.mean() > 0.9


@pytest.mark.parametrize("name", ["sphere", "ellipsoid"])
def test_virtual_vertices_are_continuous_across_the_limit(maps, name):
    for count in (200, 2000, 20000):
        steps = np.linspace(-0.3, 1.5, count + 1)
        vertex = np.stack([np.full_like(steps, -1.5), steps, 0.2 + 0 * steps], -1)
        eye = np.broadcast_to([4.0, 0.5, 0.3], vertex.shape)
        answer = known.search(search.newton, maps(name, shapes.ROUND[name]), eye, vertex)
        said = answer["status"] != status.FAILED
        assert {status.CONVERGED, status.HIDDEN} == set(answer["status"][said].tolist()) and (~said).sum() <= 1 + count / 1000
        jump = np.linalg.norm(np.diff(answer["virtual"][said, :3], axis=0), axis=-1).max()
        assert jump <= tolerances.VIRTUAL_JUMP * np.sqrt(1.8 / count)


@pytest.mark.parametrize("name", shapes.OPEN)
def test_beyond_an_open_rim_nothing_is_reflected(maps, rng, name):
    reflector = shapes.OPEN[name]
    eye, vertex = (unit(rng.normal(size=(COUNT, 3)) + [0, 0, 1.5]) * rng.uniform(1.5, 6, (COUNT, 1)) for _ in range(2))
    eye, vertex = (p[~reflector.hidden(eye, vertex)] for p in (eye, vertex))
    point = known.reflected(reflector, eye, vertex)
    beyond = ~reflector.there(point, -MARGIN)
    answer = known.search(search.newton, maps(name, reflector), eye[beyond], vertex[beyond])["status"]
    assert beyond.sum() > 100 and not np.isin(answer, (status.CONVERGED, status.HIDDEN)).any()
    near = reflector.there(point[beyond], -0.3)
    assert (answer[near] == status.UNREFLECTED).mean() > tolerances.UNREFLECTED_FOUND[name]


def test_a_warm_start_takes_fewer_evaluations(maps, rng):
    made = maps("ellipsoid", shapes.ROUND["ellipsoid"])
    eye, vertex, point = known.pairs_of_interest(rng, shapes.ROUND["ellipsoid"], 1000)
    cold = known.search(search.newton, made, eye, vertex)
    warm = known.search(search.newton, made, eye + 0.003, vertex + 0.01, start=cold["direction"])
    assert warm["evaluations"].mean() <= 0.75 * cold["evaluations"].mean()
    assert (warm["status"] == status.CONVERGED).mean() >= tolerances.POINTS_FOUND


def test_newton_takes_half_the_evaluations_of_midpoint(maps, rng):
    made = maps("ellipsoid", shapes.ROUND["ellipsoid"])
    eye, vertex, _ = known.pairs_of_interest(rng, shapes.ROUND["ellipsoid"], 1000)
    ways = [known.first_search(way) for way in (search.descend, search.follow)]
    for tolerance in (1e-2, 1e-3, 1e-4, 1e-5):
        ours, theirs = (known.search(way, made, eye, vertex, steps=100, tolerance=tolerance) for way in ways)
        both = (ours["residual"] <= tolerance) & (theirs["residual"] <= tolerance)
        assert both.mean() > 0.95 and ours["evaluations"][both].mean() <= 0.5 * theirs["evaluations"][both].mean()


def test_the_side_that_mirrors_is_turned_by_the_block(maps, rng):
    """A hollow sphere, seen from inside: eye, vertex and centre on one line are reflected at its ends."""
    eye, vertex = np.array([[0, 0, 0.5]]), np.array([[0, 0, 0.2]])
    answer = known.search(search.newton, maps("sphere", shapes.ROUND["sphere"]), eye, vertex, start=np.array([[0.1, 0, 1]]), mirror=-1.0)
    assert answer["status"] == status.CONVERGED
    np.testing.assert_allclose(answer["point"][0, :3], [0, 0, 1], atol=1e-4)
    np.testing.assert_allclose(answer["normal"][0], [0, 0, -1], atol=1e-4)


def hard_pairs(rng, reflector) -> dict:
    """name: (eyes, vertices), homogeneous, of what a scene may hold."""
    out = unit(rng.normal(size=(200, 3)))
    distance, normal, _ = reflector(out)
    on = out * distance[:, None]
    far, one, none = out[::-1] * rng.uniform(1.5, 5, (200, 1)), np.ones((200, 1)), np.zeros((200, 1))
    other = np.roll(out, 7, 0)
    return {
        "any": ((far, one), (other * 2, one)),
        "eye on the surface": ((on, one), (far, one)),
        "vertex on the surface": ((far, one), (on, one)),
        "both on the surface": ((on, one), (on[::-1], one)),
        "both in one place": ((far, one), (far, one)),
        "both at the centre": ((0 * on, one), (0 * on, one)),
        "collinear, before": ((out * 4, one), (out * 2, one)),
        "collinear, behind": ((out * 4, one), (-out * 2, one)),
        "grazing": ((on + np.cross(normal, other) * 3, one), (on - np.cross(normal, other) * 3, one)),
        "vertex at infinity": ((far, one), (other, none)),
        "orthographic": ((out, none), (far, one)),
        "both at infinity": ((out, none), (other, none)),
        "far away": ((out * 1e5, one), (other * 1e5, one)),
        "inside": ((on * 0.5, one), (far, one)),
    }


HARD = {
    **{name: reflector.surface for name, reflector in (shapes.ROUND | shapes.OPEN).items()},
    "bevelled cube": shapes.bevelled_cube(),
    "nothing": lambda d: (np.ones(len(d)), d, np.zeros(len(d), bool)),
    "a point": lambda d: (np.zeros(len(d)), d, np.ones(len(d), bool)),
}


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("name", HARD)
def test_every_search_ends_and_is_finite(rng, name, dtype):
    made, steps = build(np.zeros(3), 0.0 if name == "a point" else 1.0, 32, HARD[name]), 24
    pairs = hard_pairs(rng, HARD[name])
    eye, vertex = (np.concatenate([np.concatenate(p[i], -1) for p in pairs.values()]) for i in (0, 1))
    for kernel, most in ((search.newton, 2 * steps + search.DEEPEST + 12), (search.midpoint, 4 * steps + 2)):
        answer = known.search(kernel, made, eye, vertex, steps=steps, dtype=dtype)
        for key, values in answer.items():
            broken = ~np.isfinite(values.reshape(len(eye), -1)).all(-1)
            assert not broken.any(), f"{key}: {[list(pairs)[i] for i in np.unique(np.flatnonzero(broken) // 200)]}"
        assert answer["evaluations"].max() <= most and np.isin(answer["status"], list(status.NAMES)).all()


def test_a_part_is_not_left_out_where_it_reflects(rng):
    """Caps of ellipsoids of all sizes, whose ball and cone are just as large as they are."""
    program = record_function(
        lambda k, scope, **given: {"may": k.select(search.may_reflect(k, **given), 1.0, 0.0)},
        {name: search.INPUTS[name] for name in ("observer", "vertex", "block", "ball", "cone")},
    )
    for _ in range(60):
        axes = np.array([1, *rng.uniform(0.1, 1, 2)])
        sphere = unit(unit(rng.normal(size=3)) + rng.normal(size=(400, 3)) * rng.uniform(0.02, 0.5))
        point, normal = sphere * axes, unit(sphere / axes)
        middle, axis = point.mean(0), unit(normal.mean(0))
        ball = (*middle, np.linalg.norm(point - middle, axis=-1).max())
        cone = (*axis, (normal @ axis).min())
        to_eye = unit(rng.normal(size=(400, 3)))
        to_eye *= np.sign((to_eye * normal).sum(-1, keepdims=True))
        mirrored = 2 * (to_eye * normal).sum(-1, keepdims=True) * normal - to_eye
        eye, vertex = (point + to * 10 ** rng.uniform(-2, 2, (400, 1)) for to in (to_eye, mirrored))
        given = {"observer": np.pad(eye, ((0, 0), (0, 1)), constant_values=1), "vertex": np.pad(vertex, ((0, 0), (0, 1)), constant_values=1)}
        given |= {"block": np.tile((0, 0, 8.0, 1.0), (400, 1)), "ball": np.tile(ball, (400, 1)), "cone": np.tile(cone, (400, 1))}
        assert evaluate(program, given, None, dtype=np.float64)["may"].all()
