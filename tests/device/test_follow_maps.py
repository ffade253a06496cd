"""Depth maps and mirrors that deform or move: the set that is captured again is core/remake.py's, and what is then seen is
what a bake of the changed scene shows."""

from dataclasses import replace
from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest
import tolerances
from mesh_scenes import first_hits, world_mesh
from moving_scenes import MIRRORS, SETTINGS, bake, change, off_from, rays_towards, scene_of_two_mirrors, seen, step

from reflect_addon.core import spaces, srdm, srdm_greedy
from reflect_addon.core.billboard_atlas import ROW
from reflect_addon.core.depth_camera import DepthCamera
from reflect_addon.core.depth_fit import DepthView
from reflect_addon.core.depth_refine import corners_of
from reflect_addon.core.methods import depth_maps
from reflect_addon.core.remake import remake_set

MAPS = {**depth_maps.DEFAULTS, **SETTINGS, "maps": 2, "turns": 20, "points": 16}
SCENE = scene_of_two_mirrors()


def bent(mesh):
    """Longer, and no ellipsoid of what it was."""
    x, y, z = (1.4 * mesh.positions * np.float32([1, 1, 1.2])).T
    return replace(mesh, positions=np.stack([x + 0.4 * z * z, y, z], -1).astype("f"))


def unbent(points):
    """Where the points (N, 3) of a bent mesh were before."""
    x, y, z = points.T
    return np.stack([(x - 0.4 * z * z) / 1.4, y / 1.4, z / 1.68], -1)


CHANGES = {
    "a volume moves": lambda s: change(s, "Torus", step(0.3, 0.1)),
    "a volume deforms": lambda s: change(s, "Rock", mesh=bent),
    "a volume is squeezed": lambda s: change(s, "Torus", squeezed(s, "Torus")),
    "a mirror moves": lambda s: change(s, "Second", step(-0.3, 0.4, 0.1)),
    "a mirror deforms": lambda s: change(s, "Second", mesh=bent),
    "all at once": lambda s: change(change(change(s, "Rock", mesh=bent), "Mirror", step(-0.2, 0.1)), "Crate", step(0.2)),
}


def squeezed(scene, name):
    """(4, 4): flatter about the object's own middle."""
    place = scene.named()[name].world_from_object[:3, 3]
    matrix = np.diag([1.0, 1.0, 0.6, 1.0])
    matrix[:3, 3] = place - matrix[:3, :3] @ place
    return matrix


@pytest.fixture(scope="module")
def baked():
    return bake(SCENE, depth_maps, MAPS)


@pytest.fixture
def renderer(device, baked):
    from reflect_addon.gpu.renderer import Renderer

    made = Renderer(SCENE, baked[0], surfaces=baked[1])
    made.prepare()
    yield made
    made.free()


@pytest.mark.parametrize("what", CHANGES)
def test_what_is_captured_is_what_must_be_made_again(renderer, baked, what):
    """No more and no less, once: the second look at the same scene captures nothing."""
    scene = CHANGES[what](SCENE)
    wanted = [remake_set(asset, scene) for asset in baked[0].values()]
    before = renderer.counts()
    renderer.scene.update(scene)
    found = renderer.scene.followed
    assert renderer.counts()["compiles"] == before["compiles"], "all was compiled when the assets were loaded"
    assert renderer.counts()["captures"] - before["captures"] == found.remade == sum(len(w.remade) for w in wanted)
    assert (found.moved, found.stale) == (sum(len(w.moved) for w in wanted), ())
    assert found.remade == 0 if what == "a volume moves" else found.remade > 0
    renderer.scene.update(scene)
    assert renderer.scene.followed.remade == 0


def views_of(asset):
    """The depth views of an asset's maps, from their rows."""
    views = []
    for part in sorted((p for p in asset.parts if p.kind in {"map", "mirror_map"}), key=lambda p: p.row):
        row = asset.images["billboard_buf"][part.row].astype(float)
        plane, u, v, limits = (row[ROW[name]] for name in ("plane", "u", "v", "limits"))
        eye = np.linalg.solve(np.stack([plane, u, v])[:, :3], -np.array([plane[3], u[3], v[3]])) + asset.uniforms["center"]
        size = np.linalg.norm(u[:3])
        camera = DepthCamera(eye, u[:3] / size, v[:3] / size, plane[:3], 1 / size, *limits[:2])
        own = part.instance == asset.reflector
        views.append(DepthView(part.instance, camera, own=own, detail=MAPS["self_detail"] if own else 1))
    return views


# What each of them alone shows, "all at once" shows by default.
ALONE = ("a volume is squeezed", "a mirror moves")


