"""The draw function, called as Blender would: state as found, nothing but drawing when only the camera moves."""

from types import SimpleNamespace

import hand_scenes as scenes
import numpy as np
import pytest

from reflect_addon.core.look import Look


@pytest.fixture
def drawn(device):
    """A session on a mirror sphere, an offscreen like the viewport's overlay (depth at infinity), and a draw call."""
    from reflect_addon.gpu import handler, session

    snapshot = scenes.snapshot(("ball", scenes.sphere_mesh(), scenes.placed(), scenes.MIRROR))
    view = session.ViewportSession(lambda: snapshot, lambda last: last or Look(), kernel=scenes.kernels)
    view.set_assets("sky", {"ball": scenes.sky_asset("ball")})
    session.set_session("Scene", view)
    screen = device.types.GPUOffScreen(96, 64, format="RGBA16F")

    def draw(eye=(0, -5, 1), clear_depth=1.0):
        camera = scenes.camera(eye, (0, 0, 0))
        context = SimpleNamespace(
            scene=SimpleNamespace(name="Scene"),
            region=SimpleNamespace(width=96, height=64),
            region_data=SimpleNamespace(
                view_matrix=np.linalg.inv(camera.world_from_camera), window_matrix=camera.clip_from_camera
            ),
        )
        with screen.bind():
            framebuffer = device.state.active_framebuffer_get()
            framebuffer.clear(color=(0, 0, 0, 0), depth=clear_depth)
            handler.draw(context)
            pixels = framebuffer.read_color(0, 0, 96, 64, 4, 0, "FLOAT")
            return np.array(pixels.to_list(), np.float32)

    yield SimpleNamespace(draw=draw, view=view, session=session, handler=handler, gpu=device)
    session.end_all()
    screen.free()


def test_draws_the_overlay_of_the_renderer(drawn):
    assert drawn.draw().max() == 0  # nothing before the first refresh
    assert drawn.view.refresh()
    pixels = drawn.draw()
    camera = scenes.camera((0, -5, 1), (0, 0, 0))
    picture = drawn.view.current_renderer().picture(camera)
    assert np.array_equal(pixels[..., 3] > 0.5, picture[..., 3] > 0.5)
    inside = picture[..., 3] > 0.5
    assert inside.sum() > 500
    # Standard view: clipped scene-linear. Half floats in the reflection buffer and in this offscreen.
    assert np.allclose(pixels[inside][:, :3], np.clip(picture[inside][:, :3], 0, 1), atol=2e-3)


def test_viewport_depth_hides(drawn):
    drawn.view.refresh()
    assert drawn.draw(clear_depth=0.0).max() == 0


def test_camera_move_only_draws(drawn):
    drawn.view.refresh()
    drawn.draw()
    before, walks = drawn.view.current_renderer().counts(), drawn.view.walks
    for eye in ((3, -4, 1), (0, 5, 2), (-2, -2, 3)):
        assert not drawn.view.refresh()
        assert drawn.draw(eye).max() > 0
    after = drawn.view.current_renderer().counts()
    for name in ("uploads", "upload_bytes", "compiles", "allocations", "readbacks"):
        assert after[name] == before[name], name
    assert drawn.view.walks == walks
    assert after["draws"] > before["draws"]


def test_changes_are_taken_up(drawn):
    drawn.view.refresh()
    first = drawn.draw()
    drawn.view.set_assets("sky", {"ball": scenes.sky_asset("ball", ground=(0, 1, 0), zenith=(0, 1, 0))})
    assert drawn.view.refresh()
    second = drawn.draw()
    assert np.abs(second - first).max() > 0.2
    drawn.view.set_assets("", {})
    assert not drawn.view.refresh() and drawn.draw().max() == 0


@pytest.mark.parametrize("fails", [False, True])
def test_state_is_left_as_found(drawn, fails, monkeypatch):
    drawn.view.refresh()
    state = drawn.gpu.state
    if fails:
        from reflect_addon.gpu import scene_on_gpu

        def broken(*_args, **_kwargs):
            raise RuntimeError("broken on purpose")

        monkeypatch.setattr(scene_on_gpu.RayMapPass, "draw_sections", broken)
        monkeypatch.setattr(scene_on_gpu.RayMapPass, "draw", broken)
    screen = drawn.gpu.types.GPUOffScreen(32, 16, format="RGBA16F")
    try:
        with screen.bind():
            state.blend_set("ADDITIVE")
            state.depth_test_set("GREATER")
            state.depth_mask_set(True)
            bound = state.active_framebuffer_get()
            viewport = tuple(state.viewport_get())
            from types import SimpleNamespace as space

            camera = scenes.camera((0, -5, 1), (0, 0, 0))
            drawn.handler.draw(
                space(
                    scene=space(name="Scene"),
                    region=space(width=96, height=64),
                    region_data=space(
                        view_matrix=np.linalg.inv(camera.world_from_camera), window_matrix=camera.clip_from_camera
                    ),
                )
            )
            assert (state.blend_get(), state.depth_test_get(), state.depth_mask_get()) == ("ADDITIVE", "GREATER", True)
            assert state.active_framebuffer_get() == bound and bound.is_bound
            assert tuple(state.viewport_get()) == viewport
    finally:
        state.blend_set("NONE")
        state.depth_test_set("NONE")
        state.depth_mask_set(False)
        screen.free()
    assert bool(drawn.view.message) == fails


