"""The panel's Cancel button; Esc does the same."""

import bpy

from . import bake


class REFLECT_OT_cancel(bpy.types.Operator):
    bl_idname = "reflect.cancel"
    bl_label = "Cancel Bake"
    bl_description = "Stop the bake that is running; earlier assets and the scene stay as they are"
    bl_options = {"INTERNAL"}

    @classmethod
    def poll(cls, _context):
        if bake.running() is None:
            cls.poll_message_set("No bake is running")
            return False
        return True

    def execute(self, _context):
        bake.running().cancel()
        return {"FINISHED"}
