"""The bench of estalella-2005: its pure parts, against what is known without it."""

from dataclasses import replace
from types import SimpleNamespace

import bpy  # noqa: F401  mathutils comes with it
import numpy as np
import pytest
import tolerances
import trimesh

from reflect_addon.core.kernel import evaluate
from reflect_addon.core.look import Look
from reflect_addon.core.map_space import MapSpace
from reflect_addon.core.methods import virtual_objects
from reflect_addon.core.virtual_grid import grid, interpolated, trilinear
from reflect_addon.core.virtual_status import CONVERGED
from reflect_addon.evaluation import bench_estalella_flicker as flicker
from reflect_addon.evaluation import bench_estalella_grid as grids
from reflect_addon.evaluation import bench_estalella_iterations as iterations
from reflect_addon.evaluation import bench_estalella_reflectors as reflectors
from reflect_addon.evaluation import bench_estalella_stable as stable
from reflect_addon.evaluation import bench_estalella_stable_cases as stable_cases
from reflect_addon.evaluation.stability_scene import Surfaces


def test_pixels_are_those_of_a_pinhole_camera(rng):
    """Small displacements near the middle of the picture: the pinhole's own formula."""
    eye = np.array([[0.0, 0.0, 5.0]])
    true = np.array([[0.02, 0.01, -0.3]])
    shown = true + [[0.01, -0.02, 0.05]]
    per_metre = [iterations.WIDE / 2 * 5 / (5 - p[0, 2]) for p in (true, shown)]
    wanted = np.linalg.norm(true[0, :2] * per_metre[0] - shown[0, :2] * per_metre[1])
    assert abs(iterations.displacement(eye, shown, true, 1.0)[0] - wanted) < 1e-3 * wanted


def test_mirrored_twice_is_itself(rng):
    point, normal, vertex = rng.normal(size=(3, 20, 3))
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    once = iterations.mirrored(vertex, point, normal)
    np.testing.assert_allclose(iterations.mirrored(once, point, normal), vertex, atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(once - point, axis=1), np.linalg.norm(vertex - point, axis=1))


def test_steps_until_as_good():
    ours = np.array([[1.0, 5.0], [0.5, 2.0], [0.1, 1.0]])
    found = iterations.as_good(np.array([[0.6, 3.0], [0.1, 1.0], [0.01, 9.0]]), ours)
    np.testing.assert_array_equal(found, [2, 3, np.inf])


def test_more_iterations_err_less():
    found = {name: iterations.iterations(name, (3, 7, 16), pairs=200, side=64) for name in iterations.SEARCHES}
    for values in found.values():
        assert (np.diff(values[:, :, 0], axis=0) <= 1e-3 * values[:-1, :, 0] + 1e-6).all()
    assert (found["newton"][1, :, 1] < 0.1 * found["midpoint"][1, :, 1]).all()


def test_batches_are_equal_and_mixed():
    batches = grids.mixed(57, 8)
    assert sorted(np.concatenate(batches)) == list(range(57))
    assert {len(b) for b in batches} == {8, 9} and all(np.diff(b).min() == len(batches) for b in batches)
    assert not grids.mixed(0, 8) and len(grids.mixed(3, 8)) == 1


def test_what_is_made_once_is_the_same(rng):
    """A grid's kept nodes and weights interpolate as trilinear does."""
    positions, instance = rng.uniform(size=(400, 3)), np.repeat([0, 1], 200)
    tables = grid(positions, instance, 0.1)
    value = np.pad(tables.node_position.astype(np.float64), ((0, 0), (0, 1)), constant_values=1.0)
    virtual, status = interpolated(tables, value, np.full(len(value), CONVERGED))
    assert (status == CONVERGED).all()
    np.testing.assert_array_equal(virtual, trilinear(value[tables.cell_nodes[tables.vertex_cell]], tables.vertex_where))
    np.testing.assert_allclose(virtual[:, :3], positions, atol=tolerances.FLOAT32)


def test_the_truth_flickers_as_itself(rng):
    """A method that shows the truth has a ratio of 1; one that adds noise of its own has more, and says that it does not hold."""
    masks, frames = [np.ones((6, 8), bool)] * 6, rng.uniform(0.2, 0.5, (6, 48, 3)).astype(np.float32)
    same = flicker.of_frames(masks, [[f, f, f] for f in frames], Look(), [1.0] * 6, [0.0] * 6)
    assert abs(same["ours"] - 1) < 1e-6 and same["holds"]
    still = np.full_like(frames, 0.3) + 0.01 * np.arange(6)[:, None, None].astype(np.float32) ** 2
    noisy = flicker.of_frames(masks, [[s + f, s, s] for s, f in zip(still, frames, strict=True)], Look(), [1.0] * 6, [0.1] * 6)
    assert noisy["ours"] > 2 and not noisy["holds"]
    assert not flicker.of_frames(masks, [[f, s, s] for s, f in zip(still[:1].repeat(6, 0), frames, strict=True)], Look(), [1.0] * 6, [0.1] * 6)["holds"]


