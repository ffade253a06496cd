"""Blender's notices that something changed. They set flags and start nothing slow; no GPU object is touched here."""

import bpy
from bpy.app.handlers import persistent

from . import live


@persistent
def _depsgraph_updated(scene, depsgraph):
    for update in depsgraph.updates:
        if update.is_updated_geometry or update.is_updated_transform or update.is_updated_shading:
            live.note_change(scene)
            return


@persistent
def _frame_changed(scene, _depsgraph=None):
    live.note_change(scene)


@persistent
def _stepped(_scene, _depsgraph=None):
    """Undo and redo: every scene may differ, and so may the chosen method and its settings."""
    for scene in bpy.data.scenes:
        live.note_change(scene)
        if live.of(scene).method != scene.reflect.method:
            live.of(scene).reload(scene)
        else:
            live.of(scene).settings_changed(scene)


@persistent
def _file_loaded(_path, _unused=None):
    live.forget()
    for scene in bpy.data.scenes:
        live.of(scene).reload(scene)


@persistent
def _file_saved(path, _unused=None):
    """A copy, as the bake worker gets one, changes nothing."""
    if path == bpy.data.filepath:
        for scene in bpy.data.scenes:
            live.of(scene).follow(scene)


HANDLERS = {
    "depsgraph_update_post": _depsgraph_updated,
    "frame_change_post": _frame_changed,
    "undo_post": _stepped,
    "redo_post": _stepped,
    "load_post": _file_loaded,
    "save_post": _file_saved,
}


def register() -> None:
    for name, handler in HANDLERS.items():
        getattr(bpy.app.handlers, name).append(handler)


def unregister() -> None:
    for name, handler in HANDLERS.items():
        getattr(bpy.app.handlers, name).remove(handler)
    live.forget()
