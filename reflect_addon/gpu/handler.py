"""The viewport: a POST_VIEW callback that only draws, a POST_PIXEL one for what Blender draws into our mirrors (viewport_views.py), and the
app handlers that say when the scene changed.

App handlers mark sessions dirty and start a timer; the timer walks the scene (bpy may not be written to, nor the
depsgraph walked, while drawing); the callback uploads what the timer brought, once, and otherwise only draws.
"""

import traceback

import bpy
from bpy.app.handlers import persistent

from ..core import methods
from ..core.asset import asset_of
from ..core.background import background_of
from ..scene.camera import viewport_camera
from ..scene.viewport_source import shading_of, why_not
from ..scene.wipe import TRUTH
from . import session as viewport_session
from .heat import PAUSE, ViewHeat
from .heat_legend import draw_legend
from .outlines import OutlineBatch
from .program import forget_programs
from .viewport_views import ViewportViews, is_drawing
from .wipe import draw_line, windows

# Blender's own depth of the same surface was computed with other roundings: 1e-7 (Solid) to 3e-4 behind (EEVEE).
DEPTH_BIAS = 1e-5
_DELAY = 0.05  # s between a change and the walk: a drag sends a change per frame

_handles: list = []
_background_in: dict[int, bool] = {}  # viewport's address -> whether its background was drawn from assets


def draw(context) -> bool:
    """Draw the scene's reflections into the bound framebuffer. context: anything with scene.name, region (width,
    height) and region_data (view_matrix, window_matrix). The first failure becomes the session's message and ends its
    drawing. True when the background was drawn from the assets, too.
    """
    viewport_session.free_retired()
    found = viewport_session.session(context.scene.name)
    behind = None
    if found is None or not found.method or found.message:
        return False
    try:
        renderer = found.current_renderer()
        if renderer is not None and context.region.width > 0 and context.region.height > 0:
            camera = viewport_camera(context.region, context.region_data)
            behind = background_of(renderer.assets, renderer.snapshot, camera) if found.background else None
            renderer.mirrors.viewport = _views_of(found, context)
            left, right = windows(camera.width, camera.height, found.wipe.place) if found.wipe else (None, None)
            renderer.draw_overlay(camera, DEPTH_BIAS, behind, left)
            _draw_heat(found, renderer, camera, context, left)
            if found.other is not None:
                _draw_other(found.other, camera, right)
            if found.truth is not None:
                found.truth.draw(renderer, camera, DEPTH_BIAS, right)
            _draw_outlines(found, renderer, camera, context)
    except Exception as error:  # whatever it is, a draw callback that raises does so at every redraw
        _give_up(found, error)
    return behind is not None


def _give_up(found, error: Exception):
    found.message = f"Reflections are off: {error} Choose a method again to retry; details are on the console."
    traceback.print_exc()


def _draw_other(other, camera, window):
    """What is right of a wipe's line. It fails by itself."""
    try:
        if (renderer := other.current_renderer()) is not None:
            renderer.draw_overlay(camera, DEPTH_BIAS, window=window)
    except Exception as error:  # as in draw
        _give_up(other, error)


def _draw_heat(found, renderer, camera, context, window):
    """The map of errors of this 3D view, as far as it is known."""
    if not found.shows_error:
        found.heats.clear()
        return
    heat = found.heats.setdefault(context.region.as_pointer(), ViewHeat())
    heat.draw(renderer, camera, DEPTH_BIAS, window)
    if not heat.settled and not bpy.app.timers.is_registered(_measure):
        bpy.app.timers.register(_measure, first_interval=PAUSE)


def _draw_outlines(found, renderer, camera, context):
    """What stands for the scene in the active reflector."""
    active = context.object if found.shows_outlines else None
    reflectors = [r for r in renderer.snapshot.reflectors() if active is not None and r.object_name == active.name]
    for gone in found.outlines.keys() - {r.name for r in reflectors}:
        del found.outlines[gone]
    for reflector in reflectors:
        asset = asset_of(renderer.assets, reflector)
        if asset is not None and hasattr(methods.get(asset.kind), "outlines"):
            batch = found.outlines.setdefault(reflector.name, OutlineBatch())
            batch.draw(renderer.asset_placed(asset), camera)


def _views_of(found, context) -> ViewportViews | None:
    """The pictures of this 3D view that mirrors show, told what they depend on; None where mirrors show surface radiance."""
    if not found.mirrors_viewport:
        found.keep_views(())
        return None
    if why_not(context.space_data, context.region_data, context.scene.render.engine):
        return None
    found.keep_views(region.as_pointer() for _area, region in _viewports())
    views = found.views.setdefault(context.region.as_pointer(), ViewportViews())
    views.state = found.walks, shading_of(context.space_data)
    return views


