"""Assets for an evaluation: those beside the .blend when they are fresh, else baked and kept."""

import os
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import bpy

from ..core.asset import Asset, asset_of
from ..core.asset_places import file_name
from ..core.drawn_settings import is_drawn
from ..core.errors import ReflectError
from ..core.methods import AUTO
from ..core.snapshot import SceneSnapshot
from ..scene.auto import bake_auto
from ..scene.bake import bake_assets
from ..scene.freshness import is_stale
from ..scene.load import load_assets, load_surfaces
from ..scene.places import assets_of
from ..scene.raytrace import trace


@dataclass(frozen=True)
class Baked:
    """What a method draws from."""

    assets: dict[str, Asset]  # by reflector name, joined with what they require
    surfaces: Asset | None  # the scene's surface radiance, where the method draws it
    folder: Path | None = None  # where they lie


def assets_for(
    scene: bpy.types.Scene, snapshot: SceneSnapshot, method: str, out: Path, settings: dict | None, progress, given: Path | None = None
) -> Baked:
    """The assets of one method: those in the folder `given`, or without one baked where they are missing or stale.

    Other settings of the bake than the defaults are baked below `out`, so that they do not replace what the user baked; so are all
    when the .blend was never saved or lies in a folder that cannot be written.
    """
    if given is not None:
        return _fresh_in(given, snapshot, method)
    beside = assets_of(scene)
    use_beside = bool(bpy.data.filepath) and all(is_drawn(method, name) for name in settings or ()) and _writable(beside)
    folder = beside if use_beside else Path(out) / "assets" / file_name(scene.name)
    if method == AUTO:
        bake_auto(scene, snapshot, folder, settings=settings, progress=progress)
    else:
        bake_assets(snapshot, (method,), folder, settings=settings, tracer=partial(trace, scene=scene), progress=progress)
    return baked_in(folder, snapshot, method)


def baked_in(folder: Path, snapshot: SceneSnapshot, method: str) -> Baked:
    """What lies in a folder."""
    assets = load_assets(snapshot, method, folder)
    return Baked(assets, load_surfaces(method, folder) if assets else None, folder)


def complete_in(folder: Path, snapshot: SceneSnapshot, method: str) -> Baked:
    """What lies in a folder, for every reflector. ReflectError names those that have none there."""
    baked = baked_in(folder, snapshot, method)
    if missing := [i.name for i in snapshot.reflectors() if asset_of(baked.assets, i) is None]:
        raise ReflectError(
            f"{folder} has no {method} asset of {', '.join(missing)}.",
            f"Make it with: reflect bake FILE.blend --methods {method} --out {folder}.",
        )
    return baked


def _fresh_in(folder: Path, snapshot: SceneSnapshot, method: str) -> Baked:
    baked = complete_in(folder, snapshot, method)
    if old := [name for name, asset in baked.assets.items() if is_stale(snapshot, asset)]:
        raise ReflectError(f"In {folder} the {method} asset of {', '.join(old)} is old: the scene has changed since.", "Bake again, or leave --assets out.")
    return baked


def _writable(folder: Path) -> bool:
    while not os.path.lexists(folder):
        folder = folder.parent
    return os.access(folder, os.W_OK)
