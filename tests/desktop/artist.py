"""What a session in a real Blender window is made of: the installed add-on, the mouse's place, pictures, bakes, waiting.

For scripts that blender-desktop starts with the arguments ZIP SAMPLE.blend OUT_FOLDER WORKER. A story is a generator that
yields seconds to wait; Blender's own loop runs meanwhile. Pictures and result.json go into OUT_FOLDER; every check that
fails raises, which ends Blender with status 1.
"""

import importlib
import json
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
VIEWS, VIEW_TEXELS = 4, 64  # of light fields
RESPONSIVE = 2.0  # s: longest time in which the window may answer nothing during a bake, on software OpenGL
BUTTONS, STEP = (130, 45), 9  # pixels: from the sidebar's right edge, and down; less than a button's height
ASK_AGAIN = 0.5  # s: a window that draws EEVEE is behind the mouse, and knows the button that was below it a moment ago
PATIENCE = 300.0  # s for one bake: ten times what it takes on two idle cores
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


def encoded(color):
    """sRGB of a scene-linear colour, 0..255."""
    color = np.array(color)
    return 255 * np.where(color < 0.0031308, 12.92 * color, 1.055 * color ** (1 / 2.4) - 0.055)


def key(name):
    """A key press over the 3D viewport."""
    window, area, *_ = desktop.view3d()
    subprocess.run(["xdotool", "mousemove", str(area.x + 200), str(window.height // 2), "key", name], check=True)
    yield 1.0


def press(operator):
    """Looks for an operator's button, or a property's by its path, with the mouse, all over the sidebar, and clicks it; returns when it did
    (time.monotonic)."""
    window, area, *_ = desktop.view3d()
    sidebar = next(r for r in area.regions if r.type == "UI")

    def below_the_mouse():
        bpy.context.window_manager.clipboard = ""
        with bpy.context.temp_override(window=window, area=area, region=sidebar, screen=window.screen):
            for copy in (bpy.ops.ui.copy_python_command_button, bpy.ops.ui.copy_data_path_button):
                if copy.poll() and copy() == {"FINISHED"} and operator in bpy.context.window_manager.clipboard:
                    return True
        return False

    for right in BUTTONS:
        for down in range(STEP, sidebar.height, STEP):
            x, y = sidebar.x + sidebar.width - right, window.height - sidebar.y - sidebar.height + down
            subprocess.run(["xdotool", "mousemove", str(x), str(y)], check=True)
            yield 0.05
            if not below_the_mouse():
                continue
            yield ASK_AGAIN
            if below_the_mouse():
                results.setdefault("pressed", {})[operator] = (x, y)
                clicked = time.monotonic()
                subprocess.run(["xdotool", "click", "1"], check=True)
                yield 1.0
                return clicked
    raise LookupError(f"the mouse found no button of {operator} in the sidebar")


def of_method():
    """The settings of the chosen method, or of the method that it requires."""
    kinds = part("core.methods").with_required([scene().reflect.method])
    return getattr(scene().reflect, kinds[0])


def set_small():
    """Cheap bakes of every method."""
    for name in part("core.methods").names():
        if (group := getattr(scene().reflect, name, None)) and hasattr(group, "samples"):
            group.samples = SAMPLES
            for side in ("resolution", "texels"):
                if hasattr(group, side):
                    setattr(group, side, str(RESOLUTION))
            if hasattr(group, "views"):
                group.views, group.view_texels = VIEWS, str(VIEW_TEXELS)


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
        if now - start > PATIENCE:
            raise TimeoutError(f"the bake still runs: {part('ops.bake').running().state}")
    assert not state().bake_error, state().bake_error
    results["seconds"][f"bake {scene().reflect.method}"] = round(time.monotonic() - start, 2)
    results["longest_gap"] = round(max(gap, results.get("longest_gap", 0.0)), 2)
    yield 1.0


def watched(what, action=None, seconds=2.0):
    """Does something, then looks for a while; the longest gap between two turns of the window's loop is noted as `what`."""
    last = time.monotonic()
    end = last + seconds
    gap = 0.0
    if action is not None:
        action()
    while last < end:
        yield 0.02
        now = time.monotonic()
        gap, last = max(gap, now - last), now
    gaps = results.setdefault("gaps", {})
    gaps[what] = round(max(gap, gaps.get(what, 0.0)), 2)


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


def run(story):
    """Starts a story once the window has drawn."""
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

