"""The sidebar tab "Reflect". It shows what scene/live.py already knows; drawing it reads no mesh and no file."""

import bpy

from ..core import methods
from ..core.background import can_show
from ..core.focus import can_focus
from ..core.settings import of as setting_of
from ..ops import bake
from ..scene import live
from . import messages, mirror_source
from .map_preview import icon_of

LISTED = 12  # reflectors named in the panel; a scene may have thousands


class Tab:
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Reflect"


class MethodTab(Tab):
    """For a panel that says something only of a method's reflections."""

    bl_parent_id = "REFLECT_PT_main"

    @classmethod
    def poll(cls, context):
        return live.is_on(context.scene)


class REFLECT_PT_main(Tab, bpy.types.Panel):
    bl_idname = "REFLECT_PT_main"
    bl_label = "Reflect"

    def draw(self, context):
        layout, scene = self.layout, context.scene
        state = live.of(scene)
        layout.use_property_split, layout.use_property_decorate = True, False
        layout.prop(scene.reflect, "method")
        _bake_row(layout, state)
        for message in (state.bake_error, state.read_error, state.draw_error(), *state.problems):
            if message:
                sentence(layout, context, message, "ERROR")
        if live.is_on(scene):
            for message in messages.of_picture(context, state):
                sentence(layout, context, message, "INFO")


class REFLECT_PT_found(Tab, bpy.types.Panel):
    bl_idname = "REFLECT_PT_found"
    bl_parent_id = "REFLECT_PT_main"
    bl_label = "Reflectors"

    def draw(self, context):
        layout, state = self.layout, live.of(context.scene)
        snapshot = state.snapshot
        if snapshot is None:
            layout.label(text="Not looked for yet")
        else:
            reflectors = snapshot.reflectors()
            column = layout.column(align=True)
            for reflector in reflectors[:LISTED]:
                row = column.row()
                row.label(text=reflector.name, icon=_icon(state, reflector.name))
                row.label(text=_reason(snapshot, reflector))
            if len(reflectors) > LISTED:
                column.label(text=f"and {len(reflectors) - LISTED} more")
            if not reflectors:
                column.label(text="None: nothing here is shiny enough")
            for message in (*_simplified(snapshot, reflectors), *snapshot.warnings):
                sentence(layout, context, message, "INFO")
        layout.operator("reflect.refresh", icon="FILE_REFRESH")
        row = layout.row(align=True)
        row.operator("reflect.mark", text="Mark").mark = "YES"
        row.operator("reflect.mark", text="Unmark").mark = "NO"
        row.operator("reflect.mark", text="By Material").mark = "AUTO"


class REFLECT_PT_settings(MethodTab, bpy.types.Panel):
    bl_idname = "REFLECT_PT_settings"
    bl_label = "Settings"

    def draw(self, context):
        layout, settings = self.layout, context.scene.reflect
        layout.use_property_split, layout.use_property_decorate = True, False
        _fields(layout, settings, advanced=False)
        layout.prop(settings, "refresh")
        if settings.refresh == "LIVE":
            layout.prop(settings, "refresh_seconds")
        layout.prop(settings, "half_distance")
        if can_focus(settings.method):
            row = layout.row(align=True)
            row.prop(settings, "focus_distance")
            row.operator("reflect.focus_here", text="", icon="EYEDROPPER")
        if can_show(settings.method):
            layout.prop(settings, "background")
        mirror_source.field(layout, settings)


class REFLECT_PT_advanced(Tab, bpy.types.Panel):
    bl_idname = "REFLECT_PT_advanced"
    bl_parent_id = "REFLECT_PT_settings"
    bl_label = "Advanced"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context):
        return live.is_on(context.scene) and any(_named(context.scene.reflect, advanced=True))

    def draw(self, context):
        layout = self.layout
        layout.use_property_split, layout.use_property_decorate = True, False
        _fields(layout, context.scene.reflect, advanced=True)


