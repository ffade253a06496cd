"""Bake methods for the reflectors of a scene, and find what was baked: the one path of the worker, the command line
and tests."""

import hashlib
import json
import os
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from ..core import methods, surface_asset, surface_radiance
from ..core.asset import Asset
from ..core.asset_files import BAKE_AGAIN, is_fresh, load_asset, save_asset
from ..core.asset_places import asset_name
from ..core.bake_lock import one_bake_at_a_time
from ..core.errors import ReflectError
from ..core.kernel import record
from ..core.job import BakeJob
from ..core.progress import Progress, teller
from ..core.snapshot import Instance, SceneSnapshot
from .intersect import intersector
from .raytrace import trace


# Kinds of stand-ins (core/remake.py) that are captured again when something moves or deforms. Flat things only move.
CAPTURED = {"volume", "mirror", "flat_mirror", "map", "mirror_map"}


@one_bake_at_a_time
def bake_assets(
    scene: SceneSnapshot,
    wanted: list[str] | tuple[str, ...],
    folder: Path,
    *,
    reflectors: list[str] | tuple[str, ...] = (),
    settings: dict[str, object] | None = None,
    tracer: Callable = trace,
    progress: Progress | None = None,
    again: bool = False,
) -> list[Path]:
    """Bakes the wanted methods (and what they require) for the named reflectors, all of them when none is named.

    Assets go to folder/<kind>-<reflector>; those that are fresh stay, unless `again`. With a method's setting `live` the
    surfaces of what may move are baked too (folder/surface_radiance-all). settings override the methods'
    defaults where a method has such a setting. progress(done in 0..1, text) may return False to cancel. Returns the
    folders of all assets asked for. ReflectError: no reflector, an unknown name, a disk that refuses.
    """
    chosen = chosen_reflectors(scene, reflectors)
    kinds = methods.with_required(tuple(wanted))
    tell = teller(progress, "The bake")
    shared: dict = {}
    intersect = intersector(scene)
    paths = []
    followed: set[str] = set()  # instances whose stand-ins are captured again when they move
    steps = len(chosen) * len(kinds) + 1
    for index, reflector in enumerate(chosen):
        done: dict[str, Asset] = {}
        for step, kind in enumerate(kinds):
            path = Path(folder) / asset_name(kind, reflector.name)
            asked = settings_for(kind, settings)
            inputs = inputs_hash(scene, kind, reflector, asked)
            start, share = (index * len(kinds) + step) / steps, 1 / steps
            text = f"{methods.get(kind).LABEL} of {reflector.name}"
            tell(start, text)
            asset = None if again else _fresh(path, kind, inputs, _required(kind, done))
            if asset is None:
                began = time.perf_counter()

                def traced(rays, hide=(), samples=1, start=start, text=text, **parts):
                    return tracer(rays, hide, samples, progress=lambda p, _: tell(start + share * p, text), **parts)

                job = BakeJob(scene, reflector, traced, intersect, asked, _required(kind, done), shared)
                asset = replace(
                    methods.get(kind).bake(job), inputs_hash=inputs, bake_seconds=time.perf_counter() - began
                )
                save_asset(asset, path)
            done[kind] = asset
            paths.append(path)
            if asked.get("live"):
                followed |= {part.instance for part in asset.parts if part.kind in CAPTURED}
    if followed:
        text, start = "Surfaces that may move", (steps - 1) / steps

        def traced_last(rays, hide=(), samples=1):
            return tracer(rays, hide, samples, progress=lambda p, _: tell(start + p / steps, text))

        tell(start, text)
        _bake_surfaces(scene, followed, Path(folder), settings, traced_last, again)
    tell(1.0, "Baked")
    return paths


def _bake_surfaces(scene: SceneSnapshot, names: set[str], folder: Path, settings, tracer, again: bool) -> None:
    """The surface radiance of these instances, and of those that an earlier bake of the same scene had; kept when fresh."""
    path = folder / asset_name(surface_asset.KIND, "")
    asked = {**surface_radiance.DEFAULTS, **{k: v for k, v in (settings or {}).items() if k in surface_radiance.DEFAULTS}}
    words = [scene.geometry_hash, surface_asset.KIND, json.dumps(asked, sort_keys=True)]
    inputs = hashlib.sha256("\0".join(words).encode("utf-8", "surrogatepass")).hexdigest()
    try:
        earlier = load_asset(path) if os.path.isfile(path / "asset.json") else None
    except ReflectError:
        earlier = None  # damaged: baked again
    if earlier is not None and is_fresh(earlier, inputs):
        known = {part.instance for part in earlier.parts}
        if names <= known and not again:
            return
        names = names | known
    began = time.perf_counter()
    chosen = tuple(i for i in (*scene.instances, *scene.lamps) if i.name in names)
    asset = surface_radiance.bake(scene, tracer, chosen, asked)
    save_asset(replace(asset, inputs_hash=inputs, bake_seconds=time.perf_counter() - began), path)


