"""Objects that move drag their reflection along: what a session re-makes and uploads, counted, and what is then seen."""

from dataclasses import replace

import hand_scenes
import numpy as np
import pytest
import tolerances
from analytic import rotation
from moving_scenes import FLAT, bake, change, off_from, rays_at, rays_towards, scene_of_two_mirrors, seen, step

from reflect_addon.core import methods
from reflect_addon.core.look import Look
from reflect_addon.core.rays import Rays

CAMERA = hand_scenes.camera((-2, -4, 2.5), (0.5, 0, 0.5), (96, 64))


SCENE = scene_of_two_mirrors()


@pytest.fixture(scope="module")
def baked():
    return bake(SCENE)


@pytest.fixture
def shown(device, baked):
    """A session on the scene, drawn once; `shown(scene)` shows another state of it and returns what that cost."""
    from reflect_addon.gpu import session
    from reflect_addon.gpu.state import drawing_state  # noqa: F401  the GPU is there

    assets, surfaces = baked
    now = [SCENE]
    view = session.ViewportSession(lambda: now[0], lambda last: last or Look(), kernel=lambda kind: methods.get(kind).trace)

    def show(scene=None, camera=CAMERA, source=surfaces, assets=assets):
        if scene is not None:
            now[0] = scene
            view.set_assets("billboards", assets, source)
        before = view._renderer.counts() if view._renderer else {}
        view.refresh()
        renderer = view.current_renderer()
        renderer.picture(camera)
        after = renderer.counts()
        return {name: after[name] - before.get(name, 0) for name in after}

    show.view, show.assets = view, assets
    show(SCENE)
    yield show
    view.free()


def test_a_camera_re_makes_nothing(shown):
    for eye in ((3, -4, 2), (0, 5, 2)):
        cost = shown(camera=hand_scenes.camera(eye, (0.5, 0, 0.5), (96, 64)))
        assert (cost["captures"], cost["uploads"], cost["compiles"], cost["readbacks"]) == (0, 0, 0, 1)  # 1: the picture


def test_the_same_scene_again_re_makes_nothing(shown):
    cost = shown(replace(SCENE, frame=9))
    assert (cost["captures"], cost["uploads"], cost["compiles"], cost["allocations"]) == (0, 0, 0, 0)


def test_a_volume_re_makes_one_quad_a_reflector(shown):
    first = shown(change(SCENE, "Torus", step(0.2)))
    assert first["captures"] == 2 and first["uploads"] == 1 + 2  # the torus' surface, and two tables
    second = shown(change(SCENE, "Torus", step(0.3)))
    assert (second["captures"], second["uploads"], second["compiles"], second["allocations"]) == (2, 2, 0, 0)
    assert second["upload_bytes"] == sum(a.images["billboard_buf"].nbytes for a in shown.assets.values())
    assert shown(change(SCENE, "Torus", step(0.3)))["captures"] == 0
    assert shown.view.current_renderer().scene.followed.stale == ()


def test_flat_things_only_move(shown):
    for name in FLAT:
        cost = shown(change(SCENE, name, step(0.1, 0.2)))
        assert (cost["captures"], cost["uploads"]) == (0, 2)
        assert shown(SCENE)["uploads"] == 2  # and back
    for name, asset in shown.assets.items():
        np.testing.assert_array_equal(
            shown.view.current_renderer().scene.asset_shown(asset).images["billboard_buf"], asset.images["billboard_buf"], err_msg=name
        )


def test_a_reflector_re_makes_its_volumes(shown):
    """The two volumes and the other mirror; and itself for the other mirror."""
    cost = shown(change(SCENE, "Mirror", step(-0.2, 0.1)))
    assert cost["captures"] == 3 + 1 and shown.view.current_renderer().scene.followed.stale == ()


