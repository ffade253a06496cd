"""Runs inside a real Blender window: methods switched live in the materials of a view that EEVEE draws, Rendered and Material Preview; see
artist.py and native_room.py.
"""

import sys
import time
from pathlib import Path

from desktop import view3d

sys.path.insert(0, str(Path(__file__).parent))
from artist import bake, changed, part, results, run, scene  # noqa: E402
from native_room import METHODS, add_lantern, behind_in, entered, settled, shown, use  # noqa: E402

VIEW_TEXELS = "128"  # of the light field: with artist.py's 64 squares are hardly wider than their borders


def timed(make):
    """Use in Materials itself, without the drawing: its seconds go into the results."""

    def call(*arguments, **keywords):
        start = time.monotonic()
        done = make(*arguments, **keywords)
        results.setdefault("made", []).append(round(time.monotonic() - start, 1))
        return done

    return call


def story():
    ball = yield from entered(add_lantern)
    *_, space = view3d()
    operators = part("ops.use_in_materials")
    operators.use_in_materials = timed(operators.use_in_materials)
    scene().reflect.light_field.view_texels = VIEW_TEXELS
    for method in METHODS:
        scene().reflect.method = method
        yield from bake()
    space.shading.type = "RENDERED"
    before = yield from settled("02-before", ball, behind_in(ball, False))
    for method in METHODS:
        clicked = yield from use(method)
        now = yield from settled(f"03-{method}-rendered", ball, behind_in(ball, True), clicked)
        assert shown() == method, shown()
        results.setdefault("changed", {})[method] = round(changed(before, now), 4)
        space.shading.type = "MATERIAL"
        yield from settled(f"03-{method}-material", ball, behind_in(ball, True))
        space.shading.type = "RENDERED"
        before = now


run(story)
