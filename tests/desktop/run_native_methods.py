"""Runs inside a real Blender window: methods switched live in the materials, a thing whose reflection follows it from frame to frame, and
what is said of assets that are old, missing or damaged; see artist.py and native_room.py.

A glowing crate passes the ball, animated, outside the view. Depth maps and billboards follow it; the light field keeps it where it was.
"""

import shutil
import sys
import time
from pathlib import Path

import bpy
import numpy as np
from desktop import view3d

sys.path[:0] = [str(Path(__file__).parent), str(Path(__file__).parents[1] / "blender")]
from artist import bake, changed, inside, key, part, picture, press, results, run, scene, state  # noqa: E402
from blender_dump import dump  # noqa: E402
from native_room import behind_in, entered, near, settled  # noqa: E402

from sample_blends.scene_parts import box, material  # noqa: E402

METHODS = ("depth_maps", "billboards", "light_field")
FOLLOW = ("depth_maps", "billboards")
CRATE = (0.1, 0.9, 0.1)  # its light, which nothing else has
PLACES = {1: (-1.15, -0.7, 0.1), 11: (1.15, -0.7, 0.1)}  # m, at the first and the last frame: left and right of the ball, outside the view
SEEN = 0.01  # share of the ball's pixels that mirror the crate: 0.0 without
OTHER = 1e-3  # share of pixels that two methods show differently, at least


def add_crate():
    crate = box("Crate", (0.5, 0.5, 0.5), PLACES[1], material("Crate", CRATE, emission=1.0, Base_Color=(0, 0, 0, 1)))
    for frame, place in PLACES.items():
        crate.location = place
        crate.keyframe_insert("location", frame=frame)
    scene().frame_end = max(PLACES)
    scene().frame_set(1)


def crate_in(ball, side):
    """For `settled`: whether the ball mirrors the crate on its left (-1) or right (1)."""
    middle = np.nonzero(ball)[1].mean()

    def looks(seen):
        found = near(seen, [CRATE]) & ball
        share = float(found.mean() / ball.mean())
        where = float(np.nonzero(found)[1].mean() - middle) if found.any() else 0.0
        return share > SEEN and where * side > 0, {"crate": round(share, 3), "from the middle": round(where)}

    return looks


def use(method):
    """The method chosen and used; returns when the button was clicked."""
    scene().reflect.method = method
    yield 1.0
    return (yield from press("reflect.use_in_materials"))


def shown():
    """The method whose group the ball's material shows, "" without one."""
    tree = bpy.data.objects["Ball"].material_slots[0].material.node_tree
    names = [node.node_tree.name.split() for node in tree.nodes if node.type == "GROUP" and node.node_tree]
    return next((words[1] for words in names if words[0] == "Reflect" and words[1] in METHODS), "")


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


def timed(*arguments, **keywords):
    """Use in Materials itself, without the drawing."""
    start = time.monotonic()
    try:
        return MAKE(*arguments, **keywords)
    finally:
        results.setdefault("made", []).append(round(time.monotonic() - start, 1))


def story():
    global MAKE
    ball = yield from entered(add_crate)
    *_, space = view3d()
    untouched = materials()
    operators = part("ops.use_in_materials")
    MAKE, operators.use_in_materials = operators.use_in_materials, timed
    for method in METHODS:
        scene().reflect.method = method
        yield from bake()
    space.shading.type = "RENDERED"
    before = yield from settled("02-before", ball, behind_in(ball, False))

    for method in METHODS:
        clicked = yield from use(method)
        now = yield from settled(f"03-{method}-rendered", ball, behind_in(ball, True), clicked)
        assert shown() == method and changed(before, now) > OTHER, (shown(), changed(before, now))
        space.shading.type = "MATERIAL"
        yield from settled(f"03-{method}-material", ball, behind_in(ball, True))
        space.shading.type = "RENDERED"
        before = now

    for method in FOLLOW:
        clicked = yield from use(method)
        yield from settled(f"04-{method}-first-frame", ball, crate_in(ball, -1), clicked)
        yield from key("shift+Right")
        assert scene().frame_current == max(PLACES)
        yield from settled(f"04-{method}-last-frame", ball, crate_in(ball, 1))
        if method == FOLLOW[-1]:
            break
        yield from key("shift+Left")
    yield from refused("05-old", "light_field", "Ball was baked from another state of the scene")
    yield from key("shift+Left")
    yield from settled("05-first-frame-again", ball, crate_in(ball, -1))

    kept = next(state().folder.glob("billboards-*"))
    damaged = next(path for path in kept.iterdir() if path.suffix != ".json")
    damaged.write_bytes(damaged.read_bytes()[:100])
    yield from refused("06-damaged", "billboards", "")
    shutil.rmtree(kept)
    yield from refused("07-missing", "billboards", "")
    assert shown() == FOLLOW[-1]
    yield from press("reflect.remove_from_materials")
    assert materials() == untouched, "Remove leaves a trace"


run(story)
