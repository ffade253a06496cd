"""Look at the scene and at the asset folder again."""

import bpy

from ..scene import live


class REFLECT_OT_refresh(bpy.types.Operator):
    bl_idname = "reflect.refresh"
    bl_label = "Look Again"
    bl_description = "Find the scene's reflectors again and load its assets again from disk"

    def execute(self, context):
        state = live.of(context.scene)
        state.changed = True
        state.reload(context.scene)
        if state.changed:
            state.look(context.scene)
        if state.read_error:
            self.report({"ERROR"}, state.read_error)
            return {"CANCELLED"}
        self.report({"INFO"}, f"{len(state.snapshot.reflectors())} reflectors, {len(state.assets)} assets")
        return {"FINISHED"}
