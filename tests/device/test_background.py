"""The background from an asset: a camera's own rays through the very kernel, in pictures and in the viewport's overlay."""

from dataclasses import replace
from types import SimpleNamespace

import hand_scenes as scenes
import numpy as np
import pytest
import tolerances
import trimesh
from mesh_scenes import job, smooth_mirror, snapshot

from reflect_addon.core import background, light_field
from reflect_addon.core.kernel import record, run_numpy
from reflect_addon.core.look import Look
from reflect_addon.core.methods import light_field as method
from reflect_addon.core.rays import Rays

EYE, OUTSIDE = (0.4, -1.6, 0.6), (0.4, -1.6, 1.4)
CAMERA = scenes.camera(EYE, (0, 0, 0))
SMALL = {**method.DEFAULTS, "views": 4, "view_texels": 16, "samples": 1, "cameras": True}


@pytest.fixture(scope="module")
def room():
    """A mirror ball in a room with a crate, the camera in its cell, baked by Embree."""
    crate = trimesh.creation.box((0.5, 0.5, 0.5)).apply_translation([-1.3, 1.0, -0.7])
    ball = smooth_mirror(trimesh.creation.icosphere(3, 0.5).apply_translation([0.3, -0.2, 0.1]))
    scene = replace(snapshot(ball, Room=trimesh.creation.box((5, 5, 3)), Crate=crate), camera=EYE)
    paint = lambda points, *_: 0.5 + 0.4 * np.sin(3 * points)  # noqa: E731
    return SimpleNamespace(scene=scene, asset=method.bake(job(scene, SMALL, paint=paint)))


@pytest.fixture
def renderer(device, room):
    from reflect_addon.gpu.renderer import Renderer

    return Renderer(room.scene, {"": room.asset})


def test_the_cell_holds_the_camera_and_all_that_it_may_see(room):
    cell = light_field.cell_of(room.asset)
    assert cell.contains(EYE) and cell.contains(room.scene.world_positions(room.scene.instances[0])).all()
    assert cell.slabs == tuple(range(6)) and not cell.contains(OUTSIDE)
    alone = method.plan(job(room.scene, {**SMALL, "cameras": False}))[0]
    assert not alone.contains(EYE) and alone.size() < cell.size()


@pytest.mark.parametrize("lens", [{}, {"fov": 1.6, "size": (33, 70)}, {"ortho": 2.0, "size": (40, 30)}])
def test_a_pixel_is_the_kernel_asked_with_the_cameras_ray(renderer, room, lens):
    camera = scenes.camera(EYE, (0, 0, 0), **lens)
    found, rays = renderer.answer(camera, background=room.asset), camera.primary_rays()
    behind = ~renderer.ray_map(camera).covered()
    assert 0.2 < behind.mean() < 1
    rays = Rays(*(v.reshape(camera.height, camera.width, 3)[behind] for v in (rays.origin, rays.direction)))
    wanted = run_numpy(record(method.trace, room.asset), room.asset, rays)
    off = np.abs(found.radiance[behind] - wanted.radiance) > tolerances.BACKGROUND_RADIANCE
    assert off.mean() < tolerances.BACKGROUND_SHARE
    assert (found.coverage[behind] == 1).all()


def test_reflectors_are_as_without(renderer, room):
    seen = renderer.ray_map(CAMERA).covered()
    alone, over = renderer.picture(CAMERA), renderer.picture(CAMERA, room.asset)
    assert seen.sum() > 300 and np.array_equal(alone[seen], over[seen])
    answer = renderer.answer(CAMERA, False, room.asset)
    assert np.array_equal(over[~seen][:, :3], answer.radiance[~seen]) and (over[..., 3] == 1).all()


