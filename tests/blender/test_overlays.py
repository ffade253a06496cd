"""The sidebar's panel "Overlays": what it says of the error in a view, and what a wipe compares."""

import shutil
from types import SimpleNamespace

import bpy
import pytest
from blender_scenes import saved_ball
from panel_text import drawn

import reflect_addon
from reflect_addon.core import methods
from reflect_addon.core.errors import ReflectError
from reflect_addon.core.planning.errors import Measured
from reflect_addon.scene import live
from reflect_addon.scene.wipe import start_wipe
from reflect_addon.ui.settings import baked_items


@pytest.fixture
def registered(fresh_file):
    reflect_addon.register()
    yield bpy.context.scene
    reflect_addon.unregister()


def test_it_says_what_is_measured_and_why_nothing_is(registered):
    assert "Measured when" not in drawn()
    registered.reflect.method = "environment"
    assert "Measured when" not in drawn()
    registered.reflect.shows_error = True
    assert "Measured when the view rests" in drawn()
    view = SimpleNamespace(heat=None, settled=False)
    live.of(registered).heat_of = {1: view}.get
    assert "Measured when the view rests" in drawn()
    view.settled = True
    assert "No reflector is seen" in drawn()
    view.heat, view.settled = SimpleNamespace(mean=0.456, seen=Measured(3.21, 4.0, 0.1, 0.02), share=0.25), False
    text = drawn()
    assert "Mean 0.46\N{DEGREE SIGN}" in text and "95 % within 3.21\N{DEGREE SIGN}" in text and "2.0% show the sky" in text and "25% measured" in text
    view.heat.share = 1.0
    assert "measured" not in drawn()
    for name in methods.names():
        registered.reflect.method = name
        assert ("there is nothing to measure" in drawn()) == (name not in methods.gathering()), name


@pytest.fixture(scope="module")
def baked(tmp_path_factory):
    """The folder of a saved file with a ball, baked by two methods; the scene's own is the last."""
    folder = tmp_path_factory.mktemp("overlays")
    bpy.ops.wm.read_factory_settings(use_empty=True)
    reflect_addon.register()
    saved_ball(folder / "ball.blend")
    settings = bpy.context.scene.reflect
    for name in ("box_proxy", "environment"):
        settings.method, settings.environment.resolution, settings.environment.samples = name, "64", 1
        assert bpy.ops.reflect.bake() == {"FINISHED"}
    bpy.ops.wm.save_mainfile()
    reflect_addon.unregister()
    return folder


@pytest.fixture
def ball(baked, registered, tmp_path):
    """The scene of a copy of it, open."""
    shutil.copytree(baked, tmp_path / "ball")
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "ball" / "ball.blend"))
    return bpy.context.scene


def poll_says() -> str:
    """Why no wipe can start; "" when one can."""
    if bpy.ops.reflect.wipe.poll():
        return ""
    with pytest.raises(RuntimeError) as error:
        bpy.ops.reflect.wipe()
    return str(error.value)


def test_a_wipe_is_against_a_method_that_is_baked(ball):
    state = live.of(ball)
    items = [item[0] for item in baked_items(ball.reflect, None)]
    assert items == ["NONE", "TRUTH", "environment", "box_proxy"] and state.baked == ("environment", "box_proxy")
    assert "Choose another method" in poll_says()
    ball.reflect.against = "environment"
    assert "Choose another method" in poll_says()
    ball.reflect.against = "box_proxy"
    assert not poll_says() and state.wipe is None and not any(kind == "box_proxy" for kind, _ in state.assets)
    found = start_wipe(ball, state.snapshot, state.folder, "box_proxy")
    ball.reflect.method = "box_proxy"
    assert found.assets.keys() == state.joined().keys() == {"Ball"} and found.surfaces is None
    own = state.joined()["Ball"]
    assert all((found.assets["Ball"].images[name] == image).all() for name, image in own.images.items())
    assert found.assets["Ball"].uniforms == own.uniforms and found.assets["Ball"].options == own.options


def test_a_wipe_without_assets_says_what_to_do(ball):
    state = live.of(ball)
    with pytest.raises(ReflectError, match="has no Light Field assets.*Choose that method and bake"):
        start_wipe(ball, state.snapshot, state.folder, "light_field")


def test_off_ends_a_wipe(ball):
    state = live.of(ball)
    state.wipe = start_wipe(ball, state.snapshot, state.folder, "box_proxy")
    ball.reflect.against = "box_proxy"
    assert "Esc" in poll_says()
    ball.reflect.method = "OFF"
    assert state.wipe is None and "Bake the scene's method first" in poll_says()


def test_it_says_why_nothing_is_outlined(ball):
    ball.reflect.shows_outlines = True
    assert "Select a reflector" not in drawn()
    bpy.context.object.name = "Other"
    assert "Select a reflector" in drawn()
    bpy.context.object.name = "Ball"
    drawing = next(name for name in methods.names() if name not in methods.gathering())
    live.of(ball).joined = lambda: {"Ball": SimpleNamespace(kind=drawing)}
    assert "has nothing that stands in space" in drawn()
