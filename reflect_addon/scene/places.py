"""Folders that Blender knows and core/asset_places.py cannot: the file's own and the user's."""

import shutil
from pathlib import Path

import bpy

from ..core.asset_places import scene_folder
from ..core.errors import ReflectError

# "bl_ext.<repository>.reflect_addon" once installed; "reflect_addon" when run from the source tree
EXTENSION = __package__.removesuffix(".scene").removesuffix(".reflect_addon")


def user_folder() -> Path:
    """Where assets of files that were never saved go: the extension's own folder, kept across upgrades."""
    if EXTENSION.startswith("bl_ext."):
        return Path(bpy.utils.extension_path_user(EXTENSION))
    return Path(bpy.utils.user_resource("DATAFILES", path="reflect"))  # run from the source tree


def assets_of(scene: bpy.types.Scene) -> Path:
    """The folder of a scene's assets."""
    return scene_folder(bpy.data.filepath or None, scene.name, user_folder())


def adopt_unsaved(scene: bpy.types.Scene) -> bool:
    """Moves what was baked before the first save beside the saved file; True when there was something to move.

    An asset folder that is there already wins. ReflectError when the disk refuses; the assets then stay where they were.
    """
    old, new = scene_folder(None, scene.name, user_folder()), assets_of(scene)
    if new.exists() or not old.is_dir():
        return False
    try:
        new.parent.mkdir(parents=True, exist_ok=True)
        shutil.move(old, new)
    except OSError as error:
        raise ReflectError(
            f"The assets of {scene.name} could not be moved to {new}: {error.strerror or error}.",
            "Save the .blend in a folder you may write to, or bake again.",
        ) from error
    return True
