"""How octrees of virtual vertices are laid out for passes, and gone through (core/virtual_octree.py, core/virtual_follow.py)."""

import numpy as np
import pytest
import tolerances
import trimesh
from mirror_ball import Mirror

from reflect_addon.core.virtual_follow import follow
from reflect_addon.core.virtual_grid import grid, interpolated, trilinear
from reflect_addon.core.virtual_octree import octree
from reflect_addon.core.virtual_status import CONVERGED, FAILED, HIDDEN

PIXELS = 100.0  # a metre


def in_pixels(virtual):
    return PIXELS * virtual[:, :2]


def bent(points):
    """A field that is straight but for a bump about the origin, and is met at 1 m."""
    bump = np.exp(-8 * (points.astype(float) ** 2).sum(1))
    return np.column_stack([points + 0.3 * bump[:, None] * [1, 2, 0], np.ones(len(points))])


class Asked:
    """A search that finds the bump everywhere, and remembers what it was asked."""

    def __init__(self, state=lambda points: np.full(len(points), CONVERGED)):
        self.points, self.state = [np.zeros((0, 3))], state

    def __call__(self, points, instance):
        assert len(points) == len(instance)
        self.points.append(points)
        return bent(points), self.state(points)


def sheets(count=40000):
    """(positions, instance): a ball's surface, a wall and a line, whose sides differ."""
    random = np.random.default_rng(5)
    ball = random.normal(size=(count // 2, 3))
    ball /= np.linalg.norm(ball, axis=1, keepdims=True) / [0.7, 0.5, 0.1]
    wall = random.uniform(-1, 1, (count // 4, 3)) * [1, 0.3, 0]
    line = random.uniform(-1, 1, (count // 4, 3)) * [0, 1, 0]
    positions = np.concatenate([ball, wall, line]).astype(np.float32)
    return positions, np.repeat([2, 3, 7], [count // 2, count // 4, count // 4])


@pytest.fixture(scope="module")
def tree():
    return octree(*sheets())


def test_levels_are_ranges(tree):
    nodes, cells = tree.node_ranges, tree.cell_ranges
    assert nodes[0, 0] == cells[0, 0] == 0 and nodes[-1, 2] == len(tree.node_position) and cells[-1, 1] == len(tree.cell_nodes)
    np.testing.assert_array_equal(nodes[1:, 0], nodes[:-1, 2])
    np.testing.assert_array_equal(cells[1:, 0], cells[:-1, 1])
    before = 0, 0
    for (middle, corner, end), (first, last) in zip(nodes, cells, strict=True):
        np.testing.assert_array_equal(tree.cell_nodes[first:last, 8], np.arange(middle, corner))
        assert tree.cell_nodes[first:last].max() < end
        parent = tree.cell_parent[first:last]
        assert (parent == -1).all() if first == 0 else ((parent >= before[0]) & (parent < before[1])).all()
        before = first, last


def test_nodes_lie_where_the_tables_say(tree):
    corners = tree.node_position[tree.cell_nodes]
    np.testing.assert_allclose(corners[:, :8].mean(1), corners[:, 8], atol=1e-6)
    inside = trilinear(corners[tree.vertex_cell, :8], tree.vertex_where)
    np.testing.assert_allclose(inside, tree.position, atol=1e-6)
    np.testing.assert_array_equal(tree.node_instance[tree.cell_nodes[tree.vertex_cell, 0]], tree.instance)
    for nth in range(tree.node_around.shape[1]):
        some = np.flatnonzero(tree.node_around[:, nth] >= 0)
        around = corners[tree.node_around[some, nth], :8]
        assert ((tree.node_position[some] >= around[:, 0] - 1e-6) & (tree.node_position[some] <= around[:, 7] + 1e-6)).all()
        if nth == 0:
            np.testing.assert_allclose(trilinear(around, tree.node_where[some]), tree.node_position[some], atol=1e-6)


def test_parts_of_a_cell_find_their_corners_searched(tree):
    """Every corner of a part has its cell among those that make it worth a search, or is a node of that cell or of one that this is in."""
    part = np.flatnonzero(tree.cell_parent >= 0)
    corners, above = tree.cell_nodes[part, :8], tree.cell_parent[part]
    known = (tree.node_around[corners] == above[:, None, None]).any(2)
    while (above >= 0).any():
        known |= ((corners[:, :, None] == tree.cell_nodes[above][:, None]).any(2)) & (above >= 0)[:, None]
        above = np.where(above >= 0, tree.cell_parent[above], -1)
    assert known.all()


def test_what_is_flat_has_one_layer_of_nodes(tree):
    for instance, most in ((3, 4), (7, 2)):
        cells = tree.cell_nodes[tree.node_instance[tree.cell_nodes[:, 0]] == instance, :8]
        assert max(len(set(nodes)) for nodes in cells.tolist()) == most
    tables = grid(*sheets(), 0.1)
    places = np.column_stack([tables.node_instance, tables.node_position])
    assert len(np.unique(places, axis=0)) == len(places)


def test_searches_go_where_it_bends(tree):
    asked, tolerance = Asked(), 0.5
    virtual, status, searched = follow(tree, asked, in_pixels, tolerance)
    assert (status == CONVERGED).all()
    off = np.linalg.norm(in_pixels(virtual) - in_pixels(bent(tree.position)), axis=1)
    assert np.percentile(off, 95) < tolerance and off.max() < tolerances.GRID_SADDLE * tolerance
    points = np.concatenate(asked.points)
    assert len(points) == searched.sum() < len(tree.position) / 5
    nodes = points[: searched[:-1].sum()]
    assert np.median(np.linalg.norm(nodes, axis=1)) < 0.6 * np.median(np.linalg.norm(tree.node_position, axis=1))
    coarse = follow(tree, Asked(), in_pixels, 1000 * tolerance)[2]
    assert coarse.sum() == tree.node_ranges[0, 2]  # the first level's nodes, and nothing else


def test_no_node_is_searched_twice(tree):
    own = octree(tree.position[tree.instance == 2], np.full((tree.instance == 2).sum(), 2))
    asked = Asked()
    searched = follow(own, asked, in_pixels, 0.1)[2]
    nodes = np.concatenate(asked.points)[: searched[:-1].sum()]
    assert len(np.unique(nodes, axis=0)) == len(nodes)


def test_a_finer_tolerance_asks_more_and_errs_less(tree):
    truth, counts, errors = in_pixels(bent(tree.position)), [], []
    for tolerance in (4, 1, 0.25):
        virtual, _, searched = follow(tree, Asked(), in_pixels, tolerance)
        counts.append(searched.sum())
        errors.append(np.linalg.norm(in_pixels(virtual) - truth, axis=1).max())
    assert counts[0] < counts[1] < counts[2] and errors[0] > errors[1] > errors[2]


def test_neighbours_across_cells_stay_together():
    """Points that are a thousandth apart, everywhere on a wall."""
    random = np.random.default_rng(6)
    points = random.uniform(-1, 1, (30000, 3)) * [1, 1, 0]
    points = np.concatenate([points, points + random.uniform(-1, 1, points.shape) * [1e-3, 1e-3, 0]]).astype(np.float32)
    virtual, _, _ = follow(octree(points, np.zeros(len(points), int)), Asked(), in_pixels, 1.0)
    off = in_pixels(virtual - bent(points)).reshape(2, -1, 2)
    jump = np.linalg.norm(off[0] - off[1], axis=1)
    assert jump.max() < tolerances.GRID_JUMP


def test_vertices_at_one_place_stay_together(tree):
    twice = octree(np.concatenate([tree.position] * 2), np.concatenate([tree.instance] * 2))
    virtual, status, _ = follow(twice, Asked(), in_pixels, 0.5)
    np.testing.assert_array_equal(*np.split(virtual, 2))
    np.testing.assert_array_equal(*np.split(status, 2))


def test_what_is_not_found_is_searched_itself(tree):
    """Where a half of space fails: there vertices fail, elsewhere they are right, and none is interpolated from both."""
    asked = Asked(lambda points: np.where(points[:, 0] > 0.05, FAILED, CONVERGED))
    virtual, status, searched = follow(tree, asked, in_pixels, 0.5)
    wrong = (status == FAILED) != (tree.position[:, 0] > 0.05)
    off = np.linalg.norm(in_pixels(virtual) - in_pixels(bent(tree.position)), axis=1)
    # What lies in a cell narrower than the tolerance, half a centimetre, may be called either.
    assert np.abs(tree.position[wrong, 0] - 0.05).max(initial=0) < 0.01
    assert off[status == CONVERGED].max() < tolerances.GRID_SADDLE * 0.5
    assert searched.sum() < len(tree.position) / 3


@pytest.mark.parametrize("state", [HIDDEN, FAILED])
def test_what_shows_nothing_costs_little(tree, state):
    _, status, searched = follow(tree, Asked(lambda points: np.full(len(points), state)), in_pixels, 0.5)
    assert (status == state).all() and searched.sum() < len(tree.position) / 100


MODELS = {"teapot.obj": 1, "stanford-bunny.obj": 4}


@pytest.mark.parametrize("name", MODELS)
@pytest.mark.parametrize("place", [(1.3, -1.3, 0.3), (0, -2.2, 0), (1.8, -0.5, 0.3)])
def test_models_in_a_ball(shared, name, place):
    """Target E3 and the tolerance in pixels on meshes of thousands of vertices, 1.6 m wide, beside a ball 1 m wide in 320 x 240."""
    points = np.unique(trimesh.load(shared / "models" / name, process=False, force="mesh").vertices, axis=0)[:: MODELS[name]]
    points = ((points - points.mean(0)) / np.ptp(points, axis=0).max() * 1.6 + place).astype(np.float32)
    one, mirror = np.zeros(len(points), int), Mirror()
    tables = grid(points, one, 0.1)
    tree, counts = octree(points, one), []
    for far in (1, 4):
        mirror.eye = np.array([0.0, -3.0, 0.5]) * far
        truth, said = mirror.search(points)

        def off(virtual, status):
            seen = (said == CONVERGED) & (status == CONVERGED)
            assert seen.sum() > tolerances.GRID_SEEN * (said == CONVERGED).sum()
            return np.linalg.norm(mirror.pixels(virtual) - mirror.pixels(truth), axis=1)[seen]

        assert np.percentile(off(*interpolated(tables, *mirror.search(tables.node_position))), 95) < tolerances.GRID_DISPLACEMENT
        virtual, status, searched = follow(tree, mirror.search, mirror.pixels, tolerances.GRID_DISPLACEMENT)
        assert off(virtual, status).max() < tolerances.GRID_DISPLACEMENT
        counts.append(searched.sum())
    assert counts[0] < len(points) / 4 and counts[1] < counts[0]
