"""Compare the scene's method with another one: a line across the viewport, dragged with the mouse, until Esc."""

import bpy

from ..core.errors import ReflectError
from ..scene import live
from ..scene.places import assets_of
from ..scene.wipe import start_wipe

HINT = "Drag in the viewport: the line between both methods.  Esc: end"


class REFLECT_OT_wipe(bpy.types.Operator):
    bl_idname = "reflect.wipe"
    bl_label = "Wipe"
    bl_description = "Show the other method right of a line that is dragged across the viewport; Esc ends it. Its assets are loaded for as long"

    @classmethod
    def poll(cls, context):
        state, reason = live.of(context.scene), None
        if not live.is_on(context.scene) or not state.joined():
            reason = "Bake the scene's method first"
        elif context.scene.reflect.against in ("", "NONE", context.scene.reflect.method):
            reason = "Choose another method that is baked"
        elif state.wipe is not None:
            reason = "A wipe is on: Esc over the viewport ends it"
        if reason:
            cls.poll_message_set(reason)
        return reason is None

    def invoke(self, context, _event):
        if context.area is None or context.area.type != "VIEW_3D":
            self.report({"WARNING"}, "There is no 3D viewport here to be wiped")
            return {"CANCELLED"}
        scene, state = context.scene, live.of(context.scene)
        try:
            self._wipe = state.wipe = start_wipe(scene, state.snapshot, assets_of(scene), scene.reflect.against)
        except ReflectError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        self._uid, self._area, self._drags = scene.session_uid, context.area, False
        state.show(scene)
        context.area.header_text_set(HINT)
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        if live.of_uid(self._uid).wipe is not self._wipe:  # another file, or the method was switched off
            self.cancel(context)
            return {"FINISHED"}
        if event.type == "ESC" and event.value == "PRESS":
            self.cancel(context)
            return {"FINISHED"}
        region = next(r for r in self._area.regions if r.type == "WINDOW")
        if event.type == "LEFTMOUSE" and event.value == "PRESS":
            self._drags = _in_picture(self._area, event.mouse_x, event.mouse_y)
        if not self._drags or event.type not in {"LEFTMOUSE", "MOUSEMOVE"}:
            return {"PASS_THROUGH"}
        self._drags = event.value != "RELEASE"
        self._wipe.place = min(max((event.mouse_x - region.x) / region.width, 0.0), 1.0)
        self._area.tag_redraw()
        return {"RUNNING_MODAL"}

    def cancel(self, context):
        """Gives the viewport back; Blender calls it, too, when it ends the operator itself."""
        self._area.header_text_set(None)
        state = live.of_uid(self._uid)
        if state.wipe is self._wipe:
            state.wipe = None
            for scene in bpy.data.scenes:
                if scene.session_uid == self._uid:
                    state.show(scene)


def _in_picture(area, x: int, y: int) -> bool:
    """Whether a place of the window is in an area's picture, and not on what lies over it."""
    inside = {r.type for r in area.regions if r.x <= x < r.x + r.width and r.y <= y < r.y + r.height and r.width > 1}
    return inside == {"WINDOW"}
