"""Draft, balanced, best: what `auto` is asked for, in one click."""

import bpy

from ..core import methods
from ..core.methods import auto


class REFLECT_OT_plan_preset(bpy.types.Operator):
    bl_idname = "reflect.plan_preset"
    bl_label = "Preset"
    bl_options = {"REGISTER", "UNDO"}

    preset: bpy.props.EnumProperty(
        name="Preset", description="What Auto is asked for",
        items=[(name, name.title(), tooltip) for name, (tooltip, _) in auto.PRESETS.items()], options={"SKIP_SAVE"},
    )  # fmt: skip

    @classmethod
    def poll(cls, context):
        return context.scene.reflect.method == methods.AUTO

    @classmethod
    def description(cls, _context, properties):
        """What the preset asks for."""
        return auto.PRESETS[properties.preset][0]

    def execute(self, context):
        asked = {**auto.DEFAULTS, **auto.PRESETS[self.preset][1]}
        for name, value in asked.items():
            if name != "live":  # not about quality
                setattr(context.scene.reflect.auto, name, value)
        return {"FINISHED"}
