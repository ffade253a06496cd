"""The distance that assets are focused on, changed after their bake: for methods with `focused` (core/methods/__init__.py)."""

from . import methods
from .asset import Asset


def can_focus(kind: str) -> bool:
    """Whether assets of this kind have a focal plane."""
    return kind in methods.names() and hasattr(methods.get(kind), "focused")


def refocused(assets: dict[str, Asset], distance: float) -> dict[str, Asset]:
    """Assets by reflector, those that can focused on `distance` m from their middle (0: as baked); what several share, they
    share afterwards."""
    new = {id(a): methods.get(a.kind).focused(a, distance) if can_focus(a.kind) else a for a in assets.values()}
    return {name: new[id(asset)] for name, asset in assets.items()}
