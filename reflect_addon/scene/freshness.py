"""Whether an asset is still of the scene as it is, and of the settings that are asked for."""

import hashlib
import json

from ..core import methods
from ..core.asset import Asset
from ..core.asset_files import is_fresh
from ..core.remake import REFLECTOR
from ..core.snapshot import Instance, SceneSnapshot


def is_stale(scene: SceneSnapshot, asset: Asset) -> bool:
    """Whether the scene is no longer what the asset was baked from."""
    names = {asset.reflector} if asset.reflector else {part.instance for part in asset.parts if part.kind == REFLECTOR}
    reflectors = tuple(r for r in scene.reflectors() if r.name in names)
    fresh = len(reflectors) == len(names) and is_fresh(asset, inputs_hash(scene, asset.kind, reflectors, asset.settings))
    return not fresh or any(remark(asset, scene, r) for r in reflectors)


def remark(asset: Asset, scene: SceneSnapshot, reflector: Instance) -> str:
    """What there is to say of an asset and where its reflector is now, as a sentence; "" when all is well."""
    says = getattr(methods.get(asset.kind), "remark", None)
    return says(asset, scene, reflector) if says else ""


def settings_for(kind: str, overrides: dict[str, object] | None) -> dict[str, object]:
    """The method's defaults with those overrides that it has, or that its required methods' bake shares."""
    defaults = methods.get(kind).DEFAULTS
    return {**defaults, **{k: v for k, v in (overrides or {}).items() if k in defaults}}


def has_settings(asset: Asset, overrides: dict[str, object]) -> bool:
    """Whether a bake with these overrides would ask for what this asset was baked with. (`live`, and a setting that an asset
    of an earlier version does not know, change nothing in it.)"""
    asked = settings_for(asset.kind, overrides)
    return all(value == asked[name] for name, value in asset.settings.items() if name in asked and name != "live")


def inputs_hash(scene: SceneSnapshot, kind: str, reflectors: tuple[Instance, ...], settings: dict) -> str:
    """sha256 over everything that the content of an asset for these reflectors depends on. (`live` adds surfaces beside it and
    changes nothing.)"""
    settings = {name: value for name, value in settings.items() if name != "live"}
    own = getattr(methods.get(kind), "inputs", None)
    content = own(scene, reflectors) if own else scene.geometry_hash
    if not content:
        return ""
    parts = [content, kind, *(r.name for r in reflectors), json.dumps(settings, sort_keys=True, default=str)]
    return hashlib.sha256("\0".join(parts).encode("utf-8", "surrogatepass")).hexdigest()
