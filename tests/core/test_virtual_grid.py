"""Grids and octrees of virtual vertices (core/virtual_grid.py, core/virtual_octree.py)."""

from time import process_time

import numpy as np
import pytest
import tolerances
import trimesh
from mirror_ball import Mirror

from reflect_addon.core.virtual_follow import follow
from reflect_addon.core.virtual_grid import CORNERS, grid, interpolated
from reflect_addon.core.virtual_octree import octree
from reflect_addon.core.virtual_status import CONVERGED, FAILED, HIDDEN, UNREFLECTED

MATRIX = np.array([[1.0, 0.3, -0.2, 0.1], [0.0, -2.0, 0.4, 3.0], [0.5, 0.1, 0.7, -1.0]])


def affine(points, instance=None):
    return np.column_stack([points.astype(np.float64) @ MATRIX[:, :3].T + MATRIX[:, 3], np.ones(len(points))])


def everywhere(points, instance):
    """A search that finds all."""
    return affine(points), np.full(len(points), CONVERGED)


def in_pixels(virtual):
    return virtual[:, :2] / virtual[:, 3:] * 320


def teapot() -> np.ndarray:
    """(V, 3) vertices of a body with a handle, a spout and a knob, 1.6 m wide."""
    turned = trimesh.transformations.rotation_matrix(np.pi / 2, [1, 0, 0])
    return trimesh.util.concatenate([
        trimesh.creation.icosphere(4, 0.5),
        trimesh.creation.torus(0.3, 0.06, 64, 24).apply_transform(turned).apply_translation([0.5, 0, 0]),
        trimesh.creation.cylinder(0.06, 0.6, sections=48).subdivide().subdivide().apply_translation([-0.6, 0, 0]),
        trimesh.creation.icosphere(3, 0.1).apply_translation([0, 0, 0.6]),
    ]).vertices.astype(np.float32)  # fmt: skip


def instances(count=5, each=1500):
    """(positions, instance): surfaces of different shapes, numbered 3, 5, 7 ..."""
    random = np.random.default_rng(2)
    on = random.normal(size=(count * each, 3))
    on *= np.repeat(random.uniform(0.3, 2, (count, 3)), each, axis=0) / np.linalg.norm(on, axis=1, keepdims=True)
    return on.astype(np.float32), np.repeat(2 * np.arange(count) + 3, each).astype(np.int32)


@pytest.mark.parametrize("share", [0.041, 0.055, 0.096, 0.143, 0.5])
def test_nodes_are_a_share_of_the_vertices(share):
    positions, instance = instances()
    tables = grid(positions, instance, share)
    for one in np.unique(instance):
        wanted = share * (instance == one).sum()
        assert abs((tables.node_instance == one).sum() - wanted) <= tolerances.GRID_SHARE * wanted


def test_tables_belong_together():
    positions, instance = instances()
    tables = grid(positions, instance, 0.1)
    assert (np.diff(tables.node_instance) >= 0).all()
    assert (tables.node_instance[tables.cell_nodes] == tables.node_instance[tables.cell_nodes[:, :1]]).all()
    np.testing.assert_array_equal(tables.node_instance[tables.cell_nodes[tables.vertex_cell, 0]], instance)
    np.testing.assert_array_equal(np.unique(tables.vertex_cell), np.arange(len(tables.cell_nodes)))
    np.testing.assert_array_equal(np.unique(tables.cell_nodes), np.arange(len(tables.node_position)))
    assert tables.vertex_where.min() >= 0 and tables.vertex_where.max() <= 1
    corner = tables.node_position[tables.cell_nodes]
    size = (corner[:, 7] - corner[:, 0])[:, None]
    np.testing.assert_allclose(corner, corner[:, :1] + size * CORNERS, atol=1e-5)
    assert (size.max(2) / size.min(2)).max() < 2


def test_a_place_has_one_node():
    positions, instance = instances()
    tables, tree = grid(positions, instance, 0.2), octree(positions, instance)
    for place, owner in ((tables.node_position, tables.node_instance), (tree.node_position, tree.node_instance)):
        assert len(np.unique(np.column_stack([place, owner]), axis=0)) == len(place)


def test_affine_maps_are_exact():
    positions, instance = instances()
    tables = grid(positions, instance, 0.1)
    virtual, status = interpolated(tables, affine(tables.node_position), np.full(len(tables.node_position), CONVERGED))
    np.testing.assert_allclose(virtual, affine(positions), atol=1e-5)
    assert (status == CONVERGED).all()
    tree = octree(positions, instance)
    # So coarse a tolerance that even the first cells are not too wide.
    virtual, status, searched = follow(tree, everywhere, in_pixels, 1e4)
    np.testing.assert_allclose(virtual, affine(positions), atol=1e-5)
    assert (status == CONVERGED).all() and searched.sum() == tree.node_ranges[0, 2]


