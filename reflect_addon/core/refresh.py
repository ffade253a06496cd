"""What making an old asset again costs and is worth, and which reflector is next.

Problem. Of many old reflectors the one whose picture is wrong most should be made first, and not what takes longer than there is time.
Idea. The cost is what the last bake took. The error is the share of what the reflector sees that changed things take up, before and after; of a world,
a lamp or the reflector itself all of it. Nothing is traced for it.
Where we guess. Spheres around boxes stand for things, in front of each other or not; the shadow and light that a thing casts elsewhere is not counted:
it is made again as well, only not first.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from . import scene_items as aspects
from .snapshot import Instance, SceneSnapshot
from .staleness import Change

Ball = tuple[float, float, float, float]  # centre, world, m; radius, m


@dataclass(frozen=True)
class Refresh:
    """A reflector whose assets are old."""

    reflector: str
    reasons: tuple[str, ...]  # sentences without capital and full stop
    seconds: float  # that the last bakes of what is old took
    error: float  # 0..1, share of what it sees that is wrong, about

    def sentence(self) -> str:
        """'Ball: Cube was moved; about 4 s to bake.'"""
        said = "; ".join(self.reasons[:3]) + (f" and {len(self.reasons) - 3} more" if len(self.reasons) > 3 else "")
        return f"{self.reflector}: {said}; about {duration(self.seconds)} to bake."


def duration(seconds: float) -> str:
    if seconds < 1:
        return "1 s"
    return f"{seconds:.0f} s" if seconds < 100 else f"{seconds / 60:.0f} min"


def balls_of(scene: SceneSnapshot) -> dict[str, Ball]:
    """The sphere around the box of each instance."""
    found = {}
    for instance in scene.instances:
        low, high = scene.bounds([instance])
        found[instance.name] = (*map(float, (low + high) / 2), float(np.linalg.norm(high - low) / 2))
    return found


def error(changes: Iterable[Change], before: Mapping[str, Ball], now: Mapping[str, Ball], reflector: Instance, scene: SceneSnapshot) -> float:
    """0..1. before: spheres as an asset keeps them; now: balls_of(scene). What nobody knows counts as everything."""
    of = {c.name for c in changes if c.aspect != aspects.MATERIAL}
    if any(c.is_everywhere() for c in changes) or reflector.name in of:
        return 1.0
    changed = {c.name for c in changes if c.aspect == aspects.MATERIAL}
    of |= {i.name for i in scene.instances if changed & {scene.materials[m].name for m in i.materials}}
    eye = np.array(now[reflector.name][:3])
    seen = {ball for name in of for ball in (before.get(name), now.get(name)) if ball and name != reflector.name}
    return min(sum(share(eye, ball) for ball in seen), 1.0) if seen else 1.0


def share(eye: np.ndarray, ball: Ball) -> float:
    """0..1 of all directions from `eye` (3,) that a sphere takes; 1 from inside."""
    distance = float(np.linalg.norm(np.array(ball[:3]) - eye))
    if distance <= ball[3]:
        return 1.0
    return (1.0 - np.sqrt(1.0 - (ball[3] / distance) ** 2)) / 2.0


def next_one(old: Iterable[Refresh], policy: str, budget: float, spent: float) -> Refresh | None:
    """The one to make again now: the largest error, of equals the cheapest. LIVE: only what fits in the `budget` (s) of which `spent` is gone."""
    left = budget - spent if policy == "LIVE" else float("inf")
    fits = [one for one in old if policy != "NEVER" and one.seconds <= left]
    return min(fits, key=lambda one: (-one.error, one.seconds, one.reflector)) if fits else None
