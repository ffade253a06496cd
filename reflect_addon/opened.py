"""The file that a verb works on: a Blender that can, the .blend open in it, the scene that was named."""

import os
import sys
from pathlib import Path

from . import unsuitable
from .core.errors import ReflectError


def check_blender() -> None:
    """ReflectError when this is no Blender of a version that Reflect works in."""
    try:
        import bpy
    except ImportError as error:
        raise ReflectError(
            f"This Python has no Blender in it ({error}).",
            "Use ./dev reflect ..., which sets it up, or blender -b FILE.blend --command reflect ...",
        ) from error
    if reason := unsuitable(bpy.app):
        raise ReflectError(reason, "Update Blender.")


def open_blend(path: Path | None):
    """Opens the file unless it is open already. ReflectError when it is missing, no .blend, damaged or too new."""
    import bpy

    if path is None:
        if not bpy.data.filepath and bpy.app.module:
            raise ReflectError("No file was named.", "Put the .blend after the verb: reflect analyse FILE.blend.")
        return bpy
    if not os.path.isfile(path):
        raise ReflectError(f"There is no file {path}.", "Check the path; it should name a .blend.")
    try:
        with path.open("rb") as file:
            start = file.read(12)
    except OSError as error:
        raise ReflectError(f"{path} cannot be read ({error.strerror or error}).", "Check its permissions.") from error
    if len(start) < 12:
        raise ReflectError(f"{path} is empty or cut short.", "Restore it from a backup (.blend1).")
    # Plain, gzip (to 2.93) and zstd (since 3.0).
    if not (start.startswith(b"BLENDER") or start[:2] == b"\x1f\x8b" or start[:4] == b"\x28\xb5\x2f\xfd"):
        raise ReflectError(f"{path} is not a .blend file.", "Name a file that Blender saved.")
    if not (bpy.data.filepath and os.path.samefile(bpy.data.filepath, path)):
        try:
            bpy.ops.wm.open_mainfile(filepath=str(path.absolute()), load_ui=False, use_scripts=False)
        except RuntimeError as error:
            reason = str(error).strip().removeprefix("Error: ").splitlines()[0]
            raise ReflectError(
                f"{path} could not be opened: {reason}", "Save it again with Blender 5.2, or restore a backup (.blend1)."
            ) from error
    for library in bpy.data.libraries:
        if library.is_missing:
            where = bpy.path.abspath(library.filepath)
            warn(f"The library {where} is missing, and with it what is linked from there. Put it back, or relocate it.")
    if tuple(bpy.data.version) > bpy.app.version[:2] + (9999,):
        warn(f"{path} was saved by a newer Blender ({bpy.data.version[0]}.{bpy.data.version[1]}); parts of it may be lost.")
    return bpy


def warn(sentence: str) -> None:
    print(f"reflect: Warning: {sentence}", file=sys.stderr, flush=True)


def scene_of(arguments):
    bpy = open_blend(arguments.file)
    if arguments.scene is None:
        return bpy.context.scene
    scene = bpy.data.scenes.get(arguments.scene)
    if scene is None:
        there = ", ".join(s.name for s in bpy.data.scenes)
        raise ReflectError(f"There is no scene named '{arguments.scene}' in the file.", f"Choose among: {there}.")
    if bpy.context.window is not None:
        bpy.context.window.scene = scene
    return scene
