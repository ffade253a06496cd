"""Runs inside a real Blender window: File > Export has the entry, an export goes on beside the window and is whole, and Esc leaves nothing; see artist.py."""

import json
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
import bpy  # noqa: E402
import desktop  # noqa: E402
from artist import OUT, PATIENCE, arrange, bake, inside, install, key, part, picture, results, run, scene, set_small  # noqa: E402


def exported(folder, wanted):
    """Starts an export and waits; the longest gap between two turns of the window's loop goes into the results. wanted: by when it is to end by Esc, or None."""
    assert inside(bpy.ops.reflect.export, "EXEC_DEFAULT", directory=str(folder)) == {"RUNNING_MODAL"}
    start = last = time.monotonic()
    gap, pressed = 0.0, False
    while part("ops.export")._running is not None:
        yield 0.05
        now = time.monotonic()
        gap, last = max(gap, now - last), now
        if wanted is not None and not pressed and now - start > wanted:
            yield from key("Escape")
            pressed, last = True, time.monotonic()
        if now - start > PATIENCE:
            raise TimeoutError("the export still runs")
    results["seconds"]["stopped" if pressed else "exported"] = round(time.monotonic() - start, 2)
    results["longest_gap"] = round(max(gap, results.get("longest_gap", 0.0)), 2)
    yield 1.0


def story():
    install()
    yield 2.0
    yield from arrange()
    set_small()
    scene().reflect.method = "environment"
    assert not bpy.ops.reflect.export.poll(), "nothing is baked"
    yield from bake()

    window, *_ = desktop.view3d()
    with bpy.context.temp_override(window=window, screen=window.screen):
        bpy.ops.wm.call_menu(name="TOPBAR_MT_file_export")
    yield 1.0
    picture("01-menu")
    yield from key("Escape")

    out = OUT / "work" / "export"
    before = sorted(out.parent.iterdir())
    yield from exported(out, 1.0)
    picture("02-stopped")
    assert sorted(out.parent.iterdir()) == before, "Esc leaves nothing"
    yield from exported(out, None)
    picture("03-exported")
    manifest = json.loads((out / "reflect.json").read_text())
    results["methods"] = sorted(manifest["reflectors"][0]["methods"])
    assert (out / "scene.gltf").is_file() and results["methods"] == ["environment"]


run(story)
