"""Bake methods for the reflectors of a scene, and find what was baked: the one path of the worker, the command line
and tests."""

import hashlib
import json
import os
import shutil
import time
from collections.abc import Callable, Collection
from dataclasses import replace
from functools import cache, partial
from pathlib import Path

from ..core import methods, surface_asset, surface_radiance
from ..core.asset import Asset
from ..core.asset_files import is_fresh, load_asset, save_asset
from ..core.asset_places import asset_name
from ..core.bake_lock import one_bake_at_a_time
from ..core.drawn_settings import drawn_with
from ..core.errors import ReflectError
from ..core.job import BakeJob
from ..core.progress import Progress, Stages, teller
from ..core.refresh import balls_of
from ..core.scene_items import OWN, PRESENT, digest, radiance
from ..core.snapshot import Instance, SceneSnapshot
from ..core.unfinished import PREFIX, Unfinished
from .freshness import has_settings, inputs_hash, inputs_of, remarks, remembering, settings_for
from .intersect import intersector
from .load import answering, draws_surfaces, load_kind
from .raytrace import trace
from .ways import camera_way, ways

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
    own_settings: dict[str, dict[str, object]] | None = None,
    tracer: Callable = trace,
    progress: Progress | None = None,
    again: bool = False,
    only: Collection[tuple[str, str]] | None = None,
) -> list[Path]:
    """Bakes the wanted methods (and what they require) for the named reflectors, all of them when none is named.

    Assets go to folder/<kind>-<reflector>; those that are fresh stay, and remember what is asked for now of how they are drawn, unless
    `again`, which takes nothing over from an earlier bake. With a method's setting `live` the surfaces of what may move are baked too, for a method that draws
    surfaces all that it draws (folder/surface_radiance-all). settings override the methods' defaults where a method has
    such a setting; own_settings, by a reflector's name, those for it alone. only: (kind, reflector's name) of those that are baked, and all that they
    require, where it is not all (bake_part.py). progress(done in 0..1, text) may return False to cancel. Returns the folders of all assets asked
    for. ReflectError: no reflector, an unknown name, a disk that refuses.
    """
    chosen = chosen_reflectors(scene, reflectors)
    kinds = methods.with_required(tuple(wanted))
    tell = teller(progress, "The bake")
    shared: dict = {}
    intersect, bounds, camera_bounds, balls = intersector(scene), ways(scene), cache(partial(camera_way, scene)), cache(partial(balls_of, scene))
    made: dict[Path, Asset | None] = {}  # in order; kept in memory where other reflectors share it
    followed: set[str] = set()  # instances whose stand-ins are captured again when they move
    steps = len(chosen) * len(kinds) + 1
    for index, reflector in enumerate(chosen):
        done: dict[str, Asset] = {}
        for step, kind in enumerate(kinds):
            if only is not None and (kind, reflector.name) not in only:
                continue
            asked = settings_for(kind, {**(settings or {}), **(own_settings or {}).get(reflector.name, {})})
            together = chosen if asked.get("shared") else ()
            path = Path(folder) / asset_name(kind, "" if together else reflector.name)
            of, required = together or (reflector,), _required(kind, done)
            items = inputs_of(scene, kind, of, required.values())
            inputs = inputs_hash(items, kind, [r.name for r in of], asked)
            start, share = (index * len(kinds) + step) / steps, 1 / steps
            text = f"{methods.get(kind).LABEL} of {'all' if together else reflector.name}"
            tell(start, text)
            asset, earlier = made.get(path), None
            if asset is None and not again:
                earlier = _readable(path, kind)
                asset = earlier if _serves(earlier, scene, inputs, required, path) else None
                if asset is not None and (asset := drawn_with(earlier, asked)) is not earlier:
                    save_asset(asset, path)
            if asset is None:
                began = time.perf_counter()
                stages = Stages(lambda s, t, start=start, share=share, text=text: tell(start + share * s, text + t))

                def traced(rays, hide=(), samples=1, stages=stages, **parts):
                    return tracer(rays, hide, samples, progress=lambda p, _: stages.tell(p), **parts)

                unfinished = Unfinished(Path(folder) / f"{PREFIX}{path.name}", f"{inputs} {again}")
                job = BakeJob(
                    scene, reflector, traced, intersect, asked, required, shared, together, bounds,
                    camera_bounds, earlier if _goes_on(earlier, asked) else None, unfinished, stages.set,
                )  # fmt: skip
                asset = replace(methods.get(kind).bake(job), bake_seconds=time.perf_counter() - began)
                asset = remembering(asset, scene, items, balls())
                save_asset(asset, path)
                unfinished.clear()
                for other in together:  # one asset is for all from now on
                    shutil.rmtree(Path(folder) / asset_name(kind, other.name), ignore_errors=True)
            done[kind], made[path] = asset, asset if together else None
            if asked.get("live"):
                followed |= {part.instance for part in asset.parts if part.kind in CAPTURED}
            if draws_surfaces(kind):
                followed |= {part.instance for part in asset.parts if part.kind == "surface"}
    if followed:
        text, start = "Surfaces that may move", (steps - 1) / steps

        def traced_last(rays, hide=(), samples=1):
            return tracer(rays, hide, samples, progress=lambda p, _: tell(start + p / steps, text))

        tell(start, text)
        finest = {name: value for kind in kinds for name, value in getattr(methods.get(kind), "SURFACES", {}).items()}
        _bake_surfaces(scene, followed, Path(folder), finest, settings, traced_last, again)
    tell(1.0, "Baked")
    return list(made)