class REFLECT_PT_assets(Tab, bpy.types.Panel):
    bl_idname = "REFLECT_PT_assets"
    bl_parent_id = "REFLECT_PT_main"
    bl_label = "Assets"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        layout, state = self.layout, live.of(context.scene)
        column = layout.column(align=True)
        for (kind, reflector), asset in list(state.assets.items())[:LISTED]:
            row = column.row()
            row.label(text=f"{kind}: {reflector or 'all'}")
            row.label(text=f"{_memory(asset.bytes())}, baked in {asset.bake_seconds:.1f} s")
            if icon := icon_of(asset):
                column.template_icon(icon, scale=6.0)
        column.label(text=f"{len(state.assets)} assets, {_memory(state.bytes())} on the GPU")
        for message in dict.fromkeys(_reports(state)):
            sentence(layout, context, message, "INFO")
        row = layout.row(align=True)
        row.operator("reflect.open_folder", icon="FILE_FOLDER")
        row.operator("reflect.delete_assets", icon="TRASH")


def _reports(state):
    """What methods say of the listed assets."""
    for (kind, reflector), asset in list(state.assets.items())[:LISTED]:
        if report := getattr(methods.get(kind), "report", None):
            yield f"{reflector or 'All'}: {report(asset)}"


def _named(settings, advanced: bool):
    """(label of a method, its properties, names of those to show) of the chosen method and those it requires."""
    for kind in methods.with_required([settings.method]):
        method, group = methods.get(kind), getattr(settings, kind, None)
        shown = {name: setting_of(method, name) for name in method.DEFAULTS}
        names = [name for name in shown if shown[name].advanced == advanced]
        if group and names:
            # Lengths last: they are about the scene, not about how it is baked.
            yield method.LABEL, group, sorted(names, key=lambda name: shown[name].unit != "")


def _fields(layout, settings, advanced: bool):
    found = list(_named(settings, advanced))
    for label, group, names in found:
        column = layout.column()
        if len(found) > 1:
            column.label(text=label)
        for name in names:
            column.prop(group, name)


def _bake_row(layout, state):
    worker = bake.running()
    if worker is None:
        text = "Bake Again" if state.stale or state.compared.other_settings else "Bake"
        layout.operator("reflect.bake", text=text, icon="RENDER_STILL")
        return
    progress = worker.state
    row = layout.row(align=True)
    row.progress(factor=progress.fraction, text=f"{progress.fraction:.0%}  {progress.message}")
    row.operator("reflect.cancel", text="", icon="CANCEL")


def _icon(state, name):
    return "ERROR" if name in state.compared.missing else "FILE_REFRESH" if name in (*state.stale, *state.compared.other_settings) else "CHECKMARK"


def _reason(snapshot, reflector):
    """Why an instance is a reflector."""
    if reflector.mark == "YES":
        return "marked by hand"
    shiny = [m for m in (snapshot.materials[i] for i in reflector.materials) if m.is_reflector]
    if not shiny:
        return "by material"
    material = min(shiny, key=lambda m: m.roughness)
    kind = "metal" if material.metallic > 0.5 else "glossy"
    return f"{material.name}: {kind}, roughness {material.roughness:.2f}"


def _simplified(snapshot, reflectors):
    """One sentence per material of a reflector that was reduced."""
    for index in sorted({i for reflector in reflectors for i in reflector.materials}):
        material = snapshot.materials[index]
        if material.simplified:
            yield f"{material.name}: {'; '.join(material.simplified)}"


def _memory(count):
    """A number of bytes in words."""
    if count < 1024:
        return f"{count} B"
    return f"{count / 2**20:.1f} MiB" if count >= 2**20 else f"{count / 1024:.0f} KiB"


def sentence(layout, context, text, icon):
    """A label as many lines high as the sidebar's width asks for."""
    letters = max(20, int(context.region.width / (7 * context.preferences.system.ui_scale)) - 4)
    column, line = layout.column(align=True), ""
    for word in text.split():
        if line and len(line) + len(word) >= letters:
            column.label(text=line, icon=icon)
            line, icon = "", "BLANK1"
        line = f"{line} {word}".strip()
    column.label(text=line, icon=icon)
