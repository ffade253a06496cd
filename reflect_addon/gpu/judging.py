"""What is drawn beside and over a 3D view's picture to judge it by: the other side of a wipe, the map of errors, outlines of stand-ins.

What is not asked for costs a look at a flag.
"""

import bpy

from ..core import methods
from ..core.asset import asset_of
from ..core.camera import Camera
from ..scene.wipe import TRUTH
from .heat import PAUSE, ViewHeat
from .heat_legend import draw_legend
from .outlines import OutlineBatch
from .renderer import Renderer, Window
from .session import ViewportSession, sessions
from .wipe import draw_line, windows


def sides_of(found: ViewportSession, camera: Camera) -> tuple[Window | None, Window | None]:
    """What of the view is the scene's own method's, and the other side of a wipe; None: all of it."""
    return windows(camera.width, camera.height, found.wipe.place) if found.wipe else (None, None)


def draw_beside(found: ViewportSession, renderer: Renderer, camera: Camera, depth_bias: float, window: Window | None):
    """What is right of a wipe's line, after the renderer's own overlay of the same camera. Another method fails by itself."""
    if found.truth is not None:
        found.truth.draw(renderer, camera, depth_bias, window)
    if (other := found.other) is None:
        return
    try:
        if (beside := other.current_renderer()) is not None:
            beside.draw_overlay(camera, depth_bias, window=window)
    except Exception as error:  # as in handler.draw
        other.give_up(error)


def draw_over(found: ViewportSession, renderer: Renderer, camera: Camera, depth_bias: float, window: Window | None, context):
    """The map of errors of this 3D view as far as it is known, in `window`, and outlines. context: handler.draw's, with object."""
    if found.shows_error:
        heat = found.heats.setdefault(context.region.as_pointer(), ViewHeat())
        heat.draw(renderer, camera, depth_bias, window)
        if not heat.settled and not bpy.app.timers.is_registered(measure):
            bpy.app.timers.register(measure, first_interval=PAUSE)
    else:
        found.heats.clear()
    if found.shows_outlines:
        _draw_outlines(found, renderer, camera, context.object)
    else:
        found.outlines.clear()


def _draw_outlines(found: ViewportSession, renderer: Renderer, camera: Camera, active):
    reflectors = [r for r in renderer.scene.snapshot.reflectors() if active is not None and r.object_name == active.name]
    for gone in found.outlines.keys() - {r.name for r in reflectors}:
        del found.outlines[gone]
    for reflector in reflectors:
        asset = asset_of(renderer.scene.assets, reflector)
        if asset is not None and hasattr(methods.get(asset.kind), "outlines"):
            found.outlines.setdefault(reflector.name, OutlineBatch()).draw(renderer.scene.asset_placed(asset), camera)


def draw_labels(found: ViewportSession, region):
    """In pixels, over all: what colours mean, and what is on which side."""
    heat = found.heats.get(region.as_pointer()) if found.heats else None
    if heat is not None and heat.heat is not None:
        draw_legend()
    if found.wipe is not None:
        labels = [found.truth.label if name == TRUTH else methods.get(name).LABEL for name in (found.method, found.wipe.method)]
        draw_line(region, found.wipe.place, labels)


def viewports():
    """(area, region) of every 3D view's picture."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                yield from ((area, region) for region in area.regions if region.type == "WINDOW")


def measure() -> float | None:
    """A timer: a turn of measuring in the 3D views that show errors. A view that has to be drawn first starts it again."""
    areas = {region.as_pointer(): area for area, region in viewports()}
    busy = False
    for found in sessions():
        if not found.shows_error or found.message:
            continue
        for gone in found.heats.keys() - areas.keys():
            del found.heats[gone]
        for region, heat in found.heats.items():
            try:
                if heat.work():
                    areas[region].tag_redraw()
            except Exception as error:  # as in handler.draw
                found.give_up(error)
            busy |= not heat.settled and not heat.due
    return PAUSE if busy else None


def stop():
    """Nothing is measured any more."""
    if bpy.app.timers.is_registered(measure):
        bpy.app.timers.unregister(measure)
