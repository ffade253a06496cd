"""A .blend whose materials show a method's reflections, written from the command line: for render farms and for files in bulk.

Problem. The window's operators need the add-on in a window; a farm has neither, and bakes from a shell.
Idea. The scene is read as a render shows it, as bakes do, so that freshness means the same; then the same functions as the operators'
run, and the file is saved under another name. The one that was opened stays as it is.
"""

from collections.abc import Callable
from pathlib import Path

import bpy

from ..core.asset_places import scene_folder
from ..core.errors import ReflectError
from ..scene.freshness import is_stale
from ..scene.load import load_assets
from ..scene.native_materials import IMAGES, Report, remove_from_materials, use_in_materials
from ..scene.properties import object_properties
from .frame import open_frame


def write_native(
    scene: bpy.types.Scene, method: str, folder: Path, out: Path, *, pack: bool, progress: Callable[[float, str], object]
) -> Report:
    """Saves `out` with the method's reflections in the materials of the scene's reflectors. folder: where the assets are."""
    with object_properties():
        progress(0.0, "Looking for reflectors")
        with open_frame(scene, None, progress) as snapshot:
            assets = load_assets(snapshot, method, folder)
        stale = {name for name, asset in assets.items() if is_stale(snapshot, asset)}
        images = scene_folder(out, scene.name) / IMAGES
        making = lambda share, text: progress(0.3 + 0.6 * share, text)
        done = use_in_materials(scene, snapshot, assets, method, pack=pack, folder=images, stale=stale, progress=making)
        _save(out)
    return done


def write_without(scene: bpy.types.Scene, out: Path) -> Report:
    """Saves `out` with the artist's own materials in the slots of the scene's objects."""
    with object_properties():
        done = remove_from_materials(scene.objects)
        _save(out)
    return done


def _save(out: Path) -> None:
    out.absolute().parent.mkdir(parents=True, exist_ok=True)
    try:
        bpy.ops.wm.save_as_mainfile(filepath=str(Path(out).absolute()), copy=True)
    except RuntimeError as error:
        reason = str(error).strip().removeprefix("Error: ")
        raise ReflectError(f"{out} could not be written: {reason}", "Choose a folder you may write to.") from error