def test_vertices_at_one_place_stay_together():
    """Whatever cell says it: no cracks along creases, where a place has several vertices, nor between cells."""
    positions, instance = instances()
    twice = np.concatenate([positions, positions]), np.concatenate([instance, instance])
    tables = grid(*twice, 0.1)
    bent = np.column_stack([np.sin(3 * tables.node_position), np.ones(len(tables.node_position))])
    virtual, _ = interpolated(tables, bent, np.full(len(bent), CONVERGED))
    np.testing.assert_array_equal(virtual[: len(positions)], virtual[len(positions) :])
    # On the face between two cells both say the same.
    at = {}
    for nodes in tables.cell_nodes:
        for face in ((1, 3, 5, 7), (0, 2, 4, 6)):
            key = tuple(tables.node_position[nodes[list(face)]].ravel()), int(tables.node_instance[nodes[0]])
            assert at.setdefault(key, tuple(nodes[list(face)])) == tuple(nodes[list(face)])


def test_what_cannot_be_interpolated_has_failed():
    positions = np.array([[0, 0, 0], [1, 1, 1], [0.5, 0.5, 0.5]], np.float32)
    tables = grid(positions, np.zeros(3, int), 0.1)
    for one, said in ((FAILED, FAILED), (HIDDEN, FAILED), (UNREFLECTED, CONVERGED), (CONVERGED, CONVERGED)):
        status = np.full(8, CONVERGED)
        status[6] = one
        assert (interpolated(tables, affine(tables.node_position), status)[1] == said).all()
    assert (interpolated(tables, affine(tables.node_position), np.full(8, HIDDEN))[1] == HIDDEN).all()


@pytest.mark.parametrize("size", [1e-4, 1.0, 1e5])
@pytest.mark.parametrize("shape", ["plane", "line", "point", "one", "surface"])
def test_any_size_and_shape(shape, size):
    random = np.random.default_rng(4)
    positions = random.uniform(-1, 1, (300, 3)) * {"plane": [1, 1, 0], "line": [0, 1, 0], "point": [0, 0, 0]}.get(shape, [1, 1, 1])
    positions = ((positions + 2) * size).astype(np.float32)[: 1 if shape == "one" else None]
    instance = np.zeros(len(positions), np.int32)
    tables = grid(positions, instance, 0.2)
    if shape in ("point", "one"):
        assert len(tables.node_position) == 8
    virtual, _ = interpolated(tables, affine(tables.node_position), np.full(len(tables.node_position), CONVERGED))
    np.testing.assert_allclose(virtual, affine(positions), rtol=1e-5, atol=1e-5 * size)
    virtual, status, _ = follow(octree(positions, instance), everywhere, in_pixels, 0.01)
    np.testing.assert_allclose(virtual, affine(positions), rtol=1e-5, atol=1e-5 * size)


def test_nothing_at_all():
    none = np.zeros((0, 3), np.float32), np.zeros(0, np.int32)
    tables = grid(*none, 0.1)
    assert tables.cell_nodes.shape == (0, 8)
    assert len(interpolated(tables, np.zeros((0, 4)), np.zeros(0))[0]) == 0
    assert follow(octree(*none), everywhere, in_pixels, 0.1)[2].sum() == 0


@pytest.mark.parametrize("place", [(0, -2, 0), (1.8, -0.5, 0.3), (-1.2, -1.2, 1.2)])
def test_a_tenth_of_the_searches_moves_nothing_visibly(place):
    mirror, points = Mirror(), teapot() + np.array(place)
    truth, said = mirror.search(points)
    tables = grid(points, np.zeros(len(points), int), 0.1)
    virtual, status = interpolated(tables, *mirror.search(tables.node_position))
    seen = (said == CONVERGED) & (status == CONVERGED)
    assert seen.mean() > tolerances.GRID_SEEN
    off = np.linalg.norm(mirror.pixels(virtual) - mirror.pixels(truth), axis=1)[seen]
    assert np.percentile(off, 95) < tolerances.GRID_DISPLACEMENT


def test_searches_fall_with_the_screen():
    """The same vertices from ever farther away: the error stays, and the searches go where the ball's area goes."""
    mirror, points = Mirror(), teapot() + np.array((1.3, -1.3, 0.3))
    tree, counts = octree(points, np.zeros(len(points), int)), []
    for far in (1, 4, 16):
        mirror.eye = np.array([0.0, -3.0, 0.5]) * far
        truth, said = mirror.search(points)
        virtual, status, searched = follow(tree, mirror.search, mirror.pixels, tolerances.GRID_DISPLACEMENT)
        seen = (said == CONVERGED) & (status == CONVERGED)
        off = np.linalg.norm(mirror.pixels(virtual) - mirror.pixels(truth), axis=1)[seen]
        assert np.percentile(off, 95) < tolerances.GRID_DISPLACEMENT
        assert seen.sum() > tolerances.GRID_SEEN * (said == CONVERGED).sum()
        counts.append(searched.sum())
    assert counts[0] < len(points) / 4 and counts[1] <= counts[0] and counts[2] < counts[0] / 4


def test_tables_are_quick():
    positions, instance = instances(40, 2500)
    start = process_time()
    grid(positions, instance, 0.1)
    octree(positions, instance)
    assert process_time() - start < tolerances.GRID_SECONDS
