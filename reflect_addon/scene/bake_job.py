"""Bakes the open file in another process: a copy of it, a worker, and nothing left behind (design, "Baking happens in
another process")."""

import json
import shutil
import tempfile
from collections.abc import Sequence
from pathlib import Path

import bpy

from ..core.camera import Camera
from ..core.errors import ReflectError
from ..core.processes import remove_abandoned, signature
from .places import assets_of
from .worker import Worker
from .worker_command import bake_command


def start_bake(
    scene: bpy.types.Scene, methods: list[str], objects: list[str] = (), settings: list[str] = (), preference: str = "", views: Sequence[Camera] = ()
) -> Worker:
    """Starts baking the methods for the scene as it is now, saved or not; returns at once with the running worker.

    objects: names of reflectors, none for all; settings: more arguments of the command line's bake; preference: the
    worker executable that the user named; views: what 3D views show, for a plan. The open file, its changes and its dirty state stay as they are. ReflectError
    when there is no usable worker or no room for the copy.
    """
    remove_abandoned(Path(tempfile.gettempdir()), "reflect-bake-")
    scratch = Path(tempfile.mkdtemp(prefix=f"reflect-bake-{signature()}-"))
    blend = scratch / (Path(bpy.data.filepath).stem or "unsaved")
    blend = blend.with_name(blend.name + ".blend")
    try:
        more = [*settings, f"--scene={scene.name}"]
        if views:
            (scratch / "views.json").write_text(json.dumps([view.plain() for view in views]))
            more.append(f"--views={scratch / 'views.json'}")
        command, environment = bake_command(blend, list(methods), assets_of(scene), list(objects), more, preference)
        save_copy(blend)
    except BaseException:
        shutil.rmtree(scratch, ignore_errors=True)
        raise
    return Worker(command, scratch, environment)


def unsaved_images() -> list[str]:
    """Images whose painted changes are only in memory: a copy of the file cannot carry them, so bakes do not see them."""
    return [i.name for i in bpy.data.images if i.is_dirty and i.users and i.source in ("FILE", "GENERATED")]


def save_copy(blend: Path) -> None:
    """The open file as it is now, relative paths still meaning the same files. ReflectError without room."""
    try:
        bpy.ops.wm.save_as_mainfile(filepath=str(blend), copy=True, relative_remap=True, compress=False)
    except RuntimeError as error:
        reason = str(error).strip().removeprefix("Error: ").splitlines()[0]
        raise ReflectError(
            f"No copy of the file could be saved for the worker: {reason}.",
            f"Make room in {blend.parent.parent} or set another temporary folder (TMPDIR).",
        ) from error
    if not blend.is_file():
        raise ReflectError("Blender saved no copy of the file for the worker.", "Save the .blend and try again.")
