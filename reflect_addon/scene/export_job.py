"""Exports the open file in another process: a copy of it and a worker, as bakes are made (bake_job.py)."""

import shutil
import tempfile
from pathlib import Path

import bpy

from ..core.asset_places import file_name
from ..core.exchange.manifest import FILE_NAME
from ..core.processes import remove_abandoned, signature
from .bake_job import save_copy
from .ktx2 import find_ktx
from .places import assets_of
from .worker import Worker
from .worker_command import reflect_command


def start_export(scene: bpy.types.Scene, out: Path, preference: str = "", ktx2: bool = False) -> Worker:
    """Starts exporting all that is baked for the scene, as it is now, to the folder `out`. The open file stays as it is. ktx2: float
    images as KTX2. ReflectError: no usable worker, no room, no program that writes KTX2."""
    if ktx2:
        find_ktx()
    remove_abandoned(Path(tempfile.gettempdir()), "reflect-export-")
    scratch = Path(tempfile.mkdtemp(prefix=f"reflect-export-{signature()}-"))
    blend = scratch / f"{Path(bpy.data.filepath).stem or 'unsaved'}.blend"
    try:
        arguments = [f"--out={Path(out).absolute()}", f"--assets={assets_of(scene)}", f"--scene={scene.name}", "--json-progress", *(["--ktx2"] if ktx2 else [])]
        command, environment = reflect_command(blend, "export", arguments, preference)
        save_copy(blend)
    except BaseException:
        shutil.rmtree(scratch, ignore_errors=True)
        raise
    return Worker(command, scratch, environment, work="export")


def folder_in(chosen: Path, scene: bpy.types.Scene) -> Path:
    """Where an export goes when a folder was chosen: there when it is an earlier export or is not there yet, else to one of its own below it."""
    chosen = Path(chosen)
    if not chosen.is_dir() or (chosen / FILE_NAME).is_file() or not any(chosen.iterdir()):
        return chosen
    return chosen / file_name(f"{Path(bpy.data.filepath).stem or scene.name} reflections")