def _viewports():
    """(area, region) of every 3D view's picture."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                yield from ((area, region) for region in area.regions if region.type == "WINDOW")


def has_surfaces(space) -> bool:
    """Whether this 3D view shows surfaces and has their depth: not wireframe, and EEVEE writes it only with overlays."""
    if space.shading.type == "WIREFRAME":
        return False
    return space.shading.type == "SOLID" or space.overlay.show_overlays


def _on_draw():
    if not is_drawing() and has_surfaces(bpy.context.space_data):
        _tell_panels(bpy.context.area, draw(bpy.context))
        found = viewport_session.session(bpy.context.scene.name)
        if found is not None and found.unsettled:
            refresh_soon()


def _on_drawn():
    """Blender has drawn a 3D view: now it may draw what the view's mirrors show."""
    context = bpy.context
    found = viewport_session.session(context.scene.name)
    if found is not None and not found.message and not is_drawing() and has_surfaces(context.space_data):
        if found.heats:
            draw_legend()
        if found.wipe is not None:
            draw_line(context.region, found.wipe.place, [found.truth.label if name == TRUTH else methods.get(name).LABEL for name in (found.method, found.wipe.method)])
    views = found.views.get(context.region.as_pointer()) if found is not None and not found.message else None
    if views is None or is_drawing():
        return
    try:
        views.draw(context.scene, context.view_layer, context.space_data, context.region)
    except Exception as error:  # as in draw
        _give_up(found, error)


def _tell_panels(area, background: bool):
    """The sidebar says why no background is drawn; it is drawn again when the view's eye enters or leaves a cell."""
    if _background_in.get(area.as_pointer(), False) != background:
        _background_in[area.as_pointer()] = background
        for region in area.regions:
            if region.type == "UI":
                region.tag_redraw()


def _refresh():
    # Not `or`: every session is to be refreshed.
    if any([s.refresh() | s.unsettled for s in viewport_session.sessions()]):
        for area, _region in _viewports():
            area.tag_redraw()


def _measure() -> float | None:
    """A turn of measuring in the 3D views that show errors; a view that has to be drawn first starts it again."""
    shown = [s for s in viewport_session.sessions() if s.shows_error and not s.message]
    open_now = {region.as_pointer(): area for area, region in _viewports()}
    busy = False
    for found in shown:
        for gone in found.heats.keys() - open_now.keys():
            del found.heats[gone]
        for region, heat in found.heats.items():
            try:
                if heat.work():
                    open_now[region].tag_redraw()
            except Exception as error:  # as in draw
                _give_up(found, error)
            busy |= not heat.settled and not heat.due
    return PAUSE if busy else None


def refresh_soon():
    """Walks the scene and draws it, a moment from now: what was set before is on the screen by then."""
    if viewport_session.sessions() and not bpy.app.timers.is_registered(_refresh):
        bpy.app.timers.register(_refresh, first_interval=_DELAY)


@persistent
def on_depsgraph_update(scene, _depsgraph):
    found = viewport_session.session(scene.name)
    if found is not None and found.method:
        found.dirty = True
        refresh_soon()


@persistent
def on_undo_redo(*_):
    for found in viewport_session.sessions():
        found.dirty = True
    refresh_soon()


@persistent
def on_load(*_):
    """Another file: the sessions' scenes are gone. Operators start new ones; the old are freed in the next draw."""
    viewport_session.retire_all()
    _background_in.clear()


_APP_HANDLERS = (
    (bpy.app.handlers.depsgraph_update_post, on_depsgraph_update),
    (bpy.app.handlers.load_post, on_load),
    (bpy.app.handlers.undo_post, on_undo_redo),
    (bpy.app.handlers.redo_post, on_undo_redo),
)


def register():
    if not _handles:
        for callback, when in ((_on_draw, "POST_VIEW"), (_on_drawn, "POST_PIXEL")):
            _handles.append(bpy.types.SpaceView3D.draw_handler_add(callback, (), "WINDOW", when))
    for handlers, function in _APP_HANDLERS:
        if function not in handlers:
            handlers.append(function)


def unregister():
    while _handles:
        bpy.types.SpaceView3D.draw_handler_remove(_handles.pop(), "WINDOW")
    for handlers, function in _APP_HANDLERS:
        if function in handlers:
            handlers.remove(function)
    for timer in (_refresh, _measure):
        if bpy.app.timers.is_registered(timer):
            bpy.app.timers.unregister(timer)
    viewport_session.end_all()
    forget_programs()
