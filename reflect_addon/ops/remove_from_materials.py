"""Give the reflectors back the materials that they had before "Use in Materials"."""

import bpy

from ..scene.native_materials import has_native, remove_from_materials


class REFLECT_OT_remove_from_materials(bpy.types.Operator):
    bl_idname = "reflect.remove_from_materials"
    bl_label = "Remove"
    bl_description = "Give the reflectors of this scene back their own materials, and delete what Use in Materials made for them"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        if not has_native(context.scene.objects):
            cls.poll_message_set("No material of this scene shows Reflect's reflections")
            return False
        return True

    def execute(self, context):
        done = remove_from_materials(context.scene.objects)
        context.scene.reflect.native_said = ""
        for sentence in done.sentences:
            self.report({"WARNING"}, sentence)
        self.report({"INFO"}, f"{done.objects} objects have their own materials again")
        return {"FINISHED"}
