"""The other side of an A/B wipe: a second method's assets, beside those of the scene's own, loaded when they are asked for."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import bpy

from ..core import methods, surface_asset
from ..core.asset import Asset
from ..core.asset_places import asset_name
from ..core.drawn_settings import drawn_with
from ..core.errors import ReflectError
from ..core.focus import refocused
from ..core.planning.plan import FILE_NAME
from ..core.snapshot import SceneSnapshot
from .load import PLANNED, draws_surfaces, load_assets, load_surfaces
from .view_truth import ViewTruth

TRUTH, TRUTH_LABEL = "TRUTH", "Truth"  # stands among the methods' names


@dataclass
class Wipe:
    """What is shown right of the line, and where that is."""

    method: str
    assets: dict[str, Asset]  # joined, by reflector
    surfaces: Asset | None
    place: float = 0.5  # of a 3D view's width, 0 is left
    truth: ViewTruth | None = None  # in place of a method's answers


def truth_wipe(truth: ViewTruth) -> Wipe:
    return Wipe(TRUTH, {}, None, truth=truth)


def start_wipe(scene: bpy.types.Scene, snapshot: SceneSnapshot, folder: Path, method: str) -> Wipe:
    """folder: of the scene's assets. ReflectError where they are damaged, or serve no reflector that is there."""
    settings = scene.reflect
    assets = load_assets(snapshot, method, folder)
    asked = {name: value for kind in methods.with_required([method]) for name, value in settings.settings_of(kind).items()}
    drawn = {id(asset): drawn_with(asset, asked) for asset in assets.values()}
    found = refocused({name: drawn[id(asset)] for name, asset in assets.items()}, settings.focus_distance)
    if not found:
        raise ReflectError(f"{folder} has no {methods.get(method).LABEL} assets of reflectors that are there.", "Choose that method and bake.")
    return Wipe(method, found, load_surfaces(method, folder))


def baked_methods(folder: Path) -> Iterator[str]:
    """Names of the methods that have assets in a folder, `auto` first; by the folders' names alone."""
    kinds = {path.name.partition("-")[0] for path in folder.iterdir()} if folder.is_dir() else set()
    if (folder / PLANNED / FILE_NAME).is_file():
        yield methods.AUTO
    surfaces = (folder / asset_name(surface_asset.KIND, "")).is_dir()
    for name in methods.names():
        if kinds.issuperset(methods.with_required([name])) and (surfaces or not draws_surfaces(name)):
            yield name
