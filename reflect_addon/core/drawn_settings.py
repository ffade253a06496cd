"""Settings of methods that decide only how a baked asset is drawn: they make nothing old, and take effect at once.

Problem. All settings of a method stand in one list, and an asset remembers those it was baked with. How deep mirrors in mirrors go is asked
for in the same place as how finely the sky is traced, but only the second needs another bake.
Idea. A `Setting` says that it is `drawn` (core/settings.py). Such settings are left out of what an asset's content depends on; where an asset is
drawn, those that are asked for now take the place of those that it remembers.
"""

from dataclasses import replace

from . import methods, settings
from .asset import Asset


def is_drawn(kind: str, name: str) -> bool:
    """Whether a setting of a method decides only what is drawn."""
    return kind in methods.names() and settings.of(methods.get(kind), name).drawn


def baked_settings(kind: str, asked: dict[str, object]) -> dict[str, object]:
    """Of a method's settings those that its assets depend on. (`live` adds surfaces beside an asset and changes nothing in it.)"""
    return {name: value for name, value in asked.items() if name != "live" and not is_drawn(kind, name)}


def drawn_with(asset: Asset, asked: dict[str, object]) -> Asset:
    """The asset, drawn as is asked for now: with the values of `asked` in its settings, and in those of its options that have the same
    name. It shares its images; the same object where nothing differs."""
    new = {name: value for name, value in asked.items() if is_drawn(asset.kind, name) and asset.settings.get(name) != value}
    if not new:
        return asset
    options = {name: value for name, value in new.items() if name in asset.options}
    return replace(asset, settings={**asset.settings, **new}, options={**asset.options, **options})
