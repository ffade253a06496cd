"""A row of the plan is locked: its reflector keeps what it has when a plan is made again."""

import bpy

from ..scene import live
from ..scene.properties import KEPT, stand_in_of


class REFLECT_OT_plan_lock(bpy.types.Operator):
    bl_idname = "reflect.plan_lock"
    bl_label = "Lock"
    bl_description = "Keep this reflector's stand-in with its present settings when a plan is made again; a second click leaves it to the plan"
    bl_options = {"REGISTER", "UNDO"}

    reflector: bpy.props.StringProperty(name="Reflector", description="Name of the reflector, as the plan has it", options={"SKIP_SAVE"})

    def execute(self, context):
        snapshot = live.of(context.scene).snapshot
        instance = snapshot.named().get(self.reflector) if snapshot else None
        obj = context.scene.objects.get(instance.object_name) if instance else None
        if obj is None:
            self.report({"WARNING"}, f"{self.reflector} is not there")
            return {"CANCELLED"}
        obj.reflect_stand_in = "AUTO" if stand_in_of(obj) == KEPT else KEPT
        return {"FINISHED"}
