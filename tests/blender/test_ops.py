"""Operators and panels as a user meets them, without a window: poll, undo, a bake that works, fails and is cancelled."""

import sys
import tempfile
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import bpy
import numpy as np
import pytest
from blender_scenes import saved_ball
from panel_text import drawn

import reflect_addon
from reflect_addon.core.asset import Asset
from reflect_addon.core.asset_files import save_asset


@pytest.fixture
def registered(fresh_file):
    reflect_addon.register()
    yield fresh_file
    reflect_addon.unregister()


@pytest.fixture
def ball(registered, tmp_path):
    """A saved file with a ball that is marked by hand, selected; the method is environment."""
    saved_ball(tmp_path / "ball.blend")
    bpy.context.scene.reflect.method = "environment"
    return bpy.context.object


def environment(inputs_hash="", reflector="Ball"):
    return Asset("environment", reflector, {"radiance_tx": np.ones((4, 4, 4), np.float16)}, inputs_hash=inputs_hash)


def fake_worker(monkeypatch, script: str, preference=None):
    """The bake operator starts this script instead of a real bake."""
    from reflect_addon.ops import bake
    from reflect_addon.scene.worker import Worker

    seen = []

    def start(*arguments):
        seen.append(arguments)
        return Worker([sys.executable, "-c", "import sys, time, json\n" + script], Path(tempfile.mkdtemp()))

    monkeypatch.setattr(bake, "start_bake", start)
    return seen


def poll_says(operator) -> str:
    """Why the operator cannot run now; "" when it can."""
    if operator.poll():
        return ""
    try:
        operator()
    except RuntimeError as error:
        return str(error)
    raise AssertionError("poll is False, yet the operator ran")


def test_polls_in_an_empty_scene(registered):
    bpy.context.scene.name = "Empty"  # unsaved scenes have their assets by name, all tests of a process in one folder
    assert "Choose a method" in poll_says(bpy.ops.reflect.bake)
    bpy.context.scene.reflect.method = "environment"
    assert "empty" in poll_says(bpy.ops.reflect.bake)
    assert "No bake" in poll_says(bpy.ops.reflect.cancel)
    assert "Select an object" in poll_says(bpy.ops.reflect.mark)
    assert "Nothing was baked" in poll_says(bpy.ops.reflect.open_folder)
    assert "Nothing was baked" in poll_says(bpy.ops.reflect.delete_assets)
    assert bpy.ops.reflect.refresh() == {"FINISHED"}


def test_a_scene_without_reflectors_is_told_so(registered):
    bpy.ops.mesh.primitive_cube_add()
    bpy.context.scene.reflect.method = "environment"
    bpy.ops.reflect.refresh()
    assert "No reflector was found" in poll_says(bpy.ops.reflect.bake)


def test_mark_and_undo(registered):
    bpy.ops.mesh.primitive_cube_add()
    bpy.ops.ed.undo_push(message="cube")
    bpy.ops.reflect.mark("EXEC_DEFAULT", True, mark="YES")
    assert bpy.context.object.reflect_mark == "YES"
    bpy.ops.reflect.refresh()
    assert [r.name for r in live_state().snapshot.reflectors()] == ["Cube"]
    bpy.ops.ed.undo()
    assert bpy.data.objects["Cube"].reflect_mark == "AUTO" and live_state().changed
    bpy.ops.ed.redo()
    assert bpy.data.objects["Cube"].reflect_mark == "YES"


def live_state():
    from reflect_addon.scene import live

    return live.of(bpy.context.scene)


def test_a_bake_loads_what_it_made(ball, monkeypatch, tmp_path):
    from reflect_addon.scene.places import assets_of

    folder = assets_of(bpy.context.scene) / "environment-Ball"
    source = save_asset(environment("old"), tmp_path / "made")
    seen = fake_worker(
        monkeypatch,
        f"import shutil; shutil.copytree({str(source)!r}, {str(folder)!r}); print(json.dumps({{'done': [{str(folder)!r}]}}))",
    )
    assert live_state().compared.missing == ("Ball",)
    assert bpy.ops.reflect.bake() == {"FINISHED"}
    scene, methods, objects, settings, *_ = seen[0]
    assert (scene, methods, objects) == (bpy.context.scene, ["environment"], [])
    assert "resolution" in " ".join(settings)
    state = live_state()
    assert list(state.assets) == [("environment", "Ball")] and state.bytes() == 4 * 4 * 8
    assert (state.compared.missing, state.stale) == ((), ()), "what was just baked is fresh"
    bpy.ops.mesh.primitive_cube_add(location=(3, 0, 0))
    bpy.ops.reflect.refresh()
    assert live_state().stale == ("Ball",)
    assert bpy.ops.reflect.delete_assets() == {"FINISHED"}
    assert not folder.exists() and live_state().compared.missing == ("Ball",)


