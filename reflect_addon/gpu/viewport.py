"""Draws reflections over Blender's 3D viewports. Drawing draws: what changed was read before and is handed over here.

`offer` may be called at any time and touches nothing of the GPU; the next drawing takes what was offered, uploads what
differs, and every drawing after that only draws. POST_VIEW is the place: the viewport's depth is there, and what is drawn
is laid over the developed picture (glsl/overlay.frag.glsl develops it the same way).
"""

import traceback
from collections.abc import Callable
from dataclasses import dataclass

import bpy
import numpy as np

from ..core.asset import Asset
from ..core.camera import Camera
from ..core.errors import ReflectError
from ..core.look import Look
from ..core.snapshot import SceneSnapshot
from .renderer import Renderer

DEPTH_BIAS = 1e-5  # of clip space: EEVEE and overlays write depth up to 3e-4 behind the surface, Workbench 2e-7 before it


@dataclass(frozen=True)
class Offer:
    """All that is drawn of a scene."""

    snapshot: SceneSnapshot
    assets: dict[str, Asset]  # by reflector's object name, joined with what they require
    look: Look
    half_distance: float | None  # m, None = reflections do not fade


class _Drawn:
    """A scene's renderer and what it drew last."""

    def __init__(self):
        self.offer: Offer | None = None  # taken at the next drawing
        self.renderer: Renderer | None = None
        self.broken = False  # the last drawing raised: nothing is drawn until there is another offer


_scenes: dict[int, _Drawn] = {}  # by the scene's session_uid
_handle = None
_report: Callable[[int, str], None] = lambda uid, message: None


def start(report: Callable[[int, str], None]) -> None:
    """Adds the draw handler. report(scene's session_uid, sentence): called when drawing failed ("" when it works again)."""
    global _handle, _report
    _report = report
    _handle = bpy.types.SpaceView3D.draw_handler_add(_draw, (), "WINDOW", "POST_VIEW")


def stop() -> None:
    """Removes the draw handler and lets everything on the GPU go."""
    global _handle
    if _handle is not None:
        bpy.types.SpaceView3D.draw_handler_remove(_handle, "WINDOW")
        _handle = None
    for uid in list(_scenes):
        withdraw(uid)


def offer(uid: int, what: Offer) -> None:
    """What the viewports show of the scene with this session_uid from now on."""
    drawn = _scenes.setdefault(uid, _Drawn())
    drawn.offer, drawn.broken = what, False


def withdraw(uid: int) -> None:
    """Nothing is shown of this scene any more."""
    drawn = _scenes.pop(uid, None)
    if drawn is not None and drawn.renderer is not None:
        drawn.renderer.free()


def counts(uid: int) -> dict[str, int]:
    """Work done for this scene since it was first drawn (gpu/counts.py); {} before."""
    drawn = _scenes.get(uid)
    return drawn.renderer.counts() if drawn and drawn.renderer else {}


def memory(uid: int) -> int:
    """Bytes on the GPU for this scene."""
    drawn = _scenes.get(uid)
    return drawn.renderer.bytes() if drawn and drawn.renderer else 0


def draw(uid: int, camera: Camera) -> None:
    """Draws the scene's reflections into the framebuffer that is bound; what raises is reported, once."""
    drawn = _scenes.get(uid)
    if drawn is None or drawn.broken:
        return
    try:
        _take_offer(drawn, uid)
        drawn.renderer.draw_overlay(camera, DEPTH_BIAS)
    except ReflectError as error:
        drawn.broken = True
        _report(uid, str(error))
    except Exception as error:  # a callback must not raise: Blender would call it again at every redraw
        drawn.broken = True
        traceback.print_exc()
        _report(uid, f"Drawing the reflections failed: {error}. Press Look Again, or choose another method.")


def _take_offer(drawn: _Drawn, uid: int) -> None:
    if drawn.offer is None:
        return
    what, drawn.offer = drawn.offer, None
    if drawn.renderer is not None and drawn.renderer.attenuation == what.half_distance:
        drawn.renderer.update(what.snapshot, what.assets)
        drawn.renderer.set_look(what.look)
    else:
        if drawn.renderer is not None:
            drawn.renderer.free()
        drawn.renderer = Renderer(what.snapshot, what.assets, what.look, what.half_distance)
    _report(uid, "")


def _draw() -> None:
    context = bpy.context
    space, region, view = context.space_data, context.region, context.region_data
    if view is None or context.scene.session_uid not in _scenes:
        return
    if space.shading.type == "WIREFRAME" or (
        space.shading.type in {"MATERIAL", "RENDERED"} and not space.overlay.show_overlays
    ):
        return  # no surfaces, or no depth to draw against (the panel says so)
    camera = Camera(
        np.array(view.view_matrix.inverted(), np.float64),
        np.array(view.window_matrix, np.float64),
        region.width,
        region.height,
    )
    draw(context.scene.session_uid, camera)