def test_what_deforms_is_made_again(shown):
    bent = lambda m: replace(m, positions=m.positions * np.float32([1, 1, 1.3]))  # noqa: E731
    cost = shown(change(SCENE, "Rock", mesh=bent))
    assert cost["captures"] == 2 and shown.view.current_renderer().scene.followed.stale == ()


def test_light_is_no_reason_to_capture(shown):
    """The radiance that could be captured is the old light's: as before, the asset is stale and nothing else."""
    cost = shown(replace(SCENE, light_hash="night"))
    assert (cost["captures"], cost["uploads"]) == (0, 0)


@pytest.mark.parametrize("source", ["none", "another light"])
def test_without_surfaces_what_moves_is_named(shown, baked, source):
    surfaces = None if source == "none" else replace(baked[1], light_hash="night")
    moved = change(change(SCENE, "Torus", step(0.2)), "Floor", step(0.1))
    cost = shown(moved, source=surfaces)
    assert (cost["captures"], cost["uploads"]) == (0, 2) and shown.view.current_renderer().scene.followed.stale == ("Torus",)
    cost = shown(moved, source=baked[1])
    assert cost["captures"] == 2 and shown.view.current_renderer().scene.followed.stale == ()


def test_without_surfaces_volumes_go_along(shown):
    """As they are, turned to the reflector: nearer to a fresh bake than where they were, on this step and on the next, where only the
    reflector moved."""
    first = change(SCENE, "Torus", step(0.4, -0.3))
    for scene in (first, change(first, "Mirror", step(0.0, 0.3)), change(first, "Mirror", step(0.0, 0.3))):
        shown(scene, source=None)
        fresh, rays = bake(scene)[0]["Mirror"], rays_towards(scene, "Mirror", "Torus")
        old = shown.assets["Mirror"]
        wanted, carried, left = (seen(a, rays).radiance for a in (fresh, shown.view.current_renderer().scene.asset_shown(old), old))
        off = [float(np.sqrt(np.mean((a - wanted) ** 2))) for a in (carried, left)]
        assert off[0] < 0.5 * off[1], off
    assert "Torus" in shown.view.current_renderer().scene.followed.stale


def test_assets_without_parts_stay(shown, baked):
    plain = {name: replace(asset, parts=()) for name, asset in baked[0].items()}
    shown(SCENE, assets=plain)
    assert shown(change(SCENE, "Torus", step(0.2)), assets=plain)["captures"] == 0


@pytest.mark.parametrize("row", [-1, 99])
def test_rows_that_are_not_there_are_not_followed(shown, baked, row):
    assets = {n: replace(a, parts=(a.parts[0], replace(a.parts[1], row=row))) for n, a in baked[0].items()}
    shown(SCENE, assets=assets)
    cost = shown(change(SCENE, "Torus", step(0.2)), assets=assets)
    assert (cost["captures"], cost["uploads"]) == (0, 0)


def test_a_thousand_small_steps_add_up_to_none(shown):
    """Rows are moved from where they were captured, not from where they were shown last."""
    renderer, turn = shown.view.current_renderer(), step(1e-3, 5e-4)
    scene = SCENE
    for _ in range(30):
        scene = change(scene, "Crate", turn)
        renderer.scene.update(scene)
    one = np.array(renderer.scene.asset_shown(shown.assets["Mirror"]).images["billboard_buf"])
    renderer.scene.update(SCENE)
    renderer.scene.update(change(SCENE, "Crate", step(30e-3, 15e-3)))
    two = renderer.scene.asset_shown(shown.assets["Mirror"]).images["billboard_buf"]
    np.testing.assert_allclose(one, two, rtol=0, atol=2e-6)


def row_of(asset, name):
    return next(p.row for p in asset.parts if p.instance == name)


MOTIONS = {
    "a volume": [("Torus", 0.45, 0.25, 0.1)],
    "a volume turns": [("Torus", 0.1, 0.0, 0.0, "turn")],
    "a reflector": [("Mirror", -0.3, 0.2, 0.15)],
    "a flat thing": [("Crate", 0.3, 0.4, 0.0)],
    "several": [("Rock", 0.2, 0.5, 0.2, "turn"), ("Floor", 0.0, 0.0, -0.1), ("Second", 0.1, -0.3, 0.1)],
}


