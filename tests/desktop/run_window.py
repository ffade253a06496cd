"""Runs inside a real Blender window (started by blender-desktop): an artist's session with the installed zip.

Arguments after "--": ZIP SAMPLE.blend OUT_FOLDER WORKER. Writes pictures and result.json into OUT_FOLDER; every check that
fails raises, which ends Blender with status 1.
"""

import importlib
import json
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

import bpy
import desktop
import numpy as np

ZIP, SAMPLE, OUT, WORKER = map(Path, sys.argv[sys.argv.index("--") + 1 :][:4])
MODULE = "bl_ext.user_default.reflect"
RESOLUTION, SAMPLES = 128, 8  # of the bakes: small, since OpenGL and Cycles share a processor here
RESPONSIVE = 2.0  # s: longest time in which the window may answer nothing during a bake, on software OpenGL
results: dict = {"steps": [], "seconds": {}}


def part(name):
    """A module of the installed add-on."""
    return importlib.import_module(f"{MODULE}.reflect_addon.{name}")


def scene():
    return bpy.context.window_manager.windows[0].scene


def state():
    return part("scene.live").of(scene())


def inside(call, *arguments, **keywords):
    """Calls an operator as if the mouse were in the 3D viewport."""
    window, area, region, _space = desktop.view3d()
    with bpy.context.temp_override(window=window, area=area, region=region, screen=window.screen):
        return call(*arguments, **keywords)


def picture(name):
    """Saves the screen; returns the viewport's part of it that the sidebar leaves free, (H, W, 3) uint8."""
    path = OUT / f"{name}.png"
    desktop.snap(str(path))
    window, area, region, _space = desktop.view3d()
    raw = subprocess.run(["convert", str(path), "-depth", "8", "rgb:-"], capture_output=True, check=True).stdout
    pixels = np.frombuffer(raw, np.uint8).reshape(window.height, window.width, 3)
    sidebar = next(r for r in area.regions if r.type == "UI")
    top = window.height - (region.y + region.height)
    results["steps"].append(name)
    return pixels[top + 90 : top + region.height - 10, region.x + 60 : sidebar.x - 10].astype(int)


def changed(a, b):
    """Share of pixels that differ by more than 2 %."""
    return float((np.abs(a - b).max(-1) > 5).mean())


def bake():
    """Presses Bake and waits; the longest gap between two turns of the window's loop goes into the results."""
    state().bake_error = ""
    assert inside(bpy.ops.reflect.bake, "INVOKE_DEFAULT") == {"RUNNING_MODAL"}
    start = last = time.monotonic()
    gap = 0.0
    while part("ops.bake").running() is not None:
        yield 0.05
        now = time.monotonic()
        gap, last = max(gap, now - last), now
        if now - start > 150:
            raise TimeoutError(f"the bake still runs: {part('ops.bake').running().state}")
    assert not state().bake_error, state().bake_error
    results["seconds"][f"bake {scene().reflect.method}"] = round(time.monotonic() - start, 2)
    results["longest_gap"] = round(max(gap, results.get("longest_gap", 0.0)), 2)
    yield 1.0


def install():
    bpy.context.preferences.system.viewport_aa = "OFF"  # Workbench smooths edges over many redraws; pictures are compared
    assert bpy.ops.extensions.package_install_files(
        filepath=str(ZIP), repo="user_default", enable_on_install=True
    ) == {"FINISHED"}
    bpy.context.preferences.addons[MODULE].preferences.worker = str(WORKER)
    copy = OUT / "work" / SAMPLE.name
    copy.parent.mkdir(parents=True)
    shutil.copy(SAMPLE, copy)
    bpy.ops.wm.open_mainfile(filepath=str(copy), load_ui=False)


def arrange():
    """A large viewport through the scene's camera with the sidebar at the tab."""
    _window, area, region, space = desktop.view3d()
    space.show_region_ui = True
    space.shading.type = "SOLID"
    space.overlay.show_floor = space.overlay.show_axis_x = space.overlay.show_axis_y = False
    space.overlay.show_extras = space.overlay.show_relationship_lines = False
    space.region_3d.view_perspective = "CAMERA"
    bpy.ops.object.select_all(action="DESELECT") if inside(bpy.ops.object.select_all.poll) else None
    yield 1.0
    next(r for r in area.regions if r.type == "UI").active_panel_category = "Reflect"
    inside(bpy.ops.view3d.view_center_camera)
    space.region_3d.view_camera_zoom = 20
    yield 1.0


