"""A map of errors over a 3D view (core/planning/heat.py): measured while the view rests, drawn over its reflectors.

A draw says what the view shows and, when that has been the same for REST seconds, takes its rays; a timer measures them in slices and asks for another draw
when a round is done. What is measured is dropped as soon as the view, the scene or its assets are others.
"""

from collections.abc import Iterator
from time import monotonic, perf_counter

import numpy as np

from ..core.asset import Asset, asset_of
from ..core.camera import Camera
from ..core.planning.heat import STEP, Heat, heat_of, is_measured
from ..core.planning.heat_colors import color_at, place_of
from ..core.rays import RayMap
from ..core.snapshot import SceneSnapshot
from ..scene.views import jobs_without_light
from .counts import Counts
from .program import program
from .raymap import surface_info
from .renderer import Renderer
from .upload import texture_from

REST = 0.4  # s in which nothing changes, before anything is measured
BUDGET = 0.03  # s that a turn of the window's loop may measure: slices until it is over
PAUSE = 0.02  # s between two turns

PROGRAM = surface_info(
    "reflect_heat",
    "heat.frag.glsl",
    uniforms=(("MAT4", "rel_from_object"), ("VEC4", "surface"), ("FLOAT", "step_px")),
    samplers=(("FLOAT_2D", "heat_tx"),),
    outputs=(("VEC4", "overlay_out"),),
)


class ViewHeat:
    """The map of one 3D view."""

    def __init__(self):
        self._of: tuple = ()  # what the last draw showed
        self._since = 0.0  # monotonic s, when that was new
        self._steps: Iterator[Heat | None] | None = None
        self._texture = None
        self._counts = Counts()
        self.heat: Heat | None = None
        self.settled = False  # nothing more is to be measured
        self.due = False  # the next draw takes the view's rays

    def draw(self, renderer: Renderer, camera: Camera, depth_bias: float, window=None):
        """Inside the view's draw callback, over its picture. window: Renderer.draw_overlay's."""
        shown = (camera.width, camera.height, camera.clip_from_world().tobytes(), renderer.scene.snapshot, tuple(renderer.scene.assets.values()))
        if not _same(shown, self._of):
            self._of, self._since, self._steps, self._texture = shown, monotonic(), None, None
            self.heat, self.settled, self.due = None, False, False
        if self.due:
            self.due, self._steps = False, _measuring(renderer, camera)
        if self.heat is not None:
            if self._texture is None:
                self._texture = texture_from("heat_buf", picture_of(self.heat), self._counts)
            renderer.draw_surfaces(camera, depth_bias, program(PROGRAM, self._counts), self._bind, window)

    def _bind(self, shader):
        shader.image("heat_tx", self._texture)
        shader.set("step_px", STEP)

    def work(self) -> bool:
        """A turn of the timer: measures for BUDGET seconds at most. Whether the view is to be drawn again."""
        if self.settled or self.due:
            return False
        if self._steps is None:
            self.due = monotonic() - self._since >= REST
            return self.due
        start = perf_counter()
        while perf_counter() - start < BUDGET:
            try:
                found = next(self._steps)
            except StopIteration:
                self.settled, self._steps = True, None
                return self.heat is None  # nothing to measure: the panel says so
            if found is not None:
                self.heat, self._texture = found, None
                return True
        return False


def _same(a: tuple, b: tuple) -> bool:
    """By what they are: arrays within them have no truth of their own."""
    return len(a) == len(b) and a[:3] == b[:3] and a[3] is b[3] and len(a[4]) == len(b[4]) and all(x is y for x, y in zip(a[4], b[4], strict=True))


def _measuring(renderer: Renderer, camera: Camera) -> Iterator[Heat | None]:
    """heat_of what a renderer shows from here."""
    snapshot, rays = renderer.scene.snapshot, renderer.coarse_ray_map(camera, STEP)
    return heat_of(rays, _shown(renderer, rays, snapshot), snapshot.reflectors(), jobs_without_light(snapshot))


def _shown(renderer: Renderer, rays: RayMap, snapshot: SceneSnapshot) -> dict[str, Asset]:
    """The assets of the reflectors that are seen, as they have followed what moved."""
    seen = [r for index, r in enumerate(snapshot.reflectors()) if (rays.reflector == index).any()]
    found = {r.name: asset_of(renderer.scene.assets, r) for r in seen}
    shown = {id(a): renderer.scene.asset_shown(a) for a in found.values() if is_measured(a)}
    return {name: shown[id(asset)] for name, asset in found.items() if id(asset) in shown}


def picture_of(heat: Heat) -> np.ndarray:
    """(H, W, 4) float32: sRGB, and the reflector, -1 where nothing was measured."""
    known = np.isfinite(heat.degrees)
    color = color_at(place_of(np.where(known, heat.degrees, 0.0)))
    return np.concatenate([color, np.where(known, heat.reflector, -1)[..., None]], -1).astype(np.float32)
