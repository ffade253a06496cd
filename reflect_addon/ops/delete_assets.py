"""Delete the scene's baked assets from disk."""

import shutil

import bpy

from ..core.asset_files import JSON_NAME
from ..core.bake_lock import BakeLock
from ..core.errors import ReflectError
from ..core.unfinished import PREFIX
from ..scene import live
from ..scene.load import PLANNED
from ..scene.places import assets_of


class REFLECT_OT_delete_assets(bpy.types.Operator):
    bl_idname = "reflect.delete_assets"
    bl_label = "Delete Assets"
    bl_description = "Delete everything that was baked for this scene from disk. This cannot be undone"

    @classmethod
    def poll(cls, context):
        if not assets_of(context.scene).is_dir():
            cls.poll_message_set("Nothing was baked for this scene yet")
            return False
        return True

    def invoke(self, context, event):
        return context.window_manager.invoke_confirm(self, event)

    def execute(self, context):
        folder = assets_of(context.scene)
        try:
            with BakeLock(folder):
                planned = [folder / PLANNED] if (folder / PLANNED).is_dir() else []
                for asset in [*(path.parent for path in folder.glob(f"*/{JSON_NAME}")), *folder.glob(f"{PREFIX}*"), *planned]:
                    shutil.rmtree(asset)
            if not any(folder.iterdir()):
                folder.rmdir()
        except ReflectError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        except OSError as error:
            self.report({"ERROR"}, f"{error.filename or folder} could not be deleted: {error.strerror}")
            return {"CANCELLED"}
        finally:
            live.of(context.scene).reload(context.scene)
        return {"FINISHED"}
