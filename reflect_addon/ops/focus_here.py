"""Focus the light field on a place that is clicked, itself or its reflection in a mirror."""

import bpy
from bpy_extras import view3d_utils

from ..core import methods
from ..core.focus import can_focus
from ..scene import live
from ..scene.pick import pick

HINT = "Click what should be sharp, or its reflection in a mirror.  Esc or right click: cancel"


class REFLECT_OT_focus_here(bpy.types.Operator):
    bl_idname = "reflect.focus_here"
    bl_label = "Focus Here"
    bl_description = "Click a place, or its reflection in a mirror: the light field becomes sharpest there, without another bake"
    bl_options = {"REGISTER", "UNDO", "BLOCKING"}

    origin: bpy.props.FloatVectorProperty(
        name="Origin", description="Where the ray that looks for the place starts", subtype="TRANSLATION", options={"SKIP_SAVE"}
    )
    direction: bpy.props.FloatVectorProperty(
        name="Direction", description="Where the ray goes", subtype="DIRECTION", default=(0, 0, -1), options={"SKIP_SAVE"}
    )

    @classmethod
    def poll(cls, context):
        method, reason = context.scene.reflect.method, None
        if not can_focus(method):
            reason = "Choose a method that has a focus, as Light Field"
        elif not live.of(context.scene).joined():
            reason = "Bake first: nothing is shown that could be focused"
        if reason:
            cls.poll_message_set(reason)
        return reason is None

    def invoke(self, context, _event):
        if context.area is None or context.area.type != "VIEW_3D":
            return self.execute(context)
        context.window.cursor_modal_set("EYEDROPPER")
        context.area.header_text_set(HINT)
        self._area = context.area
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        if event.type in {"ESC", "RIGHTMOUSE"} and event.value == "PRESS":
            self.cancel(context)
            return {"CANCELLED"}
        if event.type != "LEFTMOUSE" or event.value != "PRESS":
            return {"PASS_THROUGH"} if event.type in {"MIDDLEMOUSE", "WHEELUPMOUSE", "WHEELDOWNMOUSE"} else {"RUNNING_MODAL"}
        self.cancel(context)
        region = next(r for r in self._area.regions if r.type == "WINDOW")
        at = event.mouse_x - region.x, event.mouse_y - region.y
        if not (0 <= at[0] < region.width and 0 <= at[1] < region.height):
            self.report({"WARNING"}, "That is outside the viewport: nothing was focused")
            return {"CANCELLED"}
        view = self._area.spaces.active.region_3d
        self.origin = view3d_utils.region_2d_to_origin_3d(region, view, at)
        self.direction = view3d_utils.region_2d_to_vector_3d(region, view, at)
        return self.execute(context)

    def cancel(self, context):
        """Gives the window its cursor and header back; Blender calls it, too, when it ends the operator itself."""
        context.window.cursor_modal_restore()
        self._area.header_text_set(None)

    def execute(self, context):
        """With the ray of `origin` and `direction`."""
        scene, state = context.scene, live.of(context.scene)
        assets = state.joined()
        by_object = {r.object_name: assets[r.name] for r in state.snapshot.reflectors() if r.name in assets}
        place, mirror = pick(live.depsgraph_of(scene), self.origin, self.direction, by_object.keys())
        if place is None:
            where = f"In {mirror} the sky is seen there" if mirror else "Nothing is there"
            self.report({"WARNING"}, f"{where}: click a surface, or type a distance")
            return {"CANCELLED"}
        asset = by_object[mirror] if mirror else next(iter(assets.values()))
        scene.reflect.focus_distance = methods.get(asset.kind).distance_of(asset, place)
        self.report({"INFO"}, f"Focused on {scene.reflect.focus_distance:.3g} m from the cell's middle")
        return {"FINISHED"}