@pytest.mark.parametrize("what", MOTIONS)
def test_after_the_move_it_is_as_if_baked_anew(shown, what):
    """Against a bake of the moved scene: close to it, and much closer than the old asset."""
    scene = SCENE
    for name, x, y, z, *turn in MOTIONS[what]:
        matrix = step(x, y, z)
        if turn:
            place = scene.named()[name].world_from_object[:3, 3]
            matrix[:3, :3] = rotation(np.random.default_rng(3))
            matrix[:3, 3] += place - matrix[:3, :3] @ place
        scene = change(scene, name, matrix)
    shown(scene)
    fresh, _ = bake(scene)
    renderer = shown.view.current_renderer()
    captured = 0
    for reflector, old in shown.assets.items():
        now = renderer.scene.asset_shown(old)
        captured += now.source == "capture"
        rays = rays_at(scene, reflector)
        # What the environment shows is not followed: rays that meet a stand-in are compared.
        truth, found, before = (seen(asset, rays) for asset in (fresh[reflector], now, old))
        off = [off_from(truth, answers) for answers in (found, before)]
        assert np.mean(found.status != truth.status) < 0.01
        assert np.median(off[0]) < tolerances.CAPTURE_RADIANCE[0]
        assert np.mean(off[0] > 0.1) < 0.25 * np.mean(off[1] > 0.1) + 0.005
    assert captured == (0 if what == "a flat thing" else 2)


def test_what_is_hidden_is_not_seen(shown):
    hidden = replace(SCENE, instances=tuple(i for i in SCENE.instances if i.name != "Rock"))
    assert shown(hidden)["captures"] == 0
    asset = shown.view.current_renderer().scene.asset_shown(shown.assets["Mirror"])
    rays = rays_at(SCENE, "Mirror")
    at_rock = SCENE.named()["Rock"].world_from_object[:3, 3] - rays.origin
    rays = Rays(rays.origin, (at_rock / np.linalg.norm(at_rock, axis=1, keepdims=True)).astype("f"))
    center, around = SCENE.named()["Rock"].world_from_object[:3, 3], 0.35
    meets = lambda a: np.linalg.norm(seen(a, rays).position - center, axis=1) < around  # noqa: E731
    assert meets(shown.assets["Mirror"]).mean() > 0.4 and not meets(asset).any()
    shown(SCENE)
    again = shown.view.current_renderer().scene.asset_shown(shown.assets["Mirror"])
    np.testing.assert_array_equal(again.images["billboard_buf"], shown.assets["Mirror"].images["billboard_buf"])
    # A mirror that is hidden for a while follows when it is back.
    alone = replace(SCENE, instances=tuple(i for i in SCENE.instances if i.name != "Mirror"))
    shown(change(alone, "Torus", step(0.2)))
    assert shown(change(SCENE, "Torus", step(0.2)))["captures"] == 1


def test_a_window_with_another_subdivision_has_no_deformed_meshes(shown):
    """Bakes see render levels: other triangles at first sight are the same object; its motion is followed all the same."""
    from reflect_addon.gpu.renderer import Renderer

    coarse = replace(SCENE, meshes=tuple(replace(m, triangles=m.triangles[::2], corner_normals=m.corner_normals[::2],
                                                 material_index=m.material_index[::2]) for m in SCENE.meshes))  # fmt: skip
    renderer = Renderer(coarse, shown.assets, kernel=lambda kind: methods.get(kind).trace, surfaces=shown.view.surfaces)
    assert renderer.counts()["captures"] == 0
    renderer.scene.update(change(coarse, "Torus", step(0.2)))
    assert renderer.counts()["captures"] == 2 and renderer.scene.followed.stale == ()
    renderer.free()
