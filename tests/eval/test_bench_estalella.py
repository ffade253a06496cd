"""The bench of estalella-2005: its pure parts, against what is known without it."""

import numpy as np
import tolerances

from reflect_addon.core.virtual_grid import grid, interpolated, trilinear
from reflect_addon.core.virtual_status import CONVERGED
from reflect_addon.evaluation import bench_estalella_grid as grids
from reflect_addon.evaluation import bench_estalella_iterations as iterations


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
