"""Grids of virtual vertices on the device: equal to NumPy's, node by node and vertex by vertex; and what they draw and cost."""

from dataclasses import replace
from types import SimpleNamespace

import hand_scenes
import numpy as np
import pytest
import tolerances
from test_virtual_objects_drawn import CAMERA, SCENE, Seen, moved, renderer_of, rigid
from virtual_scenes import baked

from reflect_addon.core import reflection_search
from reflect_addon.core.kernel import evaluate, record_function
from reflect_addon.core.methods import virtual_objects
from reflect_addon.core.spaces import STATUS_HIT
from reflect_addon.core.virtual_follow import follow
from reflect_addon.core.virtual_grid import grid, interpolated
from reflect_addon.core.virtual_octree import octree
from reflect_addon.core.virtual_status import FAILED
from reflect_addon.gpu.virtual_search import MAPS

SHARE, TOLERANCE = 0.1, 0.25
WAYS = {"share": {"grid_share": SHARE}, "levels": {"grid_tolerance": TOLERANCE}}


@pytest.fixture(scope="module")
def ball_baked():
    return baked(SCENE)


def asking(found, **options):
    """The same assets with other options."""
    assets = {name: replace(asset, options={**asset.options, **options}) for name, asset in found.assets.items()}
    return replace(found, assets=assets)


@pytest.fixture(params=WAYS)
def way(request):
    return request.param


@pytest.fixture
def drawn(device, ball_baked, way):
    renderer = renderer_of(asking(ball_baked, **WAYS[way]))
    yield renderer
    renderer.free()


class OnePiece:
    """The ball's only piece as the last frame left it, and its search in NumPy."""

    def __init__(self, renderer, found):
        self.projector = renderer._answers.projector
        (self.held,), (asset,) = self.projector._parts.values(), found.assets.values()
        (self.piece,) = virtual_objects.parts_in(asset)
        self.mesh, self.space = self.projector.scene.mesh, self.held.space
        self.matrices = self.space.from_objects(self.held.places)
        options = {"steps": int(asset.options["search_steps"]), "tolerance": reflection_search.TOLERANCE}
        self.program = record_function(reflection_search.newton, reflection_search.INPUTS, MAPS, options=options)
        self.asset = SimpleNamespace(images=asset.images, uniforms={})
        self.others = np.array([name != "Mirror" for name in self.mesh.names])
        self.asked, self.all = 0, 0

    def search(self, points, instance):
        """Counts those of other instances than the mirror itself, whose chunks are not shown."""
        self.asked, self.all = self.asked + int(self.others[instance].sum()), self.all + len(points)
        placed = np.einsum("nij,nj->ni", self.matrices[instance], np.column_stack([points, np.ones(len(points))]))
        piece = self.piece
        assert piece.cone[3] <= -0.999  # all round, so that no margin matters
        row = {"observer": self.space.observer(CAMERA), "start": [0] * 4, "block": piece.block, "ball": piece.ball, "cone": piece.cone}
        inputs = {name: np.broadcast_to(np.asarray(value, float), (len(points), 4)) for name, value in row.items()}
        inputs["vertex"] = np.column_stack([placed, np.ones(len(points))])
        found = evaluate(self.program, inputs, self.asset)
        return found["virtual"].astype(float), found["status"]

    def project(self, virtual):
        clip = virtual @ self.space.clip_from_map(CAMERA).T
        with np.errstate(all="ignore"):
            return (clip[:, :2] / clip[:, 3:] * 0.5 + 0.5) * (CAMERA.width, CAMERA.height)

    def counted(self, searches):
        """Blocks of nodes hold some that nobody asks for: between those of what is shown and all."""
        slack = tolerances.GRID_SEARCHES_GPU * self.all
        assert self.asked - slack <= searches <= self.all + slack

    def check(self, texture, instance, virtual, status):
        """What a texture holds of points of these instances against NumPy's."""
        got = np.asarray(texture.read(), np.float32).reshape(-1, 4)[: len(instance)][self.others[instance]]
        virtual, status = virtual[self.others[instance]], status[self.others[instance]]
        same = np.abs(got[:, 3] - status) < 0.5
        assert same.mean() >= tolerances.GRID_STATUS_GPU
        some = same & (status < FAILED)
        off = np.linalg.norm(self.project(np.column_stack([got[:, :3], np.ones(len(got))])) - self.project(virtual), axis=1)[some]
        assert some.sum() > 100 and (off < tolerances.GRID_PIXELS_GPU).mean() >= tolerances.GRID_STATUS_GPU


def test_the_device_goes_through_levels_as_numpy_does(device, ball_baked):
    renderer = renderer_of(asking(ball_baked, **WAYS["levels"]))
    found = renderer.virtual_statuses(CAMERA)
    one = OnePiece(renderer, ball_baked)
    tree, values = octree(one.mesh.positions, one.mesh.instance), {}
    virtual, status, _ = follow(tree, one.search, one.project, TOLERANCE, values)
    one.counted(renderer.counts()["searches"])
    assert 0 < one.asked < 0.5 * sum(found.values())
    one.check(one.held.nodes.tables.textures["node_img"], tree.node_instance, values["virtual"], values["status"])
    one.check(one.projector.scene.virtual_img, one.mesh.instance, virtual, status)
    renderer.free()


