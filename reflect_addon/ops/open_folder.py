"""Show the scene's assets in the system's file browser."""

import bpy

from ..scene.places import assets_of


class REFLECT_OT_open_folder(bpy.types.Operator):
    bl_idname = "reflect.open_folder"
    bl_label = "Open Asset Folder"
    bl_description = "Show the folder that holds this scene's baked assets"

    @classmethod
    def poll(cls, context):
        if not assets_of(context.scene).is_dir():
            cls.poll_message_set("Nothing was baked for this scene yet")
            return False
        return True

    def execute(self, context):
        bpy.ops.wm.path_open(filepath=str(assets_of(context.scene)))
        return {"FINISHED"}
