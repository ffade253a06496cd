"""Folders that Blender knows and core/asset_places.py cannot: the file's own and the user's."""

from pathlib import Path

import bpy

from ..core.asset_places import scene_folder

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