def load_assets(scene: SceneSnapshot, method: str, folder: Path) -> dict[str, Asset]:
    """Reflector name -> asset joined with what it requires, for every reflector that has one on disk.

    Damaged assets raise ReflectError; reflectors that were never baked are simply missing from the result.
    """
    found = {}
    for reflector in scene.reflectors():
        paths = [Path(folder) / asset_name(kind, reflector.name) for kind in (method, *methods.get(method).REQUIRES)]
        if all(os.path.isfile(path / "asset.json") for path in paths):
            kinds = (method, *methods.get(method).REQUIRES)
            own, *others = [_load(path, kind) for path, kind in zip(paths, kinds, strict=True)]
            found[reflector.name] = answering(own, others, paths[0])
    return found


def is_stale(scene: SceneSnapshot, asset: Asset) -> bool:
    """Whether the scene is no longer what the asset was baked from."""
    reflector = next((r for r in scene.reflectors() if r.name == asset.reflector), None)
    return reflector is None or not is_fresh(asset, inputs_hash(scene, asset.kind, reflector, asset.settings))


def chosen_reflectors(scene: SceneSnapshot, names: list[str] | tuple[str, ...]) -> tuple[Instance, ...]:
    """The reflectors of these objects, or all. ReflectError when there is none or a name is not one of them."""
    everything = scene.reflectors()
    if not everything:
        left_out = "".join(f" {warning}" for warning in scene.warnings[:3])  # often the very one that was meant
        raise ReflectError(
            f"The scene '{scene.scene_name}' has no reflector.{left_out}",
            "Give an object with faces a metallic or glossy material of low roughness, or mark it as a reflector.",
        )
    known = {i.object_name for i in everything} | {i.name for i in everything}
    for name in names:
        if name not in known:
            why = "".join(f" {warning}" for warning in scene.warnings if warning.startswith(f"{name} "))
            raise ReflectError(
                f"The object '{name}' is not a reflector of the scene '{scene.scene_name}'.{why}",
                f"Reflectors are: {', '.join(sorted({i.object_name for i in everything}))}.",
            )
    return tuple(i for i in everything if not names or i.name in names or i.object_name in names)


def settings_for(kind: str, overrides: dict[str, object] | None) -> dict[str, object]:
    """The method's defaults with those overrides that it has, or that its required methods' bake shares."""
    defaults = methods.get(kind).DEFAULTS
    return {**defaults, **{k: v for k, v in (overrides or {}).items() if k in defaults}}


def has_settings(asset: Asset, overrides: dict[str, object]) -> bool:
    """Whether a bake with these overrides would ask for what this asset was baked with. (`live`, and a setting that an asset
    of an earlier version does not know, change nothing in it.)"""
    asked = settings_for(asset.kind, overrides)
    return all(value == asked[name] for name, value in asset.settings.items() if name in asked and name != "live")


def inputs_hash(scene: SceneSnapshot, kind: str, reflector: Instance, settings: dict) -> str:
    """sha256 over everything that the content of an asset depends on. (`live` adds surfaces beside it and changes nothing.)"""
    settings = {name: value for name, value in settings.items() if name != "live"}
    parts = [scene.geometry_hash, kind, reflector.name, json.dumps(settings, sort_keys=True, default=str)]
    return hashlib.sha256("\0".join(parts).encode("utf-8", "surrogatepass")).hexdigest()


def _load(path: Path, kind: str) -> Asset:
    """The asset in the folder, which must be of this kind."""
    asset = load_asset(path)
    if asset.kind != kind:
        raise ReflectError(f"{path} is an asset of {asset.kind}, not of {kind}.", BAKE_AGAIN)
    return asset


def answering(own: Asset, others: list[Asset], path: Path) -> Asset:
    """The asset joined with those it requires, when it has all that its kernel asks for: a whole asset of another version
    or program may not."""
    try:
        asset = own.joined(*others)
        record(methods.get(own.kind).trace, asset)
    except (KeyError, ValueError, TypeError) as error:
        raise ReflectError(f"{path} lacks what {own.kind} needs ({error}).", BAKE_AGAIN) from error
    return asset


def _required(kind: str, done: dict[str, Asset]) -> dict[str, Asset]:
    return {required: done[required] for required in methods.get(kind).REQUIRES}


def _fresh(path: Path, kind: str, inputs: str, required: dict[str, Asset]) -> Asset | None:
    """The asset on disk when it can be used as it is; a missing, damaged or stale one is baked again."""
    if not os.path.isfile(path / "asset.json"):
        return None
    try:
        asset = _load(path, kind)
        answering(asset, list(required.values()), path)
    except ReflectError:
        return None
    return asset if is_fresh(asset, inputs) else None
