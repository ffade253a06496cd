"""The legend of a map of errors: a bar of its colours with degrees beside it, in the lower left corner of a 3D view."""

import blf
import bpy
import numpy as np
from gpu_extras.batch import batch_for_shader

from ..core.planning.heat_colors import MOST, STEPS, TICKS, place_of
from .state import drawing_state

LEFT, BOTTOM, WIDTH, HEIGHT, TEXT = 70, 24, 14, 150, 11  # px at an interface scale of 1: right of the toolbar
BACK = (0.0, 0.0, 0.0, 0.6)
TITLE = "Error of reflections"


def draw_legend():
    """In a POST_PIXEL callback."""
    scale = bpy.context.preferences.system.ui_scale
    left, bottom, width, height, text = (scale * n for n in (LEFT, BOTTOM, WIDTH, HEIGHT, TEXT))
    blf.size(0, text)
    wide, _ = blf.dimensions(0, TITLE)
    with drawing_state() as gpu:
        gpu.state.blend_set("ALPHA")
        gpu.state.depth_test_set("NONE")
        _box(gpu, left - text, bottom - text, left + max(wide, width) + text, bottom + height + 2.5 * text, [BACK] * 2)
        edges = np.linspace(bottom, bottom + height, len(STEPS))
        for low, high, colors in zip(edges, edges[1:], zip(STEPS, STEPS[1:], strict=False), strict=False):
            _box(gpu, left, low, left + width, high, [(*color, 1.0) for color in colors])
    blf.color(0, 1.0, 1.0, 1.0, 1.0)
    for tick in TICKS:
        ends = {TICKS[0]: " or less", MOST: " or sky"}
        _write(left + 1.5 * width, bottom + height * float(place_of(tick)) - 0.35 * text, f"{tick:g}\N{DEGREE SIGN}{ends.get(tick, '')}")
    _write(left, bottom + height + text, TITLE)


def _box(gpu, x0, y0, x1, y1, colors):
    """colors: (r, g, b, a) below and above."""
    shader = gpu.shader.from_builtin("SMOOTH_COLOR")
    low, high = colors
    corners = {"pos": [(x0, y0), (x1, y0), (x0, y1), (x1, y1)], "color": [low, low, high, high]}
    batch_for_shader(shader, "TRI_STRIP", corners).draw(shader)


def _write(x, y, text):
    blf.position(0, x, y, 0)
    blf.draw(0, text)
