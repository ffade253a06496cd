"""The viewport: a POST_VIEW callback that only draws, a POST_PIXEL one for what Blender draws into our mirrors (viewport_views.py), and the
app handlers that say when the scene changed.

App handlers mark sessions dirty and start a timer; the timer walks the scene (bpy may not be written to, nor the
depsgraph walked, while drawing); the callback uploads what the timer brought, once, and otherwise only draws.
"""

import bpy
from bpy.app.handlers import persistent

from ..core.background import background_of
from ..scene.camera import viewport_camera
from ..scene.viewport_source import shading_of, why_not
from . import judging
from . import session as viewport_session
from .program import forget_programs
from .viewport_views import ViewportViews, is_drawing

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
            behind = background_of(renderer.scene.assets, renderer.scene.snapshot, camera) if found.background else None
            renderer.mirrors.viewport = _views_of(found, context)
            own, other = judging.sides_of(found, camera)
            renderer.draw_overlay(camera, DEPTH_BIAS, behind, own)
            judging.draw_beside(found, renderer, camera, DEPTH_BIAS, other)
            judging.draw_over(found, renderer, camera, DEPTH_BIAS, own, context)
    except Exception as error:  # whatever it is, a draw callback that raises does so at every redraw
        found.give_up(error)
    return behind is not None


def _views_of(found, context) -> ViewportViews | None:
    """The pictures of this 3D view that mirrors show, told what they depend on; None where mirrors show surface radiance."""
    if not found.mirrors_viewport:
        found.keep_views(())
        return None
    if why_not(context.space_data, context.region_data, context.scene.render.engine):
        return None
    found.keep_views(region.as_pointer() for _area, region in judging.viewports())
    views = found.views.setdefault(context.region.as_pointer(), ViewportViews())
    views.state = found.walks, shading_of(context.space_data)
    return views


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
    """Blender has drawn a 3D view: now it may draw what the view's mirrors show, and words go over all."""
    context = bpy.context
    found = viewport_session.session(context.scene.name)
    if found is None or found.message or is_drawing():
        return
    views = found.views.get(context.region.as_pointer())
    try:
        if has_surfaces(context.space_data):
            judging.draw_labels(found, context.region)
        if views is not None:
            views.draw(context.scene, context.view_layer, context.space_data, context.region)
    except Exception as error:  # as in draw
        found.give_up(error)


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
        for area, _region in judging.viewports():
            area.tag_redraw()


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
    if bpy.app.timers.is_registered(_refresh):
        bpy.app.timers.unregister(_refresh)
    judging.stop()
    viewport_session.end_all()
    forget_programs()
