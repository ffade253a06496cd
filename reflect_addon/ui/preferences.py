"""The add-on's preferences: who bakes."""

import bpy

from ..scene.places import EXTENSION


class ReflectPreferences(bpy.types.AddonPreferences):
    bl_idname = EXTENSION  # the outer package of an installed extension

    worker: bpy.props.StringProperty(
        name="Bake Worker",
        description="Executable that bakes: a Blender 5.2 with OSL, or a Python 3.13 with the bpy 5.2 module. Empty: this "
        "Blender. Needed where Blender was built without OSL, as by some Linux distributions",
        subtype="FILE_PATH",
    )

    def draw(self, _context):
        self.layout.prop(self, "worker")
        if not self.worker and not bpy.app.module and not bpy.app.build_options.cycles_osl:
            self.layout.label(text="This Blender was built without OSL: name a worker, or nothing can be baked", icon="ERROR")


def worker_preference() -> str:
    """The named worker; "" when there is none, or when Reflect runs from its source tree."""
    addon = bpy.context.preferences.addons.get(EXTENSION)
    return addon.preferences.worker if addon and addon.preferences else ""
