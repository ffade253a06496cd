"""What loaded assets are to the scene as a window sees it now: missing, old, out of place, or baked with other settings."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache, partial

import bpy

from ..core.asset import Asset
from ..core.refresh import Refresh, balls_of
from ..core.snapshot import SceneSnapshot
from .freshness import refresh_of, remark
from .load import draws_surfaces
from .loaded import Loaded
from .properties import by_hand


@dataclass(frozen=True)
class Compared:
    """Names are reflectors'."""

    missing: tuple[str, ...] = ()  # without assets
    other_settings: tuple[str, ...] = ()  # whose assets were baked with others than are set now
    refreshes: dict[str, Refresh] = field(default_factory=dict)  # whose assets were baked from another state of the scene
    remarks: dict[str, str] = field(default_factory=dict)  # why an asset no longer serves its reflector where it is, as a sentence


def compare(
    scene: bpy.types.Scene, snapshot: SceneSnapshot, loaded: Loaded, asked: dict[str, object], as_seen: Callable[[Asset], Asset]
) -> Compared:
    """as_seen(asset): the asset as if it were made of what the window saw when its bake started."""
    missing, other, refreshes, remarks = [], [], {}, {}
    balls, chosen = cache(partial(balls_of, snapshot)), by_hand(scene, snapshot.reflectors())
    for reflector in snapshot.reflectors():
        kinds = loaded.kinds(reflector.name)
        found = [loaded.asset(kind, reflector.name) for kind in kinds]
        if not found or None in found or (loaded.surfaces is None and any(map(draws_surfaces, kinds))):
            missing.append(reflector.name)
            continue
        if said := " ".join(filter(None, (remark(asset, snapshot, reflector) for asset in found))):
            remarks[reflector.name] = said
        if refresh := refresh_of(snapshot, reflector, [as_seen(asset) for asset in found], balls):
            refreshes[reflector.name] = refresh
        if not loaded.is_as_asked(reflector.name, found, asked, chosen.get(reflector.object_name)):
            other.append(reflector.name)
    return Compared(tuple(missing), tuple(other), refreshes, remarks)