def test_which_asset_shows_it_and_why_none_does(room):
    scene, nowhere = room.scene, scenes.camera(OUTSIDE, (0, 0, 0))
    assert background.background_of({"": room.asset}, scene, CAMERA) is room.asset
    assert background.background_of({"": room.asset}, scene, nowhere) is None
    assert background.background_of({}, scene, CAMERA) is None
    partly = replace(room.asset, uniforms={**room.asset.uniforms, "everywhere": 0.0})
    assert background.background_of({"": partly}, scene, CAMERA) is None, "rays that nobody traced"
    both = {"Mirror": replace(room.asset, kind="environment"), "": room.asset}
    assert background.background_of(both, scene, CAMERA) is None, "environments hold no camera"
    assert "no cell" in background.why_none("light_field", nowhere)[0] and "cameras=true" in background.why_none("light_field")[1]
    wide = scenes.camera(EYE, (0, 0, 0), ortho=2.0)
    assert "orthographic" in background.why_none("light_field", wide)[0]
    what, remedy = background.why_none("environment")
    assert "environment has no background" in what and "light_field" in remedy


@pytest.fixture
def window(device, room):
    """A session that draws as the viewport would; draw(eye) -> (64, 96, 4) of an offscreen cleared to grey."""
    from reflect_addon.gpu import handler, session

    view = session.ViewportSession(lambda: room.scene, lambda last: last or Look())
    view.set_assets("light_field", {"": room.asset})
    session.set_session("Scene", view)
    screen = device.types.GPUOffScreen(96, 64, format="RGBA16F")

    def draw(eye=EYE):
        camera = scenes.camera(eye, (0, 0, 0))
        context = SimpleNamespace(
            scene=SimpleNamespace(name="Scene"), region=SimpleNamespace(width=96, height=64),
            region_data=SimpleNamespace(view_matrix=np.linalg.inv(camera.world_from_camera), window_matrix=camera.clip_from_camera),
        )  # fmt: skip
        with screen.bind():
            framebuffer = device.state.active_framebuffer_get()
            framebuffer.clear(color=(0.5, 0.5, 0.5, 0.5), depth=1.0)
            handler.draw(context)
            return np.array(framebuffer.read_color(0, 0, 96, 64, 4, 0, "FLOAT").to_list(), np.float32)

    assert view.refresh()
    yield SimpleNamespace(draw=draw, view=view)
    session.end_all()
    screen.free()


def test_the_viewport_shows_it_while_the_eye_is_in_a_cell(window, room):
    off = window.draw()
    window.view.background = True
    on, renderer = window.draw(), window.view.current_renderer()
    assert not window.view.message
    seen = renderer.ray_map(CAMERA).covered()
    assert np.array_equal(on[seen], off[seen]) and (off[~seen] == 0.5).all()
    picture = renderer.picture(CAMERA, room.asset)
    assert np.allclose(on[~seen], np.clip(picture[~seen], 0, 1), atol=tolerances.BACKGROUND_RADIANCE)
    outside = window.draw(OUTSIDE)
    window.view.background = False
    assert np.array_equal(outside, window.draw(OUTSIDE))


def test_a_camera_that_moves_only_draws(window):
    window.view.background = True
    window.draw()
    renderer = window.view.current_renderer()
    before = renderer.counts()
    for x in (0.1, 0.2, 0.3):
        window.draw((x, -1.5, 0.5))
    after = renderer.counts()
    for name in ("uploads", "compiles", "allocations", "readbacks"):
        assert after[name] == before[name], name


def test_a_companion_has_no_part_in_it(device, room, renderer):
    """Billboards of the reflector answer what is near the reflector; a camera is elsewhere."""
    from reflect_addon.core.methods import billboards

    beside = billboards.bake(job(room.scene, {**billboards.DEFAULTS, "texels": 16}))
    joined = room.asset.joined(beside)
    assert record(method.trace, joined).outputs and joined.images.keys() > room.asset.images.keys()
    alone, found = (renderer.answer(CAMERA, False, asset).radiance for asset in (room.asset, joined))
    behind = ~renderer.ray_map(CAMERA).covered()
    assert np.array_equal(alone[behind], found[behind])
