"""Runs inside a real Blender window: virtual objects baked, shown, turned around, and following what moves; see artist.py. The
sample is contact.blend or one like it: a reflector and a thing close to it, which is named last.
"""

import os
import sys

import bpy

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from artist import arrange, bake, changed, install, part, picture, results, run, scene, set_small, state, watched  # noqa: E402

MOVED = sys.argv[-1]  # name of the object that moves


def story():
    install()
    yield 2.0
    yield from arrange()
    set_small()
    settings = scene().reflect
    settings.virtual_objects.map_texels = "64"
    off = picture("01-opened")
    yield from watched("choose", lambda: setattr(settings, "method", "virtual_objects"))
    picture("02-fields")
    yield from bake()
    yield from watched("show")
    assert not state().draw_error(), state().draw_error()
    assert state().assets and not (state().stale or state().compared.missing or state().compared.other_settings)
    shown = picture("03-shown")
    results["changed"] = changed(off, shown)
    assert results["changed"] > 0.005, "virtual objects are not to be seen"

    # What moves needs no bake, and back where it was the picture is what it was.
    moved = bpy.data.objects[MOVED]
    place = moved.location.copy()
    yield from watched("move", lambda: setattr(moved, "location", moved.location + moved.dimensions * 0.2))
    results["moved"] = changed(shown, picture("04-moved"))
    assert results["moved"] > 0.005 and not state().draw_error() and not state().compared.missing
    yield from watched("back", lambda: setattr(moved, "location", place))
    results["back differs"] = changed(shown, picture("05-back"))
    assert results["back differs"] < 0.02

    # A frame of what stands still uploads nothing.
    renderer = part("gpu.session").session(scene().name).current_renderer()
    before = renderer.counts()["uploads"]
    yield from watched("look again", bpy.context.view_layer.update)
    assert renderer.counts()["uploads"] == before


run(story)
