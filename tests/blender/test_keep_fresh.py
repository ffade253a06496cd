"""Old reflections are baked again by themselves: never, when idle, or at once within a budget; what is wrong most first; a change stops it."""

import sys
import tempfile
from dataclasses import replace
from pathlib import Path

import bpy
import pytest
from panel_text import drawn
from stale_scene import bake, build

import reflect_addon
from reflect_addon.core.asset_files import load_asset, save_asset
from reflect_addon.ops import bake as bake_operator
from reflect_addon.ops.keep_fresh import Keeper
from reflect_addon.scene import live
from reflect_addon.scene.places import assets_of
from reflect_addon.scene.worker import Worker


@pytest.fixture
def stage(fresh_file, tmp_path):
    """The scene of test_stale_edits.py, baked with `environment`: Left took 3 s, Right 8 s."""
    reflect_addon.register()
    scene = build()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "stage.blend"))
    scene.reflect.method = "environment"
    bake(assets_of(scene), ["environment"])
    for name, seconds in (("Left", 3.0), ("Right", 8.0)):
        path = assets_of(scene) / f"environment-{name}"
        save_asset(replace(load_asset(path), bake_seconds=seconds), path)
    live.of(scene).reload(scene)
    yield scene
    bake_operator.stop()
    reflect_addon.unregister()


@pytest.fixture
def keeper(stage):
    """One that has looked at the scene, which was read since."""
    made = Keeper()
    assert made.next(stage, 0.0) is None, "the first look asks for a reading"
    live.of(stage).look(stage)
    return made


def move(name, *place):
    """An edit, read as the window's timer does; returns when that was, as the window's clock says."""
    scene = bpy.context.scene
    bpy.data.objects[name].location = place
    bpy.context.view_layer.update()
    live.of(scene).look(scene)
    return live.of(scene).settled


def begun(monkeypatch, keeper, name, now):
    """A bake that next() asked for, by a worker that never ends by itself."""
    worker = Worker([sys.executable, "-c", "import time; time.sleep(60)"], Path(tempfile.mkdtemp()))
    monkeypatch.setattr(bake_operator, "_running", worker)
    keeper.worker, keeper.began = worker, now
    return worker


def test_nothing_is_old_nothing_is_done(stage, keeper):
    assert live.of(stage).stale == ()
    for stage.reflect.refresh in ("NEVER", "IDLE", "LIVE"):
        assert keeper.next(stage, 1e9) is None


def test_a_window_does_not_call_old_what_renders_do_not_show(stage, keeper):
    """It shows the ghost, which no bake sees; what was baked by another process is fresh here all the same."""
    assert "Ghost" in {i.name for i in live.of(stage).snapshot.instances}
    move("Ghost", 0.2, 0.5, 0.5)
    move("Camera", 1, 1, 1)
    assert live.of(stage).stale == () and "changed since the bake" not in drawn()
    bpy.data.objects["Ghost"].hide_render = False
    move("Ghost", 0.2, 0.5, 0.6)
    assert [one.reasons for one in live.of(stage).compared.refreshes.values()] == [("Ghost is new",)] * 2


def test_by_hand_means_by_hand(stage, keeper):
    now = move("Crate", 0.4, 1.0, 0.25)
    assert live.of(stage).stale == ("Left", "Right") and keeper.next(stage, now + 1e6) is None


def test_when_idle_the_worst_is_first_and_each_is_tried_once(stage, keeper):
    stage.reflect.refresh = "IDLE"
    now = move("Crate", 1.2, 0.8, 0.25)  # beside Right
    assert keeper.next(stage, now + 4.9) is None, "somebody may be at work still"
    assert keeper.next(stage, now + 5.1) == "Right" and keeper.next(stage, now + 5.2) == "Left" and keeper.next(stage, now + 99) is None
    now = move("Crate", -1.0, 0.8, 0.25)
    assert keeper.next(stage, now + 5.1) == "Left", "another state of the scene, and the other one is nearer"


def test_at_once_what_fits_the_budget(stage, keeper):
    stage.reflect.refresh, stage.reflect.refresh_seconds = "LIVE", 5.0
    now = move("Crate", 1.2, 0.8, 0.25)
    assert keeper.next(stage, now + 0.6) == "Left", "Right is worse, and takes 8 s"
    assert keeper.next(stage, now + 0.7) is None
    stage.reflect.refresh_seconds = 20.0
    assert keeper.next(stage, now + 0.8) == "Right"