def test_a_real_bake(registered, tmp_path):
    """The worker is this Python with the command line. Renders see other subdivision than the viewport does."""
    bpy.ops.mesh.primitive_uv_sphere_add(segments=8, ring_count=6)
    modifier = bpy.context.object.modifiers.new("Subdivision", "SUBSURF")
    modifier.levels, modifier.render_levels = 0, 1
    material = bpy.data.materials.new("Mirror")
    bsdf = next(n for n in material.node_tree.nodes if n.type == "BSDF_PRINCIPLED")
    bsdf.inputs["Metallic"].default_value, bsdf.inputs["Roughness"].default_value = 1.0, 0.0
    bpy.context.object.data.materials.append(material)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "real.blend"))
    settings = bpy.context.scene.reflect
    settings.method, settings.environment.resolution, settings.environment.samples = "sphere_proxy", "16", 1
    assert bpy.ops.reflect.bake() == {"FINISHED"}
    state = live_state()
    assert set(state.assets) == {("environment", "Sphere"), ("sphere_proxy", "Sphere")}
    assert (state.stale, state.compared.missing, state.problems) == ((), (), ())
    assert state.assets["environment", "Sphere"].settings["resolution"] == 16
    assert list(state.joined()) == ["Sphere"] and "sphere_radius" in state.joined()["Sphere"].uniforms
    assert not list((tmp_path / "reflect").rglob(".*")), "a lock or a temporary folder stayed"
    bpy.data.objects["Sphere"].location.x = 1
    bpy.ops.reflect.refresh()
    assert live_state().stale == ("Sphere",)


def test_what_decides_only_what_is_drawn_makes_nothing_old(ball, monkeypatch):
    """Another depth, and a culling less: drawn at once, with the images that there are. What is traced asks for a bake."""
    from reflect_addon.scene import live
    from reflect_addon.scene.bake import bake_assets
    from reflect_addon.scene.places import assets_of

    shown, settings, state = [], bpy.context.scene.reflect, live_state()
    monkeypatch.setattr(live, "display", lambda scene, state: shown.append(state.joined()))
    settings.method = "recursive"
    for group in (settings.recursive, settings.layered_distance):
        group.resolution, group.samples = "16", 1
    bake_assets(state.snapshot, ["recursive"], assets_of(bpy.context.scene), settings={**settings.bake_settings(), "surface_samples": 1})
    bpy.ops.reflect.refresh()
    assert (state.compared.missing, state.stale, state.compared.other_settings, state.problems) == ((), (), (), ())
    before = state.joined()["Ball"]
    settings.recursive.depth, settings.recursive.cull_scissor = 5, False
    after = state.joined()["Ball"]
    assert (state.stale, state.compared.other_settings) == ((), ()) and after.images is before.images
    assert (after.settings["depth"], after.settings["cull_scissor"]) == (5, False) and shown[-1]["Ball"] is after
    count = len(shown)
    settings.recursive.samples = 2
    assert state.compared.other_settings == ("Ball",) and len(shown) == count and state.joined()["Ball"] is after
    bpy.ops.reflect.refresh()
    assert state.joined()["Ball"].settings["depth"] == 5


def test_a_fresh_bake_is_not_stale_until_the_scene_changes(ball):
    from reflect_addon.scene.freshness import items_now, remembering
    from reflect_addon.scene.places import assets_of

    snapshot, asset = live_state().snapshot, environment()
    save_asset(remembering(asset, snapshot, items_now(snapshot, asset), {}), assets_of(bpy.context.scene) / "environment-Ball")
    bpy.ops.reflect.refresh()
    assert (live_state().compared.missing, live_state().stale) == ((), ())
    bpy.ops.mesh.primitive_cube_add(location=(3, 0, 0))
    bpy.context.view_layer.update()
    assert live_state().changed
    bpy.ops.reflect.refresh()
    assert live_state().stale == ("Ball",)


def test_another_setting_makes_assets_old(ball):
    """Baked by the command line with its defaults: fresh here. A changed field says so, undo takes it back."""
    from reflect_addon.core.methods import environment as method
    from reflect_addon.scene.freshness import items_now, remembering
    from reflect_addon.scene.places import assets_of

    snapshot, settings = live_state().snapshot, bpy.context.scene.reflect
    asset = replace(environment(), settings=dict(method.DEFAULTS))
    save_asset(remembering(asset, snapshot, items_now(snapshot, asset), {}), assets_of(bpy.context.scene) / "environment-Ball")
    bpy.ops.reflect.refresh()
    assert (live_state().stale, live_state().compared.other_settings) == ((), ())
    bpy.ops.ed.undo_push(message="before")
    settings.environment.samples = 32
    bpy.ops.ed.undo_push(message="samples")
    assert (live_state().stale, live_state().compared.other_settings) == ((), ("Ball",))
    text = drawn()
    assert "Bake Again" in text and "Ball was baked with other settings" in text
    bpy.ops.ed.undo()
    assert bpy.context.scene.reflect.environment.samples == 16 and live_state().compared.other_settings == ()
    bpy.ops.ed.redo()
    assert bpy.context.scene.reflect.environment.samples == 32 and live_state().compared.other_settings == ("Ball",)
    bpy.context.scene.reflect.billboards.texels = "64"
    bpy.context.scene.reflect.environment.samples = 16
    assert live_state().compared.other_settings == (), "another method's settings are not this one's"