@pytest.mark.parametrize("made", [reflectors.bowl, reflectors.ring])
def test_reflectors_are_closed_and_turned_outwards(made):
    shape = trimesh.Trimesh(*made(), process=True)
    assert shape.is_watertight and shape.is_winding_consistent and shape.volume > 0


def test_a_bevelled_cube_is_a_cube_with_a_bevel():
    shape = trimesh.Trimesh(*stable_cases.bevelled(0.01), process=False)
    assert shape.is_watertight and shape.is_winding_consistent
    rounded = 0.98**3 + 6 * 0.98**2 * 0.01 + 3 * np.pi * 0.98 * 0.01**2 + 4 / 3 * np.pi * 0.01**3
    assert abs(shape.volume - rounded) < 1e-4 and np.isclose(np.abs(shape.vertices).max(), 0.5)


def test_every_case_has_a_reflector_and_eyes_before_it():
    names = [case.name for case in stable_cases.cases()]
    assert len(set(names)) == len(names)
    for case in stable_cases.cases():
        assert [i.is_reflector for i in case.scene.instances].count(True) == 1
        assert [c.is_orthographic for c in case.cameras] == [False, False, True]
        assert all(np.isfinite(c.clip_from_world()).all() for c in case.cameras)


def test_what_is_round_is_turned_outwards():
    for name in ("ball, a unit is 1 m", "ellipsoid 50:1", "torus", "ball turned inside out", "torus turned inside out"):
        assert (trimesh.Trimesh(*case_of(name).reflector).volume > 0) != name.endswith("inside out"), name


def case_of(name):
    return next(case for case in stable_cases.cases() if case.name == name)


def test_searches_of_a_hard_case_end():
    found = stable.measured(case_of("one triangle"), draw=False)
    assert found.searches > 100 and found.nonfinite == 0
    assert all(found.most[name] <= bound for name, bound in stable.BOUNDS.items())
    assert all(abs(sum(shares.values()) - 1) < 1e-9 for shares in found.statuses.values())
    assert stable._row([found])["holds"] and not stable._row([replace(found, wrong=1)])["holds"]


def test_a_mirror_is_found_from_its_maps_own_side():
    """The square's map has its centre on the eye's side: reflection points of what stands before it are those of the plane."""
    case = case_of("flat square")
    job = Surfaces(case.scene).job({**virtual_objects.DEFAULTS, "map_texels": 64}, {})
    asset = virtual_objects.bake(job)
    middle = case.reflector[0].mean(0)
    eye, vertex = middle + [0.3, -2.0, 0.4], middle + [-0.4, -1.0, -0.3]
    met = (eye * 1.0 + vertex * 2.0) / 3.0 * [1, 0, 1] + middle * [0, 1, 0]
    found = []
    for part in virtual_objects.parts_in(asset):
        space = MapSpace(part.center, np.eye(3) / part.size)
        points = {"observer": np.append(space.points(eye), 1), "vertex": np.append(space.points(vertex), 1)}
        inputs = {**points, "start": part.start, "block": part.block, "ball": part.ball, "cone": part.cone}
        answer = evaluate(stable._program("newton"), {n: v[None] for n, v in inputs.items()}, SimpleNamespace(images=asset.images, uniforms={}))
        if answer["status"][0] == CONVERGED:
            found.append(answer["point"][0, :3] * part.size + part.center)
    np.testing.assert_allclose(found, [met], atol=1e-4)


def test_a_point_is_on_a_surface_or_not():
    case = case_of("ball, a unit is 1 m")
    on_floor = case.scene.world_positions(case.scene.named()["Floor"])[:5]
    points, width = np.concatenate([on_floor, on_floor - [0, 0, 0.3]]), np.zeros(10)
    np.testing.assert_array_equal(stable.on_surfaces(case, Surfaces(case.scene), points, width), [True] * 5 + [False] * 5)
    assert stable.on_surfaces(case, Surfaces(case.scene), points, width + 0.4).all()


def test_pictures_do_not_depend_on_the_unit(device):
    """An orthographic camera drew no virtual object of a ball wider than 10 km: its clip space began behind them."""
    found = [stable.measured(case_of(f"ball, a unit is {size} m")) for size in ("0.0001", "100000")]
    shares = [one.drawn / one.pixels for one in found]
    assert min(shares) > 0.1 and np.ptp(shares) < tolerances.SCALE_DRAWN
    assert all(one.bad_pixels == one.wrong == one.nonfinite == 0 for one in found)
