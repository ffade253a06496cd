"""The sidebar's panel "In Materials": reflections that EEVEE draws by itself."""

import bpy

from ..scene import live
from ..scene.native_materials import has_native
from .panel import Tab, sentence


class REFLECT_PT_native(Tab, bpy.types.Panel):
    bl_idname = "REFLECT_PT_native"
    bl_parent_id = "REFLECT_PT_main"
    bl_label = "In Materials"

    @classmethod
    def poll(cls, context):
        return live.is_on(context.scene) or has_native(context.scene.objects)

    def draw(self, context):
        layout, settings = self.layout, context.scene.reflect
        layout.use_property_split, layout.use_property_decorate = True, False
        row = layout.row(align=True)
        row.operator("reflect.use_in_materials", icon="MATERIAL")
        row.operator("reflect.remove_from_materials", text="", icon="X")
        layout.prop(settings, "native_pack")
        if settings.native_said:
            sentence(layout, context, f"{settings.native_said}.", "CHECKMARK")