def story():
    install()
    yield 2.0
    yield from arrange()
    methods = [m.NAME for m in part("core.methods").all_methods()]
    scene().reflect.resolution, scene().reflect.samples = RESOLUTION, SAMPLES
    off = picture("01-opened")

    # Each method: choose, bake, look.
    shown = {}
    for name in methods:
        scene().reflect.method = name
        yield from bake()
        yield 2.0
        assert not state().draw_error(), state().draw_error()
        assert state().assets and not state().stale and not state().missing, (state().stale, state().missing)
        shown[name] = picture(f"02-{name}")
        results[f"changed {name}"] = changed(off, shown[name])
        assert results[f"changed {name}"] > 0.005, f"{name} is not to be seen"
    for name in methods[1:]:
        results[f"{name} against {methods[0]}"] = changed(shown[methods[0]], shown[name])
    if "box_proxy" in methods:
        scene().reflect.method = "box_proxy"
        yield 2.0
        assert changed(shown["box_proxy"], picture("03-switched-back")) < 0.002, "switching back shows something else"

    # The camera moves: another picture, and nothing is uploaded or compiled for it.
    yield from move_camera()

    # A reflector moves: its assets are stale, its picture follows; undo and redo.
    reflector = bpy.data.objects[state().snapshot.reflectors()[0].object_name]
    before = picture("05-before-move")
    inside(bpy.ops.ed.undo_push, message="before")
    reflector.location.x += 0.15 * max(reflector.dimensions)
    inside(bpy.ops.ed.undo_push, message="move")
    yield 2.0
    after = picture("06-reflector-moved")
    assert changed(before, after) > 0.005 and reflector.name in state().stale, state().stale
    inside(bpy.ops.ed.undo)
    yield 2.0
    results["undo differs"] = changed(before, picture("07-undone"))
    assert results["undo differs"] < 0.002 and not state().stale, state().stale
    inside(bpy.ops.ed.redo)
    yield 2.0
    results["redo differs"] = changed(after, picture("08-redone"))
    assert results["redo differs"] < 0.002
    inside(bpy.ops.ed.undo)
    yield 2.0

    # The add-on off and on again, the file opened again.
    bpy.ops.preferences.addon_disable(module=MODULE)
    yield 2.0
    without = picture("09-switched-off")
    assert changed(before, without) > 0.005 and not hasattr(bpy.types.Scene, "reflect")
    bpy.ops.preferences.addon_enable(module=MODULE)
    bpy.context.preferences.addons[MODULE].preferences.worker = str(WORKER)  # Blender forgets what it switches off
    yield 3.0
    results["on again differs"] = changed(before, picture("10-switched-on"))
    assert results["on again differs"] < 0.002
    bpy.ops.wm.save_mainfile()
    bpy.ops.wm.open_mainfile(filepath=bpy.data.filepath, load_ui=False)
    yield 3.0
    yield from arrange()
    yield 1.0
    picture("11-opened-again")
    assert state().assets and not state().draw_error() and not state().problems

    yield from escape()

    # EEVEE beside it, once: software OpenGL needs many seconds for a frame.
    _window, _area, _region, space = desktop.view3d()
    space.shading.type = "MATERIAL"
    space.shading.use_scene_world = space.shading.use_scene_lights = True
    yield 10.0
    scene().reflect.method = "OFF"
    yield 10.0
    eevee = picture("12-eevee-off")
    scene().reflect.method = methods[-1]
    yield 12.0
    results["changed in EEVEE"] = changed(eevee, picture("13-eevee-on"))
    assert results["changed in EEVEE"] > 0.005


def move_camera():
    _window, area, _region, space = desktop.view3d()
    drawn = part("gpu.session").session(scene().name)
    counts = drawn.current_renderer().counts() | {"walks": drawn.walks}
    view = space.region_3d
    before = picture("04-view-a")
    eye = scene().camera.matrix_world
    view.view_perspective, space.lens = "PERSP", scene().camera.data.lens
    view.view_matrix = eye.inverted()
    for _ in range(4):
        view.view_location += eye.to_3x3().col[0] * 0.12  # m to the right
        area.tag_redraw()
        yield 0.5
    yield 1.0
    assert changed(before, picture("04-view-b")) > 0.02
    now = drawn.current_renderer().counts() | {"walks": drawn.walks}
    results["counts"] = {"before": counts, "after": now}
    for what in ("uploads", "compiles", "allocations", "walks"):
        assert now[what] == counts[what], f"{what}: {counts[what]} -> {now[what]} though only the camera moved"
    view.view_perspective = "CAMERA"
    yield 1.0


def escape():
    """Esc, as a key press, ends a bake; the assets stay."""
    scene().reflect.samples = 4000
    kept = {p: p.stat().st_mtime_ns for p in Path(bpy.data.filepath).parent.rglob("asset.json")}
    assert inside(bpy.ops.reflect.bake, "INVOKE_DEFAULT") == {"RUNNING_MODAL"}
    yield 4.0
    picture("11-baking")
    _window, area, _region, _space = desktop.view3d()
    subprocess.run(["xdotool", "mousemove", str(area.x + 200), "300", "key", "Escape"], check=True)
    start = time.monotonic()
    while part("ops.bake").running() is not None:
        yield 0.1
        assert time.monotonic() - start < 10, "Esc did not end the bake"
    results["seconds"]["Esc"] = round(time.monotonic() - start, 2)
    assert kept == {p: p.stat().st_mtime_ns for p in Path(bpy.data.filepath).parent.rglob("asset.json")} and kept
    assert not [p for p in Path(os.environ.get("TMPDIR", "/tmp")).glob("reflect-bake-*")], "a temporary copy stayed"
    scene().reflect.samples = SAMPLES


def tell(steps):
    """Runs the story: between two steps Blender's own loop runs."""
    try:
        delay = next(steps)
    except StopIteration:
        if results.get("longest_gap", 0) > RESPONSIVE:
            raise AssertionError(f"the window answered nothing for {results['longest_gap']} s during a bake") from None
        (OUT / "result.json").write_text(json.dumps(results, indent=1))
        desktop.quit(0)
    return delay


def run():
    steps = story()

    def turn():
        try:
            return tell(steps)
        except BaseException:
            import traceback

            traceback.print_exc()
            (OUT / "result.json").write_text(json.dumps(results, indent=1))
            desktop.snap(str(OUT / "failed.png"))
            desktop.quit(1)

    bpy.app.timers.register(turn, first_interval=2.0, persistent=True)  # persistent: the story opens files


run()