@pytest.mark.parametrize("what", [pytest.param(w, marks=pytest.mark.slow if w in ALONE else ()) for w in CHANGES])
def test_then_it_is_as_if_baked_anew(renderer, baked, what):
    """Rays near what changed see what they see in a bake of the changed scene with maps from the same places; the old asset
    showed something else."""
    scene = CHANGES[what](SCENE)
    renderer.scene.update(scene)
    followed = {name: renderer.scene.asset_shown(old) for name, old in baked[0].items()}
    # A bake would choose other places for its maps, of which this is no test.
    method = SimpleNamespace(bake=partial(depth_maps.bake, choose=lambda job, volumes: views_of(followed[job.reflector.name])))
    deformed = {"a volume deforms": "Rock", "a mirror deforms": "Second", "all at once": "Rock"}.get(what)
    fresh, _ = bake(scene, method, MAPS, undone=lambda name, points: unbent(points) if name == deformed else points)
    name = {"a volume moves": "Torus", "a volume is squeezed": "Torus"}.get(what, "Second" if "mirror" in what else "Rock")
    worst = 0.0
    for reflector, old in baked[0].items():
        rays = rays_towards(scene, reflector, name if name != reflector else "Torus")
        truth, found, before = (seen(a, rays) for a in (fresh[reflector], followed[reflector], old))
        off, was = off_from(truth, found), off_from(truth, before)
        assert np.mean(found.status != truth.status) < 1e-3
        assert np.median(off) < tolerances.CAPTURE_RADIANCE[0]
        assert np.mean(off > 0.1) < 0.25 * np.mean(was > 0.1) + 0.005
        worst = max(worst, float(np.mean(was > 0.1)))
    assert worst > 0.05, "the change is too small to be seen"


@pytest.mark.parametrize("what", ["a volume deforms", "a volume is squeezed"])
def test_hits_lie_on_the_deformed_surface(renderer, baked, what):
    """Against Embree: rays towards the thing that deformed, where its maps are met."""
    scene = CHANGES[what](SCENE)
    renderer.scene.update(scene)
    name = "Rock" if what == "a volume deforms" else "Torus"
    mesh = world_mesh(scene, scene.named()[name])
    rays = rays_towards(scene, "Mirror", name)
    _, distance = first_hits(mesh, rays.origin, rays.direction)
    truth = rays.origin + rays.direction * np.where(np.isfinite(distance), distance, 0)[:, None]
    found = seen(renderer.scene.asset_shown(baked[0]["Mirror"]), rays)
    near = np.linalg.norm(found.position - mesh.bounds.mean(0), axis=1) < np.linalg.norm(np.ptp(mesh.bounds, axis=0))
    both = np.isfinite(distance) & (found.status == spaces.STATUS_HIT) & near
    assert both.sum() > 500
    off = np.linalg.norm(found.position - truth, axis=1)[both] / scene.diagonal()
    assert np.median(off) < 5e-4 and np.quantile(off, 0.9) < 5e-3


def test_the_tables_are_the_references(renderer, baked):
    """Depths, rows and corners of a re-made map are what NumPy makes of one and the same picture."""
    scene = CHANGES["a volume deforms"](SCENE)
    renderer.scene.update(scene)
    asset = renderer.scene.asset_shown(baked[0]["Mirror"])
    n, m = MAPS["turns"], MAPS["points"]
    rows = [asset.images["billboard_buf"][p.row] for p in asset.parts if p.instance == "Rock"]
    assert rows
    for row in rows:
        w, (x, y, u, v) = int(row[ROW["place"], 2]), row[ROW["table"]].astype(int)
        corners = asset.images["depth_tx"][v : v + w + 1, u : u + w + 1]
        depth = np.where(corners[1:, 1:, 0] < 0, np.nan, corners[1:, 1:, 0]).astype("f")
        np.testing.assert_array_equal(corners_of(depth), corners)  # the four depths around each corner agree
        table = srdm.unpacked(asset.images["srdm_buf"][y : y + w, x : x + n * -(-m // 2)], n, m)
        again = srdm_greedy.simplify(srdm.with_spans(srdm.rotated_rows(depth, n), m), m).reshape(table.shape)
        # The map is kept in half floats, so a few splits fall on a neighbour; poly-lines agree within a half float's step.
        heights, wanted = (srdm.heights(t.reshape(-1, m, 2), w) for t in (table, again))
        assert np.mean(np.isnan(heights) != np.isnan(wanted)) < 1e-3
        assert np.nanquantile(np.abs(heights - wanted), 0.99) < 0.02


def test_without_surfaces_maps_still_move(renderer, baked):
    """What a motion alone asks for needs no capture; what deforms, and mirrors that move, are named."""
    renderer.scene.update(CHANGES["a volume moves"](SCENE), baked[0], None)
    assert (renderer.scene.followed.remade, renderer.scene.followed.stale) == (0, ()) and renderer.scene.followed.moved > 0
    renderer.scene.update(change(CHANGES["a volume deforms"](SCENE), "Second", step(0.1)), baked[0], None)
    assert renderer.scene.followed.remade == 0 and set(renderer.scene.followed.stale) == {"Rock", "Second"}


def test_mirrors_have_normals_again(renderer, baked):
    """Of both mirrors, for each other: normals of unit length where something is seen, towards who looks."""
    renderer.scene.update(change(SCENE, "Second", step(0.2, 0.1)))
    asset = renderer.scene.asset_shown(baked[0]["Mirror"])
    row = next(asset.images["billboard_buf"][p.row] for p in asset.parts if p.instance == MIRRORS[1])
    w, (x, y) = int(row[ROW["place"], 2]), row[ROW["normals"], :2].astype(int)
    block = asset.images["normal_tx"][y : y + w, x : x + w].astype("f")
    length = np.linalg.norm(block[..., :3], axis=-1)
    assert np.mean(np.abs(length - 1) < 0.02) > 0.7 and not block[..., 3].any()
    assert np.median(block[..., :3] @ -row[ROW["plane"], :3]) > 0.3
