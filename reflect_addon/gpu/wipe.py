"""An A/B wipe's line across a 3D view, with the words for both its sides, and a traced truth right of it."""

import blf
import bpy
from gpu_extras.batch import batch_for_shader

from ..core.camera import Camera
from ..scene.view_truth import ViewTruth
from ..scene.wipe import TRUTH_LABEL
from .renderer import Renderer
from .state import drawing_state

TEXT, GAP, BOTTOM, WIDTH = 13, 8, 24, 2.0  # px at an interface scale of 1: letters, from the line, from below; of the line
LINE, SHADOW = (1.0, 1.0, 1.0, 0.9), (0.0, 0.0, 0.0, 0.7)


class TruthPicture:
    """A truth on the GPU, uploaded when it is first drawn."""

    def __init__(self, truth: ViewTruth):
        self.truth, self._target = truth, None
        self.label = ""  # as the view that was drawn last shows it

    def draw(self, renderer: Renderer, camera: Camera, depth_bias: float, window):
        """After the renderer's draw_overlay of the same camera; nothing where the truth is of another view."""
        self.label = TRUTH_LABEL
        if not self.truth.is_of(camera):
            self.label += " (of another view)"
        else:
            self._target = self._target or renderer.target_of(self.truth.picture)
            renderer.draw_answers(camera, depth_bias, self._target, window)


def windows(width: int, height: int, place: float) -> tuple[tuple[int, int, int, int], ...]:
    """(x, y, width, height) px of the view's left and right side."""
    x = min(max(round(place * width), 0), width)
    return (0, 0, x, height), (x, 0, width - x, height)


def draw_line(region, place: float, labels: tuple[str, str]):
    """In a POST_PIXEL callback. labels: of what is left and right."""
    scale = bpy.context.preferences.system.ui_scale
    x, size = windows(region.width, region.height, place)[1][0], TEXT * scale
    with drawing_state() as gpu:
        gpu.state.blend_set("ALPHA")
        gpu.state.depth_test_set("NONE")
        shader = gpu.shader.from_builtin("UNIFORM_COLOR")
        for half, color in ((WIDTH * scale, SHADOW), (0.5 * WIDTH * scale, LINE)):
            corners = [(x - half, 0), (x + half, 0), (x - half, region.height), (x + half, region.height)]
            shader.uniform_float("color", color)
            batch_for_shader(shader, "TRI_STRIP", {"pos": corners}).draw(shader)
    blf.size(0, size)
    blf.enable(0, blf.SHADOW)
    blf.shadow(0, 5, *SHADOW)
    blf.color(0, *LINE)
    for label, side in zip(labels, (-1, 1), strict=True):
        wide = blf.dimensions(0, label)[0] if side < 0 else 0.0
        blf.position(0, x + side * GAP * scale - wide, BOTTOM * scale, 0)
        blf.draw(0, label)
    blf.disable(0, blf.SHADOW)