def test_what_is_for_all_is_baked_for_all(stage, keeper, monkeypatch):
    """One asset of two reflectors: a bake for one of them would take it from the other. Its whole time must fit."""
    stage.reflect.refresh, stage.reflect.refresh_seconds = "LIVE", 10.0
    now = move("Crate", 1.2, 0.8, 0.25)
    state = live.of(stage)
    monkeypatch.setitem(state.assets, ("environment", ""), state.asset("environment", "Left"))
    assert keeper.next(stage, now + 1) is None, "11 s"
    stage.reflect.refresh_seconds = 12.0
    assert keeper.next(stage, now + 1) == "" and keeper.next(stage, now + 2) is None


def test_seconds_that_were_spent_are_gone(stage, keeper, monkeypatch):
    stage.reflect.refresh, stage.reflect.refresh_seconds = "LIVE", 9.0
    now = move("Crate", 1.2, 0.8, 0.25)
    assert keeper.next(stage, now + 1) == "Right"
    worker = begun(monkeypatch, keeper, "Right", now + 1)
    assert keeper.next(stage, now + 2) is None and worker.poll().running
    worker.stop()
    monkeypatch.setattr(bake_operator, "_running", None)
    monkeypatch.setattr(worker, "state", replace(worker.state, error=None))
    assert keeper.next(stage, now + 9) is None and keeper.spent == 8.0, "1 s is left, and Left takes 3"


def test_a_change_stops_what_was_begun_and_a_camera_does_not(stage, keeper, monkeypatch):
    stage.reflect.refresh = "IDLE"
    now = move("Crate", 1.2, 0.8, 0.25)
    assert keeper.next(stage, now + 6) == "Right"
    worker = begun(monkeypatch, keeper, "Right", now + 6)
    move("Camera", 3, -4, 2)
    assert keeper.next(stage, now + 7) is None and worker.poll().running
    then = move("Crate", 0.2, 1.2, 0.3)
    assert keeper.next(stage, then + 0.1) is None
    assert worker.stop().running is False and "cancelled" in str(worker.state.error)
    monkeypatch.setattr(bake_operator, "_running", None)
    assert keeper.next(stage, then + 1) is None, "the wait begins again"
    assert keeper.next(stage, then + 6) in ("Left", "Right")


def test_a_bake_that_was_stopped_by_hand_is_not_begun_again(stage, keeper, monkeypatch):
    stage.reflect.refresh = "IDLE"
    now = move("Crate", 1.2, 0.8, 0.25)
    assert keeper.next(stage, now + 6) == "Right"
    begun(monkeypatch, keeper, "Right", now + 6).stop()
    monkeypatch.setattr(bake_operator, "_running", None)
    assert keeper.next(stage, now + 7) is None and keeper.next(stage, now + 1e4) is None
    assert keeper.next(stage, move("Crate", 0, 0.9, 0.25) + 6) is not None


def test_what_no_handler_tells_of_is_noticed(stage, keeper):
    for change in (lambda: setattr(stage.cycles, "diffuse_bounces", 1), lambda: setattr(bpy.data.objects["Crate"], "name", "Box")):
        assert keeper.next(stage, 0.0) is None and not live.of(stage).changed
        change()
        assert keeper.next(stage, 0.0) is None and live.of(stage).changed
        live.of(stage).look(stage)
    assert live.of(stage).stale == ("Left", "Right")


def test_the_sidebar_says_why_and_what_it_takes(stage):
    move("Crate", 1.2, 0.8, 0.25)
    text = drawn()
    assert "The scene changed since the bake of Left, Right" in text
    assert text.index("Right: Crate was moved; about 8 s to bake.") < text.index("Left: Crate was moved; about 3 s to bake.")
    assert " refresh" in text and "refresh_seconds" not in text
    stage.reflect.refresh = "LIVE"
    assert "refresh_seconds" in drawn()


def test_a_real_bake_makes_it_fresh(stage, keeper):
    """By the operator and its worker, with light; the other reflector stays as it is."""
    stage.reflect.refresh, stage.reflect.environment.resolution, stage.reflect.environment.samples = "IDLE", "16", 1
    now = move("Crate", 1.2, 0.8, 0.25)
    name = keeper.next(stage, now + 6)
    keeper.bake(stage, name, now + 6)
    state = live.of(stage)
    assert name == "Right" and state.stale == ("Left",) and not state.bake_error
    assert state.asset("environment", "Right").settings["resolution"] == 16
