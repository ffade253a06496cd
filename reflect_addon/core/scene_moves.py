"""What is elsewhere than in the last snapshot, as balls: what cube maps that are kept between frames are stale by (map_updates.py).

Something that moved is a ball around where it was and where it is. It moved as far as its farthest corner did; something that came, went or took
another shape of other corners changed all over. Light and materials are not places: where they differ everything changed.
Limits. A thing whose light changes because another moved (a shadow) has not moved, and surface radiance, which is what maps show, is as old
as its bake anyway.
"""

import numpy as np

from .map_updates import Moved
from .snapshot import Instance, SceneSnapshot


def moved_between(before: SceneSnapshot, now: SceneSnapshot) -> tuple[Moved, ...]:
    """What mirrors show and is elsewhere, lamps included."""
    old, new = ({i.name: i for i in (*scene.instances, *scene.lamps) if i.visible_glossy} for scene in (before, now))
    found = []
    for name in old.keys() | new.keys():
        one, other = old.get(name), new.get(name)
        if one is None or other is None or not _same(before, one, now, other):
            found.append(_moved(name, [s.world_positions(i) for s, i in ((before, one), (now, other)) if i is not None]))
    return tuple(m for m in found if m is not None)


def all_changed(before: SceneSnapshot, now: SceneSnapshot) -> bool:
    """Whether light or materials differ."""
    return before.materials != now.materials or before.light_hash != now.light_hash


def _same(before: SceneSnapshot, one: Instance, now: SceneSnapshot, other: Instance) -> bool:
    same_place = np.array_equal(one.world_from_object, other.world_from_object)
    return same_place and before.meshes[one.mesh].key == now.meshes[other.mesh].key


def _moved(name: str, places: list[np.ndarray]) -> Moved | None:
    """places: (V, 3) of its corners, once or twice."""
    corners = np.concatenate(places)
    corners = corners[np.isfinite(corners).all(-1)]
    if not len(corners):
        return None
    low, high = corners.min(0), corners.max(0)
    center = low / 2 + high / 2
    radius = float(np.linalg.norm(corners - center, axis=1).max())
    far = radius
    if len(places) == 2 and places[0].shape == places[1].shape:
        apart = np.linalg.norm(places[1] - places[0], axis=1)
        far = float(np.nanmax(apart, initial=0.0))
    return Moved(center, radius, far, name)
