"""Which cube maps are made anew in a frame: those whose error is expected to be largest; none where nothing moves [nielsen-2002 2.3, 3.2].

Problem. The view-independent method keeps a cube map for each curved mirror. Fig 6 makes all of them in each frame; six views of the scene with
all planar recursion in them are what its dynamic frames cost. A map shows other mirrors by the maps they had, so it stays wrong for a while
after everything has come to rest: "the error is largest for the first environment map rendered" (2.3).
Idea. A map's expected error is the share of its directions whose radiance is no longer what they show: what moved, by how far over how
wide it is, and what it was made from (`stale` of the maps in it, by the share of it that they take and their reflectance: `coupling`). A frame makes
`budget` maps, largest error times weight first, and says of all the others how old they are. A made map's error is what it inherits,
which is less than the largest there was by the coupling's row sums; below `tolerance` no map is made. So at rest every error ends in
a known number of frames (settle_frames), and a frame at rest makes no environment pass.
Limits. Errors are expectations, not bounds: a small thing may be the only light. Shares are of balls by solid angle, with one reflection
in each plane; what hides what is not known.
"""

from dataclasses import dataclass

import numpy as np

from .curved_views import CurvedMirror
from .mirror_planes import MirrorPlane
from .mirrored_view import reflection

# Sums of a row of `coupling` are at most this: in a chamber of perfect mirrors light never ends, but frames do.
MOST_COUPLED = 0.9


@dataclass(frozen=True)
class Moved:
    """Something that is elsewhere than in the last frame."""

    center: np.ndarray  # (3,) world, m: of a ball around it, between its places
    radius: float  # m
    distance: float  # m it moved, turned at its rim or changed
    instance: str = ""  # whose, Instance.name


@dataclass(frozen=True)
class Kept:
    """The cube maps between two frames, one of each curved mirror."""

    made: tuple[int | None, ...]  # the frame in which each was made; None: never, it shows no reflection
    stale: np.ndarray  # (C,) expected error, share of its light, 0..1

    def age(self, frame: int) -> tuple[int | None, ...]:
        """Frames since each was made."""
        return tuple(None if made is None else frame - made for made in self.made)


def none_yet(count: int) -> Kept:
    return Kept((None,) * count, np.ones(count))


def solid_share(center: np.ndarray, at: np.ndarray, radius: float) -> float:
    """Share of all directions that a ball takes as seen from a place; 1 from within."""
    distance = float(np.linalg.norm(np.subtract(center, at)))
    return 1.0 if distance <= radius else 0.5 * (1.0 - np.sqrt(1.0 - (radius / distance) ** 2))


def coupling_of(curved: tuple[CurvedMirror, ...], planes: tuple[MirrorPlane, ...]) -> np.ndarray:
    """(C, C): what each map (row) takes over of the others' errors (columns), its own included where planes show it."""
    images = [reflection(p.origin, p.normal) for p in planes]
    shares = np.zeros((len(curved), len(curved)))
    for a, seer in enumerate(curved):
        for b, seen in enumerate(curved):
            if a != b:
                shares[a, b] += seen.mean * solid_share(seen.center, seer.center, seen.radius)
            for plane, image in zip(planes, images, strict=True):
                if min((seen.center - plane.origin) @ plane.normal, (seer.center - plane.origin) @ plane.normal) > 0:
                    there = image[:3, :3] @ seen.center + image[:3, 3]
                    shares[a, b] += plane.specular * seen.mean * solid_share(there, seer.center, seen.radius)
    return shares / np.maximum(shares.sum(1, keepdims=True) / MOST_COUPLED, 1.0)


def moved_share(curved: CurvedMirror, moved: tuple[Moved, ...], by: float) -> float:
    """Share of a map's directions that show something else than a frame ago; by: m that the mirror itself moved."""
    others = sum(solid_share(m.center, curved.center, m.radius) * min(m.distance / max(m.radius, 1e-300), 1.0) for m in moved)
    return min(others + min(by / curved.radius, 1.0), 1.0)


def update(
    kept: Kept, changed: np.ndarray, coupling: np.ndarray, weights: np.ndarray, frame: int, budget: int, tolerance: float
) -> tuple[tuple[int, ...], Kept]:
    """(the maps to make in this frame, in order; the maps after it). changed (C,): moved_share of each; weights (C,): what a map's error
    counts, its share of the picture say, > 0."""
    stale, made = np.minimum(kept.stale + changed, 1.0), list(kept.made)
    remade: list[int] = []
    while len(remade) < min(budget, len(stale)):
        rest = [i for i in range(len(stale)) if i not in remade and (made[i] is None or stale[i] > tolerance)]
        if not rest:
            break
        worst = max(rest, key=lambda i: (made[i] is None, stale[i] * weights[i], -i))
        remade.append(worst)
        stale[worst] = min(float(coupling[worst] @ stale), 1.0)  # it shows what the others are now, and itself as it was
        made[worst] = frame
    return tuple(remade), Kept(tuple(made), stale)


def settle_frames(coupling: np.ndarray, budget: int, tolerance: float) -> int:
    """Frames at rest after which no map's error is above the tolerance, whatever it was, with equal weights."""
    count = len(coupling)
    most = float(coupling.sum(1).max(initial=0.0))
    rounds = 1 if most <= tolerance else 1 + int(np.ceil(np.log(tolerance) / np.log(most)))
    return -(-count // budget) * rounds
