"""Compare the scene's method with another one, or with the truth: a line across the viewport, dragged with the mouse, until Esc."""

import bpy

from ..core.errors import ReflectError
from ..scene import live
from ..scene.camera import viewport_camera
from ..scene.places import assets_of
from ..scene.view_truth import Tracing
from ..scene.wipe import TRUTH, start_wipe, truth_wipe
from ..ui.preferences import worker_preference

HINT = "Drag in the viewport: the line between both.  Esc: end"
TRACING = "Tracing the truth of this view: {:.0%}  Esc: cancel"
POLL_INTERVAL = 0.1  # s between looks at the process that traces

_tracing: Tracing | None = None


class REFLECT_OT_wipe(bpy.types.Operator):
    bl_idname = "reflect.wipe"
    bl_label = "Wipe"
    bl_description = (
        "Show the other method, or the truth, right of a line that is dragged across the viewport; Esc ends it. Its assets are loaded for as long"
    )

    @classmethod
    def poll(cls, context):
        state, reason = live.of(context.scene), None
        if not live.is_on(context.scene) or not state.joined():
            reason = "Bake the scene's method first"
        elif context.scene.reflect.against in ("", "NONE", context.scene.reflect.method):
            reason = "Choose another method that is baked, or the truth"
        elif state.wipe is not None or _tracing is not None:
            reason = "A wipe is on: Esc over the viewport ends it"
        if reason:
            cls.poll_message_set(reason)
        return reason is None

    def invoke(self, context, _event):
        global _tracing
        if context.area is None or context.area.type != "VIEW_3D":
            self.report({"WARNING"}, "There is no 3D viewport here to be wiped")
            return {"CANCELLED"}
        scene, self._wipe = context.scene, None
        self._uid, self._area, self._drags, self._timer = scene.session_uid, context.area, False, None
        try:
            if scene.reflect.against == TRUTH:
                camera = viewport_camera(_picture(context.area), context.space_data.region_3d)
                _tracing = Tracing(scene, camera, worker_preference())
                self._timer = context.window_manager.event_timer_add(POLL_INTERVAL, window=context.window)
            else:
                self._show(start_wipe(scene, live.of(scene).snapshot, assets_of(scene), scene.reflect.against))
        except ReflectError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        if event.type == "ESC" and event.value == "PRESS":
            self.cancel(context)
            return {"FINISHED"}
        if self._timer is not None:
            return self._wait(context) if event.type == "TIMER" else {"PASS_THROUGH"}
        if live.of_uid(self._uid).wipe is not self._wipe:  # another file, or the method was switched off
            self.cancel(context)
            return {"FINISHED"}
        if event.type == "LEFTMOUSE" and event.value == "PRESS":
            self._drags = _in_picture(self._area, event.mouse_x, event.mouse_y)
        if not self._drags or event.type not in {"LEFTMOUSE", "MOUSEMOVE"}:
            return {"PASS_THROUGH"}
        self._drags = event.value != "RELEASE"
        region = _picture(self._area)
        self._wipe.place = min(max((event.mouse_x - region.x) / region.width, 0.0), 1.0)
        self._area.tag_redraw()
        return {"RUNNING_MODAL"}

    def cancel(self, context):
        """Gives the viewport back; Blender calls it, too, when it ends the operator itself."""
        self._stop_waiting(context)
        self._area.header_text_set(None)
        if self._wipe is not None and live.of_uid(self._uid).wipe is self._wipe:
            self._set(None)

    def _wait(self, context):
        """A look at the process that traces the truth."""
        if _tracing is None:
            self.cancel(context)
            return {"CANCELLED"}
        if (state := _tracing.worker.poll()).running:
            self._area.header_text_set(TRACING.format(state.fraction))
            return {"PASS_THROUGH"}
        try:
            self._show(truth_wipe(_tracing.result()))
        except ReflectError as error:
            self.report({"ERROR"}, str(error))
            self.cancel(context)
            return {"CANCELLED"}
        self._stop_waiting(context)
        return {"PASS_THROUGH"}

    def _show(self, wipe):
        self._wipe = wipe
        self._set(wipe)
        self._area.header_text_set(HINT)

    def _set(self, wipe):
        state = live.of_uid(self._uid)
        state.wipe = wipe
        for scene in bpy.data.scenes:
            if scene.session_uid == self._uid:
                state.show(scene)

    def _stop_waiting(self, context):
        if self._timer is not None:
            context.window_manager.event_timer_remove(self._timer)
            self._timer = None
            stop()


def stop() -> None:
    """Ends the tracing of this window, when there is one: it is done, the add-on is switched off, or the file goes."""
    global _tracing
    if _tracing is not None:
        _tracing.close()
        _tracing = None


def _picture(area):
    return next(r for r in area.regions if r.type == "WINDOW")


def _in_picture(area, x: int, y: int) -> bool:
    """Whether a place of the window is in an area's picture, and not on what lies over it."""
    inside = {r.type for r in area.regions if r.x <= x < r.x + r.width and r.y <= y < r.y + r.height and r.width > 1}
    return inside == {"WINDOW"}
