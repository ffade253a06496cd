"""Runs inside a real Blender window: Use in Materials, Undo and Remove by mouse and keys, in Material Preview and Rendered, in the
room of native_room.py; see artist.py.
"""

import sys
from pathlib import Path

import bpy
import numpy as np
from desktop import view3d

sys.path.insert(0, str(Path(__file__).parent))
from artist import bake, changed, inside, key, picture, press, results, run, scene, state  # noqa: E402
from native_room import behind_in, entered, settled  # noqa: E402

SAME = 0.05  # of what Use in Materials changes: EEVEE places its samples elsewhere each time, and the studio in the ball is full of edges


def both(name, ball, mirrors):
    """The view in Material Preview and in EEVEE, without overlays; then in EEVEE still."""
    *_, space = view3d()
    seen = []
    for kind in ("MATERIAL", "RENDERED"):
        space.shading.type = kind
        seen.append((yield from settled(f"{name}-{kind.lower()}", ball, behind_in(ball, mirrors))))
    return seen


def agree(name, before, now, other):
    """Pictures of both kinds are what they were, beside how far they are from others."""
    found = [[round(float(np.abs(a - b).mean()), 3) for a in (c, d)] for b, c, d in zip(before, now, other)]
    results[f"{name} differs"] = found
    assert all(same < SAME * different for same, different in found), (name, found)


def made():
    """Materials that are not the scene's own."""
    return sorted(m.name for m in bpy.data.materials if m.name not in ("Metal", "Walls", "Wall behind"))


def story():
    ball = yield from entered()
    *_, space = view3d()
    before = yield from both("02-before", ball, False)
    space.shading.type, space.overlay.show_overlays = "SOLID", True
    scene().reflect.method = "box_proxy"
    yield from bake()
    inside(bpy.ops.ed.undo_push, message="baked")
    yield 1.0

    yield from press("reflect.use_in_materials")
    assert len(made()) == 1, made()
    picture("03-used")
    space.overlay.show_overlays = False
    used = yield from both("04-used", ball, True)
    space.overlay.show_overlays = True
    overlaid = yield from settled("05-with-overlay", ball, behind_in(ball, True))
    results["overlay on top differs"] = round(changed(used[1], overlaid), 4)
    space.overlay.show_overlays = False

    yield from key("ctrl+z")
    assert not made(), made()
    agree("undo", before, (yield from both("06-undone", ball, False)), used)
    yield from key("ctrl+shift+z")
    assert len(made()) == 1, made()
    agree("redo", used, (yield from both("07-redone", ball, True)), before)
    yield from press("reflect.remove_from_materials")
    assert not made() and not scene().reflect.native_said, made()
    agree("remove", before, (yield from both("08-removed", ball, False)), used)
    assert not state().draw_error() and not state().stale


run(story)
