"""Runs inside a real Blender window: a thing whose reflection follows it from frame to frame in the Rendered view, and what is said of assets
that are old, damaged or missing; see artist.py and native_room.py.
"""

import shutil
import sys
from pathlib import Path

import bpy
from desktop import view3d

sys.path[:0] = [str(Path(__file__).parent), str(Path(__file__).parents[1] / "blender")]
from artist import bake, key, picture, press, results, run, scene, state  # noqa: E402
from blender_dump import dump  # noqa: E402
from native_room import PLACES, add_lantern, entered, lantern_in, settled, shown, use  # noqa: E402

FOLLOW = ("depth_maps", "billboards")


def materials():
    """All that "untouched" is about, to be compared."""
    slots = [(o.name, s.link, s.material and s.material.name) for o in bpy.data.objects for s in o.material_slots]
    return slots, dump(("materials", "node_groups", "actions")), sorted(image.name for image in bpy.data.images)


def said():
    """The last thing that operators reported, as Blender's own Info editor has it."""
    window = bpy.context.window_manager.windows[0]
    area = next(a for a in window.screen.areas if a.type not in ("VIEW_3D", "PROPERTIES", "OUTLINER"))
    kept, area.type = area.type, "INFO"
    with bpy.context.temp_override(window=window, area=area, region=next(r for r in area.regions if r.type == "WINDOW")):
        bpy.ops.info.select_all(action="SELECT")
        bpy.ops.info.report_copy()
        lines = bpy.context.window_manager.clipboard.strip().splitlines()
    area.type = kept
    return [line for line in lines if line and not line.startswith("bpy.")][-1]


def refused(name, method, words):
    """Using the method changes nothing, and a sentence has these words."""
    before = materials()
    yield from use(method)
    picture(name)
    assert materials() == before, f"{name}: materials are not what they were"
    sentence = said()
    results.setdefault("said", {})[name] = sentence
    assert words in sentence, (name, sentence)


def story():
    ball = yield from entered(add_lantern)
    *_, space = view3d()
    untouched = materials()
    for method in FOLLOW:
        scene().reflect.method = method
        yield from bake()
    space.shading.type = "RENDERED"
    for method in FOLLOW:
        clicked = yield from use(method)
        yield from settled(f"02-{method}-first-frame", ball, lantern_in(ball, -1), clicked)
        yield from key("shift+Right")
        assert scene().frame_current == max(PLACES)
        yield from settled(f"02-{method}-last-frame", ball, lantern_in(ball, 1))
        if method == FOLLOW[0]:
            yield from key("shift+Left")
    yield from refused("03-old", FOLLOW[0], "Ball was baked from another state of the scene")
    yield from key("shift+Left")
    yield from settled("04-first-frame-again", ball, lantern_in(ball, -1))

    kept = next(state().folder.glob(f"{FOLLOW[0]}-*"))
    damaged = next(path for path in kept.iterdir() if path.suffix != ".json")
    damaged.write_bytes(damaged.read_bytes()[:100])
    yield from refused("05-damaged", FOLLOW[0], "")
    shutil.rmtree(kept)
    yield from refused("06-missing", FOLLOW[0], "")
    assert shown() == FOLLOW[-1]
    yield from press("reflect.remove_from_materials")
    assert materials() == untouched, "Remove leaves a trace"


run(story)
