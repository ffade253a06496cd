"""Runs inside a real Blender window: Use in Materials, Undo and Remove by mouse and keys, in Material Preview and Rendered; see artist.py.

The scene is made here: a metal ball in a room of glowing checkers, the wall behind the eye in colours that nothing else has. Where
they are seen, the ball mirrors the room; EEVEE by itself would show its world, and the studio in Material Preview.
"""

import sys
import time
from pathlib import Path

import bpy
import numpy as np
from desktop import view3d

sys.path[:0] = [str(Path(__file__).parent), str(Path(__file__).parents[2])]
from artist import (  # noqa: E402
    OUT, arrange, bake, changed, encoded, inside, install, key, picture, press, results, run, scene, set_small, state,
)  # fmt: skip

from sample_blends.scene_parts import box, camera, checker, mirror, prepare, set_world, sphere  # noqa: E402

NEAR = 8  # of 255: half floats and a filtered cube map of few texels
ROOM = ((0.8, 0.1, 0.1), (0.5, 0.5, 0.5))  # colours of five walls
BEHIND = ((0.9, 0.8, 0.05), (0.05, 0.7, 0.6))  # and of the wall behind the eye
WORLD = (0.05, 0.05, 0.8)  # outside the room: what EEVEE mirrors by itself
MIRRORED = 0.2  # share of the ball's pixels in the colours of the wall behind: it covers 0.30 (by geometry), borders of squares included; 0.0 without
PATIENCE = 180.0  # s for shaders, which compile on the processor that draws
STILL = 0.002  # share of pixels that change while a view is drawn no more
SAME = 0.05  # of what Use in Materials changes: EEVEE places its samples elsewhere each time, and the studio in the ball is full of edges


def glowing(name, colors):
    """A checker that glows and reflects nothing."""
    made = checker(name, *colors, 0.5)
    tree = made.node_tree
    shader = tree.nodes["Principled BSDF"]
    tree.links.new(shader.inputs["Base Color"].links[0].from_socket, shader.inputs["Emission Color"])
    tree.links.remove(shader.inputs["Base Color"].links[0])
    shader.inputs["Base Color"].default_value, shader.inputs["Emission Strength"].default_value = (0, 0, 0, 1), 1.0
    return made


def build():
    bpy.data.batch_remove([*bpy.data.objects, *bpy.data.materials, *bpy.data.meshes])
    prepare(scene(), "Room")
    set_world(scene(), WORLD)
    room = box("Room", (3, 3, 3), (0, 0, 0), glowing("Walls", ROOM), inside=True)
    room.data.materials.append(glowing("Wall behind", BEHIND))
    next(p for p in room.data.polygons if p.center.y < -1).material_index = 1
    sphere("Ball", 0.6, mirror("Metal", (1, 1, 1)), 48, location=(0.1, 0.2, -0.1))
    camera((0, -1.4, 0), (0, 0, 0), 28.0).data.show_passepartout = False
    scene().view_settings.view_transform = "Standard"
    scene().eevee.taa_samples = 8
    bpy.ops.wm.save_mainfile()


def near(pixels, colors):
    """Which pixels have one of the colours."""
    return np.any([np.abs(pixels - encoded(c)).max(-1) <= NEAR for c in colors], axis=0)


def settled(name, ball, mirrors):
    """Waits until the walls are drawn, two pictures a second apart agree, and the ball mirrors the wall behind the eye, or does not;
    notes how long that took and the window's longest silence. ball: its pixels. Returns the last picture."""
    start = last = time.monotonic()
    gap, before = 0.0, None
    while True:
        for _ in range(20):
            yield 0.05
            now = time.monotonic()
            gap, last = max(gap, now - last), now
        seen = picture(name)
        waits = {k: round(float(near(seen, c)[m].mean()), 3) for k, c, m in (("walls", ROOM, ~ball), ("behind", BEHIND, ball))}
        if before is None:
            (OUT / f"{name}.png").rename(OUT / f"{name}-first.png")
        still = before is not None and changed(before, seen) < STILL
        if still and waits["walls"] > 0.5 and mirrors == (waits["behind"] > MIRRORED):
            break
        assert now - start < PATIENCE, f"{name} does not settle: {waits}"
        before, last = seen, time.monotonic()
    results.setdefault("views", {})[name] = {"seconds": round(time.monotonic() - start, 1), "silence": round(gap, 2), **waits}
    return seen


def both(name, ball, mirrors):
    """The view in Material Preview and in EEVEE, without overlays; then in EEVEE still."""
    *_, space = view3d()
    seen = []
    for kind in ("MATERIAL", "RENDERED"):
        space.shading.type = kind
        seen.append((yield from settled(f"{name}-{kind.lower()}", ball, mirrors)))
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
    install()
    yield 2.0
    build()
    yield from arrange()
    set_small()
    *_, space = view3d()
    scene().render.engine = "BLENDER_EEVEE"
    space.overlay.show_overlays = False
    space.shading.light, space.shading.color_type, space.shading.show_object_outline = "FLAT", "MATERIAL", False
    yield 1.0
    ball = near(picture("01-solid"), [(1, 1, 1)])
    results["ball"] = round(float(ball.mean()), 3)
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
    overlaid = yield from settled("05-with-overlay", ball, True)
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
