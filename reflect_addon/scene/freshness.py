"""Whether an asset is still of the scene as it is, and of the settings that are asked for."""

import hashlib
import json

from ..core import methods
from ..core.asset import Asset
from ..core.asset_files import is_fresh
from ..core.drawn_settings import baked_settings
from ..core.remake import REFLECTOR
from ..core.snapshot import Instance, SceneSnapshot


def is_stale(scene: SceneSnapshot, asset: Asset) -> bool:
    """Whether the scene is no longer what the asset was baked from."""
    return not is_fresh(asset, inputs_now(scene, asset)) or bool(remarks(asset, scene))


def inputs_now(scene: SceneSnapshot, asset: Asset) -> str:
    """inputs_hash of the asset's reflectors as the scene is; "" where one of them is gone."""
    names = _names(asset)
    reflectors = tuple(r for r in scene.reflectors() if r.name in names)
    return inputs_hash(scene, asset.kind, reflectors, asset.settings) if len(reflectors) == len(names) else ""


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


def inputs_hash(scene: SceneSnapshot, kind: str, reflectors: tuple[Instance, ...], settings: dict) -> str:
    """sha256 over everything that the content of an asset for these reflectors depends on."""
    own = getattr(methods.get(kind), "inputs", None)
    content = own(scene, reflectors) if own else scene.geometry_hash
    if not content:
        return ""
    parts = [content, kind, *(r.name for r in reflectors), json.dumps(baked_settings(kind, settings), sort_keys=True, default=str)]
    return hashlib.sha256("\0".join(parts).encode("utf-8", "surrogatepass")).hexdigest()


def _names(asset: Asset) -> set[str]:
    """Of the reflectors that the asset was baked for."""
    return {asset.reflector} if asset.reflector else {part.instance for part in asset.parts if part.kind == REFLECTOR}
