"""Runs inside a real Blender window (started by blender-desktop): a light field's focus and background; see artist.py."""

import os
import subprocess
import sys

import bpy
import desktop
from mathutils import Vector

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from artist import arrange, bake, changed, inside, install, part, picture, results, run, scene, set_small, state  # noqa: E402


def counts():
    return part("gpu.session").session(scene().name).current_renderer().counts()


def story():
    install()
    yield 2.0
    yield from arrange()
    set_small()
    chosen = scene().reflect
    chosen.light_field.cameras, chosen.light_field.depth = True, False
    chosen.method = "light_field"
    yield from bake()
    yield 3.0
    assert state().assets and not state().stale and not state().draw_error(), (state().stale, state().draw_error())
    plain = picture("01-baked")

    # The background from the slabs, while the eye is in the cell.
    chosen.background = True
    yield 4.0
    behind = picture("02-background")
    assert not state().draw_error(), state().draw_error()
    results["background changes"] = changed(plain, behind)
    assert results["background changes"] > 0.5

    # The focus is dragged: other pictures, nothing uploaded or compiled.
    before = counts()
    for step in range(1, 9):
        chosen.focus_distance = 0.25 * step
        yield 0.3
    yield 1.0
    near = picture("03-focused")
    results["focus changes"] = changed(behind, near)
    assert results["focus changes"] > 0.05
    for what in ("uploads", "compiles", "allocations"):
        assert counts()[what] == before[what], f"{what} though only the focus was dragged"

    # Focus Here: the mouse clicks the middle of the viewport; undo takes it back.
    inside(bpy.ops.ed.undo_push, message="focused")
    window, _area, region, _space = desktop.view3d()
    assert inside(bpy.ops.reflect.focus_here, "INVOKE_DEFAULT") == {"RUNNING_MODAL"}
    yield 1.0
    picture("04-picking")
    x, y = region.x + 0.42 * region.width, region.y + 0.5 * region.height
    subprocess.run(["xdotool", "mousemove", str(int(x)), str(int(window.height - y)), "click", "1"], check=True)
    yield 2.0
    results["picked"] = chosen.focus_distance
    picture("05-picked")
    assert abs(chosen.focus_distance - 2.0) > 1e-3 and chosen.focus_distance > 0.1, chosen.focus_distance

    # Esc leaves everything as it was.
    inside(bpy.ops.reflect.focus_here, "INVOKE_DEFAULT")
    yield 1.0
    subprocess.run(["xdotool", "key", "Escape"], check=True)
    yield 1.0
    assert scene().reflect.focus_distance == results["picked"]
    inside(bpy.ops.ed.undo)
    yield 2.0
    assert abs(scene().reflect.focus_distance - 2.0) < 1e-3, scene().reflect.focus_distance

    # Out of the cell: the viewport's own shading is there again, and the panel says why.
    view = desktop.view3d()[3].region_3d
    view.view_perspective = "PERSP"
    view.view_matrix = scene().camera.matrix_world.inverted()
    view.view_location += Vector((0.0, -0.05, 0.6))
    yield 4.0
    outside = picture("06-outside")
    view.view_location -= Vector((0.0, -0.05, 0.6))
    yield 4.0
    results["back inside changes"] = changed(outside, picture("07-inside-again"))
    assert results["back inside changes"] > 0.5


run(story)