def test_bakes_are_asked_for_what_is_set(ball, monkeypatch):
    """The worker gets every setting of the method and of what it requires, as the command line reads them."""
    from reflect_addon import cli_values

    seen = fake_worker(monkeypatch, "print(json.dumps({'done': []}))")
    settings = bpy.context.scene.reflect
    settings.method = "depth_maps"
    settings.depth_maps.maps, settings.depth_maps.half, settings.depth_maps.ground_morph = 2, True, 0.3
    bpy.ops.reflect.bake()
    words = seen[0][3]
    assert words[::2] == ["--set"] * (len(words) // 2)
    given = dict(cli_values.setting(word) for word in words[1::2])
    assert given == settings.bake_settings()
    assert (given["maps"], given["half"], given["ground_morph"], given["optimal"]) == (2, True, 0.3, False)
    settings.method, settings.environment.resolution = "box_proxy", "512"
    assert settings.bake_settings() == {"resolution": 512, "samples": 16, "sky_error": 0.0075}


def test_only_fields_of_the_method_are_drawn(ball):
    settings = bpy.context.scene.reflect
    for method, there, not_there in (
        ("environment", {"resolution", "samples", "sky_error"}, {"texels", "maps", "ground_size"}),
        ("sphere_proxy", {"resolution"}, {"texels"}),
        ("billboards", {"texels", "live", "ground_size", "ground_morph", "ground_height"}, {"maps", "turns"}),
        ("depth_maps", {"maps", "turns", "points", "rows", "optimal", "half", "refine", "texels", "self_reflections"}, {"layers"}),
        ("OFF", set(), {"resolution", "samples"}),
    ):
        settings.method = method
        words = set(drawn().split())
        assert there <= words and not not_there & words, method


def test_a_failing_bake_says_why(ball, monkeypatch):
    fake_worker(monkeypatch, "print(json.dumps({'error': 'Ball is full.', 'remedy': 'Empty it.'})); sys.exit(1)")
    with pytest.raises(RuntimeError, match="Ball is full. Empty it."):
        bpy.ops.reflect.bake()
    assert live_state().bake_error == "Ball is full. Empty it."
    assert bpy.ops.reflect.bake.poll(), "after a failure one can try again"


def test_damaged_assets_are_named(ball):
    from reflect_addon.scene.places import assets_of

    folder = save_asset(environment(), assets_of(bpy.context.scene) / "environment-Ball")
    (folder / "asset.json").write_text("{")
    bpy.ops.reflect.refresh()
    assert "asset.json" in live_state().problems[0] and live_state().compared.missing == ("Ball",)


def test_assets_of_before_their_method_changed_are_named(ball):
    """Whole, and of this scene, but without what the kernel now asks for: a sentence, not an error while drawing."""
    from reflect_addon.scene.places import assets_of

    save_asset(environment(), assets_of(bpy.context.scene) / "environment-Ball")  # an image and no numbers
    bpy.ops.reflect.refresh()
    assert live_state().snapshot.reflectors() and live_state().assets and not live_state().compared.missing
    assert live_state().joined() == {} == live_state().joined()
    (problem,) = live_state().problems
    assert "environment-Ball lacks what environment needs" in problem and "Bake it again" in problem


def test_the_first_save_takes_the_assets_along(registered, monkeypatch, tmp_path):
    from reflect_addon.scene import places

    monkeypatch.setattr(places.bpy.utils, "user_resource", lambda *_a, **_k: str(tmp_path / "user"))
    bpy.ops.mesh.primitive_cube_add()
    bpy.context.object.reflect_mark = "YES"
    unsaved = places.assets_of(bpy.context.scene)
    assert unsaved.is_relative_to(tmp_path / "user")
    save_asset(environment(reflector="Cube"), unsaved / "environment-Cube")
    bpy.context.scene.reflect.method = "environment"
    assert list(live_state().assets) == [("environment", "Cube")]
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "a.blend"))
    assert (tmp_path / "reflect/Scene/environment-Cube/asset.json").exists() and not unsaved.exists()
    assert list(live_state().assets) == [("environment", "Cube")] and not live_state().bake_error
    (tmp_path / "b").mkdir()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "b" / "b.blend"))
    assert live_state().compared.missing == ("Cube",), "a file saved elsewhere has not been baked there"
    assert (tmp_path / "reflect/Scene/environment-Cube/asset.json").exists()


