"""Runs inside a real Blender window: settings of the panel, stand-ins of things that touch the reflector, things that move
while somebody looks; see artist.py. The sample is contact.blend or one like it: a reflector and a thing close to it.
"""

import os
import sys

import bpy

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from artist import (  # noqa: E402
    arrange, bake, changed, inside, install, part, picture, results, run, scene, set_small, state, watched,
)  # fmt: skip

MOVED = sys.argv[-1]  # name of the object that moves
STEPS = 5  # of the object on its way


def story():
    install()
    yield 2.0
    yield from arrange()
    set_small()
    settings = scene().reflect
    settings.depth_maps.maps = 3
    off = picture("01-opened")
    for name in ("billboards", "depth_maps"):
        yield from watched(f"choose {name}", lambda name=name: setattr(settings, "method", name))
        picture(f"02-{name}-fields")
        yield from bake()
        yield from watched(f"show {name}")
        assert not state().draw_error(), state().draw_error()
        assert state().assets and not (state().stale or state().compared.missing or state().compared.other_settings)
        results[f"changed {name}"] = changed(off, picture(f"03-{name}"))
        assert results[f"changed {name}"] > 0.005, f"{name} is not to be seen"

    # There and back: both are loaded, neither is baked again.
    before = picture("04-before")
    for name in ("billboards", "depth_maps"):
        yield from watched(f"switch to {name}", lambda name=name: setattr(settings, "method", name))
    assert changed(before, picture("04-switched-back")) < 0.002, "switching back shows something else"

    # A setting marks what was baked with another, and nothing else changes; undo takes it back.
    inside(bpy.ops.ed.undo_push, message="before")
    settings.depth_maps.maps = 2
    inside(bpy.ops.ed.undo_push, message="maps")
    yield 1.0
    assert state().compared.other_settings and not state().stale
    assert changed(before, picture("05-other-settings")) < 0.002
    inside(bpy.ops.ed.undo)
    yield 1.0
    assert scene().reflect.depth_maps.maps == 3 and not state().compared.other_settings

    for name in ("depth_maps", "billboards"):
        scene().reflect.method = name
        yield from watched(f"choose {name} again")
        yield from move(name)


def move(name):
    """The object goes up in steps while its reflection follows; then back, to where it was."""
    before = picture(f"06-{name}-before-move")
    moved = bpy.data.objects[MOVED]
    place = moved.location.copy()
    for step in range(STEPS):
        yield from watched(f"{name} step", lambda: setattr(moved, "location", moved.location + moved.dimensions * 0.06))
        last = picture(f"06-{name}-step-{step}")
    renderer = part("gpu.session").session(scene().name).current_renderer()
    results[f"{name} followed"] = str(renderer.scene.followed)
    results[f"{name} moved"] = changed(before, last)
    assert results[f"{name} moved"] > 0.005 and not state().draw_error(), state().draw_error()
    yield from watched(f"{name} back", lambda: setattr(moved, "location", place))
    results[f"{name} back differs"] = changed(before, picture(f"07-{name}-back"))
    assert results[f"{name} back differs"] < 0.02


run(story)
