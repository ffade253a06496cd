"""Whether an asset is still of the scene as it is, and of the settings that are asked for; if not, why, and what making it again costs."""

import hashlib
import json
from collections.abc import Callable, Iterable
from dataclasses import replace

from ..core import methods, scene_items
from ..core.asset import Asset
from ..core.asset_files import is_fresh
from ..core.drawn_settings import baked_settings
from ..core.refresh import Ball, Refresh, error
from ..core.remake import REFLECTOR
from ..core.scene_items import REQUIRED, Items
from ..core.snapshot import Instance, SceneSnapshot
from ..core.staleness import Change, changes

# Instances of which an asset keeps what they were: asset.json must stay small. Of more, it tells whether something changed, and not what.
MOST_KEPT = 4000


def is_stale(scene: SceneSnapshot, asset: Asset) -> bool:
    """Whether the scene is no longer what the asset, or one that it was joined with, was baked from. (No camera makes an asset stale.)"""
    seen = replace(scene, camera=None)
    return any(not is_fresh(one, inputs_now(scene, one, asset.beside)) or remarks(one, seen) for one in (asset, *asset.beside))


def inputs_now(scene: SceneSnapshot, asset: Asset, beside: Iterable[Asset] = ()) -> str:
    """inputs_hash of the asset's reflectors as the scene is; "" where one of them is gone. beside: among them those that its method requires."""
    return inputs_hash(items_now(scene, asset, beside), asset.kind, _names_in_order(scene, asset), asset.settings)


def items_now(scene: SceneSnapshot, asset: Asset, beside: Iterable[Asset] = ()) -> Items:
    """What the asset would be baked from now; {} where one of its reflectors is gone."""
    names = _names(asset)
    reflectors = tuple(r for r in scene.reflectors() if r.name in names)
    return inputs_of(scene, asset.kind, reflectors, beside) if len(reflectors) == len(names) else {}


def why_stale(scene: SceneSnapshot, asset: Asset, beside: Iterable[Asset] = ()) -> tuple[Change, ...]:
    """What changed since the asset was baked; () while nothing did. One that keeps no items, or whose reflector is gone, cannot say what."""
    items = items_now(scene, asset, beside)
    if is_fresh(asset, inputs_hash(items, asset.kind, _names_in_order(scene, asset), asset.settings)):
        return ()
    return changes(asset.items if items else {}, items, scene)


def refresh_of(scene: SceneSnapshot, reflector: Instance, found: Iterable[Asset], balls: Callable[[], dict[str, Ball]]) -> Refresh | None:
    """Why those of a reflector's assets that are old are it, and what a bake of them costs; None where none is. balls() is refresh.balls_of(scene)."""
    found, seen = list(found), replace(scene, camera=None)
    reasons, seconds, errors = [], 0.0, [0.0]
    for asset in found:
        old, said = why_stale(scene, asset, found), remark(asset, seen, reflector)
        if not old and not said:
            continue
        reasons += [*(change.sentence for change in old), *([said.rstrip(".")] if said else [])]
        seconds += asset.bake_seconds - sum(one.bake_seconds for one in asset.beside)
        errors.append(1.0 if said else error(old, asset.balls, balls(), reflector, scene))
    return Refresh(reflector.name, tuple(dict.fromkeys(reasons)), seconds, max(errors)) if reasons else None


def remembering(asset: Asset, scene: SceneSnapshot, items: Items, balls: dict[str, Ball]) -> Asset:
    """The asset, of `scene` as it is: with the hash of these items, which it keeps to tell what changed."""
    inputs = inputs_hash(items, asset.kind, _names_in_order(scene, asset), asset.settings)
    few = len(scene.instances) <= MOST_KEPT
    return replace(asset, inputs_hash=inputs, items=scene_items.kept(items) if few else {}, balls=balls if few else {})


def remarks(asset: Asset, scene: SceneSnapshot) -> tuple[str, ...]:
    """Each remark on the asset's reflectors, once."""
    names = _names(asset)
    said = (remark(asset, scene, r) for r in scene.reflectors() if r.name in names)
    return tuple(dict.fromkeys(filter(None, said)))


def remark(asset: Asset, scene: SceneSnapshot, reflector: Instance) -> str:
    """What there is to say of an asset and where its reflector is now, as a sentence; "" when all is well."""
    says = getattr(methods.get(asset.kind), "remark", None)
    return says(asset, scene, reflector) if says else ""


def settings_for(kind: str, overrides: dict[str, object] | None) -> dict[str, object]:
    """The method's defaults with those overrides that it has, or that its required methods' bake shares."""
    defaults = methods.get(kind).DEFAULTS
    return {**defaults, **{k: v for k, v in (overrides or {}).items() if k in defaults}}


def has_settings(asset: Asset, overrides: dict[str, object]) -> bool:
    """Whether a bake with these overrides would ask for what this asset was baked with. (A setting that an asset of an earlier version
    does not know changes nothing in it.)"""
    asked = settings_for(asset.kind, overrides)
    return all(value == asked[name] for name, value in baked_settings(asset.kind, asset.settings).items() if name in asked)


def inputs_of(scene: SceneSnapshot, kind: str, reflectors: tuple[Instance, ...], beside: Iterable[Asset] = ()) -> Items:
    """All items that the content of an asset for these reflectors depends on; {} for a scene that is not known. beside: assets of what it requires."""
    method = methods.get(kind)
    items = getattr(method, "inputs", scene_items.radiance)(scene, reflectors)
    if not items or not getattr(method, "READS_REQUIRED", False):
        return items
    required = {one.kind: _settings_hash(one.kind, one.settings) for one in beside if one.kind in method.REQUIRES}
    return {**items, REQUIRED: required}


def inputs_hash(items: Items, kind: str, names: Iterable[str], settings: dict) -> str:
    """sha256 over everything that the content of an asset for the reflectors of these names depends on; "" where nothing is known."""
    content = scene_items.digest(items)
    if not content:
        return ""
    return _sha256("\0".join([content, kind, *names, _settings_hash(kind, settings)]))


def _settings_hash(kind: str, settings: dict) -> str:
    return _sha256(json.dumps(baked_settings(kind, settings), sort_keys=True, default=str))


def _sha256(text: str) -> str:
    return hashlib.sha256(text.encode("utf-8", "surrogatepass")).hexdigest()


def _names_in_order(scene: SceneSnapshot, asset: Asset) -> list[str]:
    names = _names(asset)
    return [r.name for r in scene.reflectors() if r.name in names]


def _names(asset: Asset) -> set[str]:
    """Of the reflectors that the asset was baked for."""
    return {asset.reflector} if asset.reflector else {part.instance for part in asset.parts if part.kind == REFLECTOR}