class Events:
    """Enough of a window for the modal operator."""

    def __init__(self):
        self.began, self.ended, self.timers, self.status = 0, 0, 0, []
        self.window_manager = SimpleNamespace(
            event_timer_add=self._add, event_timer_remove=self._remove, modal_handler_add=lambda _: None,
            progress_begin=self._begin, progress_end=self._end, progress_update=lambda _: None,
        )
        self.window, self.workspace = None, SimpleNamespace(status_text_set=self.status.append)
        self.scene, self.selected_objects = bpy.context.scene, []

    def _add(self, *_args, **_keywords):
        self.timers += 1
        return "timer"

    def _remove(self, timer):
        assert timer == "timer"
        self.timers -= 1

    def _begin(self, *_):
        self.began += 1

    def _end(self):
        self.ended += 1


@pytest.mark.parametrize("way", ["Esc", "button", "file load"])
def test_a_modal_bake_is_cancelled(ball, monkeypatch, way):
    """Driven event by event, since no window exists here; tests/desktop does it in one."""
    from reflect_addon.ops import bake

    fake_worker(monkeypatch, "print(json.dumps({'progress': .5, 'message': 'half'}), flush=True); time.sleep(60)")
    events, reports = Events(), []
    operator = SimpleNamespace(selected=False, only="", report=lambda kind, text: reports.append(text))
    for name in ("execute", "_start", "_finish", "_fail", "_enter_window", "_show", "_leave_window"):
        setattr(operator, name, getattr(bake.REFLECT_OT_bake, name).__get__(operator))
    step = lambda kind: bake.REFLECT_OT_bake.modal(operator, events, SimpleNamespace(type=kind, value="PRESS"))
    bake.REFLECT_OT_bake.begin(operator, events)
    assert (events.began, events.timers) == (1, 1) and "running" in poll_says(bpy.ops.reflect.bake)
    while step("TIMER") == {"PASS_THROUGH"} and "half" not in str(events.status[-1:]):
        pass
    assert step("MOUSEMOVE") == {"PASS_THROUGH"}, "the window stays responsive"
    if way == "file load":
        bake.REFLECT_OT_bake.cancel(operator, events)
    else:
        if way == "Esc":
            assert step("ESC") == {"RUNNING_MODAL"}
        else:
            bpy.ops.reflect.cancel()
        while (result := step("TIMER")) == {"PASS_THROUGH"}:
            pass
        assert result == {"CANCELLED"} and "cancelled" in reports[-1]
    assert (events.ended, events.timers, events.status[-1]) == (1, 0, None)
    assert bake.running() is None and bpy.ops.reflect.bake.poll()


def test_switching_the_add_on_off_ends_the_bake(ball, monkeypatch):
    from reflect_addon.ops import bake

    fake_worker(monkeypatch, "time.sleep(60)")
    operator = SimpleNamespace(selected=False, only="", report=lambda *_: None)
    worker = bake.REFLECT_OT_bake._start(operator, bpy.context)
    reflect_addon.unregister()
    assert not worker.state.running and bake.running() is None
    reflect_addon.register()


def test_panels_draw_in_every_state(ball, monkeypatch):
    from reflect_addon.scene import live
    from reflect_addon.scene.places import assets_of
    from reflect_addon.ui.native import REFLECT_PT_native

    text = drawn()
    assert "Ball" in text and "marked by hand" in text and "Not baked yet: Ball" in text
    save_asset(environment("old"), assets_of(bpy.context.scene) / "environment-Ball")
    bpy.ops.reflect.refresh()
    text = drawn()
    assert "Bake Again" in text and "changed since the bake of Ball" in text and "128 B on the GPU" in text
    assert "Overlays are off" in drawn(shading="MATERIAL", overlays=False)
    assert "Overlays are off" not in drawn(shading="SOLID", overlays=False)
    ball.reflect_native.add()
    assert "Overlays are off" not in drawn(shading="MATERIAL", overlays=False), "EEVEE shows the materials"
    assert "materials alone" in drawn(shading="MATERIAL") and "materials alone" not in drawn(shading="SOLID")
    live_state().bake_error = "The worker crashed."
    assert "The worker crashed." in drawn()
    monkeypatch.setattr(live, "take_snapshot", lambda *_: pytest.fail("a panel read the scene"))
    drawn()
    bpy.context.scene.reflect.method = "OFF"
    assert "Not baked" not in drawn()
    assert REFLECT_PT_native.poll(bpy.context), "a file that the command line wrote must offer Remove"
    ball.reflect_native.clear()
    assert not REFLECT_PT_native.poll(bpy.context)
