"""Everything that Reflect adds to Blender, in order, each with its undoing."""

from collections.abc import Callable, Iterator

import bpy

from . import cli
from .ops import (
    bake,
    cancel,
    delete_assets,
    export,
    focus_here,
    keep_fresh,
    mark,
    open_folder,
    plan_lock,
    plan_preset,
    plan_row,
    refresh,
    remove_from_materials,
    use_in_materials,
    wipe,
)
from .scene import handlers, live, properties
from .ui import map_preview, method_settings, native, overlays, panel, preferences, settings
from .ui import plan as plan_panel

CLASSES = (
    preferences.ReflectPreferences,
    *method_settings.GROUPS.values(),
    settings.ReflectSceneSettings,
    mark.REFLECT_OT_mark,
    refresh.REFLECT_OT_refresh,
    bake.REFLECT_OT_bake,
    cancel.REFLECT_OT_cancel,
    focus_here.REFLECT_OT_focus_here,
    use_in_materials.REFLECT_OT_use_in_materials,
    remove_from_materials.REFLECT_OT_remove_from_materials,
    export.REFLECT_OT_export,
    open_folder.REFLECT_OT_open_folder,
    delete_assets.REFLECT_OT_delete_assets,
    plan_preset.REFLECT_OT_plan_preset,
    plan_row.REFLECT_OT_plan_row,
    plan_lock.REFLECT_OT_plan_lock,
    wipe.REFLECT_OT_wipe,
    panel.REFLECT_PT_main,
    plan_panel.REFLECT_PT_plan,
    native.REFLECT_PT_native,
    overlays.REFLECT_PT_overlays,
    panel.REFLECT_PT_found,
    panel.REFLECT_PT_settings,
    panel.REFLECT_PT_advanced,
    panel.REFLECT_PT_assets,
)


def steps() -> Iterator[tuple[Callable[[], None], Callable[[], None]]]:
    """(do, undo) pairs."""
    yield properties.register, properties.unregister
    yield map_preview.register, map_preview.unregister
    for cls in CLASSES:
        yield lambda cls=cls: bpy.utils.register_class(cls), lambda cls=cls: bpy.utils.unregister_class(cls)
    yield export.register, export.unregister
    yield _add_scene_settings, _remove_scene_settings
    yield _Command().register, _Command.unregister
    if not bpy.app.background:
        from .ui import viewport  # imports Blender's gpu module, which the background must not need

        yield viewport.register, viewport.unregister
    yield handlers.register, handlers.unregister
    yield keep_fresh.register, keep_fresh.unregister
    yield _look_soon, _stop


def _add_scene_settings():
    bpy.types.Scene.reflect = bpy.props.PointerProperty(
        type=settings.ReflectSceneSettings, name="Reflect", description="Reflections of this scene"
    )


def _remove_scene_settings():
    del bpy.types.Scene.reflect


class _Command:
    """`blender -b FILE --command reflect VERB ...`."""

    handle = None

    def register(self):
        _Command.handle = bpy.utils.register_cli_command("reflect", cli.main)

    @staticmethod
    def unregister():
        bpy.utils.unregister_cli_command(_Command.handle)
        _Command.handle = None


def _look_soon():
    """Scenes that were saved with a method chosen show it as soon as the add-on is on. Blender forbids access to the
    file while it registers add-ons at its start; a timer waits for that, and load_post covers the files after."""
    if not bpy.app.background:
        bpy.app.timers.register(_look, first_interval=0.0)


def _stop():
    bake.stop()
    wipe.stop()
    if bpy.app.timers.is_registered(_look):
        bpy.app.timers.unregister(_look)


def _look():
    for scene in bpy.data.scenes:
        live.of(scene).reload(scene)
