"""Assets for an evaluation: those beside the .blend when they are fresh, else baked and kept."""

import os
from pathlib import Path

import bpy

from ..core import methods as registry
from ..core.asset import Asset
from ..core.errors import ReflectError
from ..core.snapshot import SceneSnapshot
from ..scene.places import assets_of


def assets_for(
    scene: bpy.types.Scene, snapshot: SceneSnapshot, method: str, out: Path, settings: dict | None, progress
) -> dict[str, Asset]:
    """reflector object name -> asset of one method, joined with what it requires.

    Other settings than the defaults are baked below `out`, so that they do not replace what the user baked.
    """
    from ..scene.bake import bake_assets, load_assets
    from ..scene.raytrace import trace

    beside = assets_of(scene)
    parent = beside if beside.exists() else beside.parent
    while not parent.exists():
        parent = parent.parent
    folder = beside if not settings and bpy.data.filepath and os.access(parent, os.W_OK) else Path(out) / "assets"
    wanted = {i.object_name for i in snapshot.reflectors()}
    try:
        found = load_assets(folder, method, snapshot)
    except ReflectError as error:
        progress(0.0, f"baking again: {error.message}")
        found = {}
    fresh = {
        name
        for name, asset in found.items()
        if asset.inputs_hash == snapshot.geometry_hash and _as_asked(asset, method, settings)
    }
    if not wanted <= fresh and "" not in fresh:
        progress(0.0, "baking")

        def bound(rays, **more):
            return trace(rays, scene=scene, **more)

        bake_assets(snapshot, registry.with_required((method,)), None, folder, bound, progress, **_given(settings))
        found = load_assets(folder, method, snapshot)
    return found


def _as_asked(asset: Asset, method: str, settings: dict | None) -> bool:
    asked = {**registry.get(method).DEFAULTS, **(settings or {})}
    return all(asset.settings.get(k, v) == v for k, v in asked.items())


def _given(settings: dict | None) -> dict:
    return {"settings": settings} if settings else {}
