"""Runs inside a real Blender window (started by blender-desktop): an artist's session with the installed zip; see artist.py."""

import os
import subprocess
import sys
import time
from pathlib import Path

import bpy
import desktop

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from artist import (  # noqa: E402
    MODULE, SAMPLES, WORKER, arrange, bake, changed, inside, install, of_method, part, picture, results, run, scene,
    set_small, state,
)  # fmt: skip


def story():
    install()
    yield 2.0
    yield from arrange()
    methods = [m.NAME for m in part("core.methods").all_methods()]
    set_small()
    off = picture("01-opened")

    # Each method: choose, bake, look.
    shown = {}
    for name in methods:
        scene().reflect.method = name
        yield from bake()
        yield 2.0
        assert not state().draw_error(), state().draw_error()
        assert state().assets and not state().stale and not state().compared.missing, (state().stale, state().compared.missing)
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
    of_method().samples = 4000
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
    of_method().samples = SAMPLES


run(story)