def test_a_failure_is_said_once(drawn, monkeypatch, capsys):
    drawn.view.kernel = lambda kind: None
    drawn.view.refresh()
    assert drawn.draw().max() == 0
    assert "Reflections are off" in drawn.view.message
    capsys.readouterr()
    drawn.draw()
    assert capsys.readouterr().err == ""
    drawn.view.kernel = scenes.kernels
    drawn.view.set_assets("sky", {"ball": scenes.sky_asset("ball")})
    drawn.view.refresh()
    assert drawn.draw().max() > 0


def test_register_leaves_nothing_behind(fresh_file):
    from reflect_addon.gpu import handler

    handlers = fresh_file.app.handlers
    lists = (handlers.depsgraph_update_post, handlers.load_post, handlers.undo_post, handlers.redo_post)
    before = [list(x) for x in lists]
    for _ in range(2):
        handler.register()
        assert [len(x) for x in lists] == [len(x) + 1 for x in before]
        handler.unregister()
        assert [list(x) for x in lists] == before and not handler._handles


def test_scene_changes_mark_dirty(fresh_file):
    from reflect_addon.gpu import handler, session

    scene = fresh_file.context.scene
    view = session.ViewportSession(lambda: scenes.snapshot(), lambda last: Look())
    view.set_assets("sky", {})
    session.set_session(scene.name, view)
    handler.register()
    try:
        view.refresh()
        assert not view.dirty
        thing = fresh_file.data.objects.new("thing", None)
        scene.collection.objects.link(thing)
        fresh_file.context.view_layer.update()
        assert view.dirty
        fresh_file.ops.wm.read_factory_settings(use_empty=True)
        assert session.sessions() == ()
    finally:
        handler.unregister()


def test_over_a_real_viewport(device, fresh_file):
    """Solid shading of a sphere behind a box, then our draw: all of the sphere that is seen, nothing of the box."""
    from mathutils import Matrix

    from reflect_addon.core.look import Look
    from reflect_addon.gpu import handler, session

    bpy = fresh_file
    bpy.ops.wm.read_factory_settings(use_empty=False)
    for item in list(bpy.data.objects):
        bpy.data.objects.remove(item)
    scene, layer = bpy.context.scene, bpy.context.view_layer
    for name, mesh, matrix in (
        ("ball", scenes.sphere_mesh(), scenes.placed()),
        ("box", scenes.cube_mesh(), scenes.placed((0.8, -2, 0), 0.4)),
    ):
        made = bpy.data.meshes.new(name)
        made.from_pydata(mesh.positions.tolist(), [], mesh.triangles.tolist())
        thing = bpy.data.objects.new(name, made)
        thing.matrix_world = Matrix(matrix.tolist())
        scene.collection.objects.link(thing)
    layer.update()
    area = next(a for a in bpy.context.screen.areas if a.type == "VIEW_3D")
    space, region = area.spaces.active, next(r for r in area.regions if r.type == "WINDOW")
    space.shading.type, space.overlay.show_overlays = "SOLID", False
    # Ours knows the ball alone: the box hides it by the viewport's depth.
    snapshot = scenes.snapshot(("ball", scenes.sphere_mesh(), scenes.placed(), scenes.MIRROR))
    view = session.ViewportSession(lambda: snapshot, lambda last: Look(), kernel=scenes.kernels)
    view.set_assets("white", {"": scenes.white_asset()})
    session.set_session(scene.name, view)
    view.refresh()
    camera = scenes.camera((0, -5, 1), (0, 0, 0), (128, 96), near=0.1, far=100)
    screen = device.types.GPUOffScreen(128, 96, format="RGBA8")
    view_matrix = np.linalg.inv(camera.world_from_camera)
    try:
        screen.draw_view3d(
            scene, layer, space, region, Matrix(view_matrix.tolist()), Matrix(camera.clip_from_camera.tolist())
        )
        with screen.bind():
            framebuffer = device.state.active_framebuffer_get()
            framebuffer_depth = np.array(framebuffer.read_depth(0, 0, 128, 96).to_list())
            framebuffer.clear(color=(0, 0, 0, 0))
            handler.draw(
                SimpleNamespace(
                    scene=scene,
                    region=SimpleNamespace(width=128, height=96),
                    region_data=SimpleNamespace(view_matrix=view_matrix, window_matrix=camera.clip_from_camera),
                )
            )
            drawn_mask = np.array(framebuffer.read_color(0, 0, 128, 96, 4, 0, "FLOAT").to_list())[..., 3] > 0.5
        rays = view.current_renderer().ray_map(camera)
    finally:
        session.end_all()
        screen.free()
    assert view.message == ""
    ball = rays.covered()
    clip = np.concatenate([rays.origin, np.ones((96, 128, 1))], -1) @ camera.clip_from_world().T
    ours = (clip[..., 2] / np.where(clip[..., 3] == 0, 1, clip[..., 3])) * 0.5 + 0.5
    hidden = ball & (framebuffer_depth < ours - 1e-3)
    assert hidden.sum() > 50 and not drawn_mask[hidden].any()
    seen = ball & ~hidden
    assert seen.sum() > 1000 and drawn_mask[seen].mean() > 0.999