def _bake_surfaces(scene: SceneSnapshot, names: set[str], folder: Path, finest: dict, settings, tracer, again: bool) -> None:
    """The surface radiance of these instances, and of those that an earlier bake of the same scene had; kept when fresh, or when a
    method that draws surfaces (`finest`: its settings for them) had it made finer."""
    path = folder / asset_name(surface_asset.KIND, "")
    asked = {**surface_radiance.DEFAULTS, **finest, **{k: v for k, v in (settings or {}).items() if k in surface_radiance.DEFAULTS}}
    try:
        earlier = load_asset(path) if os.path.isfile(path / "asset.json") else None
    except ReflectError:
        earlier = None  # damaged: baked again
    if earlier is not None and not finest:
        finer = {k: v for m in methods.all_methods() for k, v in getattr(m, "SURFACES", {}).items()}
        asked |= finer if finer.items() <= earlier.settings.items() else {}
    content = {**radiance(scene), OWN: {r.name: PRESENT for r in scene.reflectors()}}  # whose surfaces mirror, a mark says, too
    words = [digest(content), surface_asset.KIND, json.dumps(asked, sort_keys=True)]
    inputs = hashlib.sha256("\0".join(words).encode("utf-8", "surrogatepass")).hexdigest()
    if earlier is not None and is_fresh(earlier, inputs):
        known = {part.instance for part in earlier.parts}
        if names <= known and not again:
            return
        names = names | known
    began = time.perf_counter()
    chosen = tuple(i for i in (*scene.instances, *scene.lamps) if i.name in names)
    asset = surface_radiance.bake(scene, tracer, chosen, asked)
    save_asset(replace(asset, inputs_hash=inputs, bake_seconds=time.perf_counter() - began), path)


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


def _required(kind: str, done: dict[str, Asset]) -> dict[str, Asset]:
    return {required: done[required] for required in methods.get(kind).REQUIRES}


def _serves(asset: Asset | None, scene: SceneSnapshot, inputs: str, required: dict[str, Asset], path: Path) -> bool:
    """Whether the asset on disk can be used as it is; a missing, damaged or stale one is baked again."""
    if asset is None or not is_fresh(asset, inputs) or remarks(asset, scene):
        return False
    try:
        answering(asset, list(required.values()), path)
    except ReflectError:
        return False
    return True


def _goes_on(earlier: Asset | None, settings: dict) -> bool:
    """Whether a bake with these settings may take over what it can of an earlier one."""
    if earlier is None or not getattr(methods.get(earlier.kind), "GOES_ON", False):
        return False
    return has_settings(earlier, settings) and earlier.settings.keys() == settings.keys()


def _readable(path: Path, kind: str) -> Asset | None:
    """The asset on disk; None where there is none or it is damaged."""
    if not os.path.isfile(path / "asset.json"):
        return None
    try:
        return load_kind(path, kind)
    except ReflectError:
        return None
