"""A row of the plan: its tooltip is the reason, and a click selects the reflector."""

import bpy

from ..scene import live


class REFLECT_OT_plan_row(bpy.types.Operator):
    bl_idname = "reflect.plan_row"
    bl_label = "Select"
    bl_options = {"REGISTER", "UNDO"}

    reflector: bpy.props.StringProperty(name="Reflector", description="Name of the reflector, as the plan has it", options={"SKIP_SAVE"})

    @classmethod
    def description(cls, context, properties):
        """Why the reflector has what it has."""
        plan = live.of(context.scene).loaded.plan
        row = plan.row_of(properties.reflector) if plan else None
        if row is None:
            return "The plan does not know this reflector"
        return "\n".join([row.reason, *(f"Left out: {one.what}; {one.why}." for one in row.left_out)]).removesuffix(".")

    def execute(self, context):
        snapshot = live.of(context.scene).snapshot
        instance = snapshot.named().get(self.reflector) if snapshot else None
        obj = context.scene.objects.get(instance.object_name) if instance else None
        if obj is None or not obj.visible_get():
            self.report({"WARNING"}, f"{self.reflector} is not there or hidden")
            return {"CANCELLED"}
        for other in context.selected_objects:
            other.select_set(False)
        obj.select_set(True)
        context.view_layer.objects.active = obj
        return {"FINISHED"}
