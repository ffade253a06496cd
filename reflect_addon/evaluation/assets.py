"""Assets for an evaluation: those beside the .blend when they are fresh, else baked and kept."""

import os
from functools import partial
from pathlib import Path

import bpy

from ..core.asset import Asset
from ..core.asset_places import file_name
from ..core.snapshot import SceneSnapshot
from ..scene.bake import bake_assets, load_assets
from ..scene.places import assets_of
from ..scene.raytrace import trace


def assets_for(
    scene: bpy.types.Scene, snapshot: SceneSnapshot, method: str, out: Path, settings: dict | None, progress
) -> dict[str, Asset]:
    """Reflector name -> asset of one method, joined with what it requires.

    Other settings than the defaults are baked below `out`, so that they do not replace what the user baked; so are all
    when the .blend was never saved or lies in a folder that cannot be written.
    """
    beside = assets_of(scene)
    use_beside = bool(bpy.data.filepath) and not settings and _writable(beside)
    folder = beside if use_beside else Path(out) / "assets" / file_name(scene.name)
    bake_assets(snapshot, (method,), folder, settings=settings, tracer=partial(trace, scene=scene), progress=progress)
    return load_assets(snapshot, method, folder)


def _writable(folder: Path) -> bool:
    while not os.path.lexists(folder):
        folder = folder.parent
    return os.access(folder, os.W_OK)