def test_the_device_interpolates_as_numpy_does(device, ball_baked):
    renderer = renderer_of(asking(ball_baked, **WAYS["share"]))
    renderer.virtual_statuses(CAMERA)
    one = OnePiece(renderer, ball_baked)
    tables = grid(one.mesh.positions, one.mesh.instance, SHARE)
    nodes = one.search(tables.node_position, tables.node_instance)
    virtual, status = interpolated(tables, *nodes)
    given_up = (nodes[1][tables.cell_nodes] == FAILED).all(1)[tables.vertex_cell]
    again = np.flatnonzero((status == FAILED) & ~given_up)
    virtual[again], status[again] = one.search(one.mesh.positions[again], one.mesh.instance[again])
    one.check(one.held.nodes.tables.textures["node_img"], tables.node_instance, *nodes)
    one.check(one.projector.scene.virtual_img, one.mesh.instance, virtual, status)
    one.counted(renderer.counts()["searches"])
    assert renderer.counts()["searches"] < 0.7 * one.others[one.mesh.instance].sum()
    renderer.free()


def checked(renderer, scene):
    """As without a grid, but for outlines."""
    seen = Seen(renderer, scene)
    both = seen.drawn & seen.truth.hit
    assert both.mean() > 0.2 and seen.missed < tolerances.GRID_MISSED and seen.false < tolerances.VIRTUAL_FALSE
    near, far = np.percentile(seen.off[both], [75, 95])
    assert near < tolerances.VIRTUAL_PLACE and far < tolerances.GRID_PLACE
    assert np.isfinite(seen.radiance).all() and np.isfinite(seen.position).all()


def test_a_grid_shows_what_searching_all_vertices_shows(drawn, ball_baked, way):
    checked(drawn, SCENE)
    renderer = renderer_of(ball_baked)
    full, ours = (r.answer(CAMERA) for r in (renderer, drawn))
    renderer.free()
    seen = (full.status == STATUS_HIT) | (ours.status == STATUS_HIT)
    off = np.linalg.norm(full.position - ours.position, axis=-1) / SCENE.diagonal()
    same = (full.status == ours.status) & (off < tolerances.VIRTUAL_PLACE)
    assert (~same[seen]).mean() < tolerances.GRID_DRAWN[way]


def test_a_smaller_reflection_costs_less(device, ball_baked):
    """Levels, from farther and farther away; a share costs the same."""
    renderer, searches = renderer_of(asking(ball_baked, **WAYS["levels"])), []
    for away in (1.0, 2.0, 4.0):
        camera = hand_scenes.camera((3 * away, -0.5 * away, 0.5 + 0.7 * away), (0, 0, 0.5), (240, 180), fov=0.45)
        before = renderer.counts()["searches"]
        renderer.virtual_statuses(camera)
        searches.append(renderer.counts()["searches"] - before)
    renderer.free()
    assert searches[0] > searches[1] > searches[2] > 0 and searches[2] < 0.7 * searches[0]


def test_a_camera_uploads_compiles_and_reads_nothing(drawn):
    drawn.picture(CAMERA)
    before = drawn.counts()
    drawn.picture(hand_scenes.camera((2, 2, 1.0), (0, 0, 0.5), (240, 180)))
    after = drawn.counts()
    assert all(after[name] == before[name] for name in ("uploads", "compiles", "allocations"))
    assert after["readbacks"] - before["readbacks"] <= 1  # the picture itself


def test_only_an_asset_that_asks_makes_tables(device, ball_baked, way):
    sizes = {}
    for name, options in (("none", {}), (way, WAYS[way])):
        renderer = renderer_of(asking(ball_baked, **options))
        renderer.prepare()
        sizes[name] = renderer.bytes(), renderer.counts()["uploads"], len(renderer._answers.projector._grids)
        renderer.free()
    assert sizes["none"][2] == 0 and sizes[way][2] == 1
    assert sizes[way][0] > sizes["none"][0] and sizes[way][1] > sizes["none"][1]


def test_the_next_frame_is_the_same(drawn):
    """Nodes and vertices are searched from where the last frame found them, and found there again."""
    first, second = (drawn.answer(CAMERA) for _ in range(2))
    assert (first.status != second.status).mean() < tolerances.VIRTUAL_FALSE
    same = (first.status == second.status) & (first.status == STATUS_HIT)
    assert np.percentile(np.abs(first.position - second.position)[same], 99.9) < 1e-4


@pytest.mark.parametrize("name", ["Torus", pytest.param("Mirror", marks=pytest.mark.slow)])
def test_what_moves_needs_no_tables(drawn, rng, name):
    drawn.picture(CAMERA)
    about = {"Torus": np.array([1.0, 0.9, 0.5]), "Mirror": np.array([0, 0, 0.5])}[name]
    scene = moved(SCENE, name, rigid(rng, about, np.array([0.1, -0.2, 0.15])))
    before = drawn.counts()
    drawn.scene.update(scene)
    drawn.picture(CAMERA)
    after = drawn.counts()
    assert after["uploads"] - before["uploads"] <= 1 and after["compiles"] == before["compiles"]
    checked(drawn, scene)
