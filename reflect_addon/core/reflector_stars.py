"""Stars: sets of a reflector's triangles that some centre sees once each, cut from regions.

A region is tried as it is, the largest first: a centre is found that sees most of it (reflector_center.py); what it sees, one
triangle per direction (part_surface.py), is a star, and the rest is a region again. A region of which too little is seen is
cut in two by k-means over places and normals. What is left over goes to any star beside it that sees it.
Limits. Things that curl are cut more often than need be, and a sheet wound fifty times is left out. A triangle is seen when its
middle is.
"""

from collections.abc import Callable
from dataclasses import dataclass
from heapq import heappop, heappush

import numpy as np

from .part_surface import triangles_met
from .reflector_center import GRAZING, best_center, seen
from .reflector_topology import Surface, components

# A region of which less than some share is seen is cut, this often at most; crumbs of less area are no stars.
CUTS, CRUMB = 5, 5e-4
# So many times all triangles are looked at: crumpled sheets would be cut for minutes, to nothing.
WORK = 10
# A leftover, or what a star below this share of the surface holds, is seen by a star beside it at this q already.
SMALL, BARELY = 0.01, 0.03
# A fringe is about this share of its star's half diagonal wide, and no more rings of triangles.
FRINGE, MOST_RINGS = 0.05, 12


@dataclass(frozen=True)
class Star:
    """What a part is made of, in the Surface's units and numbers."""

    triangles: np.ndarray
    center: np.ndarray
    reverse: bool


def stars_of(surface: Surface, region: np.ndarray, most: int, share: float) -> list[Star]:
    """At most `most`: regions, largest first, cut until a centre sees this share of them."""
    middle = surface.corners.mean(1)
    order = np.argsort(region, kind="stable")
    queue: list[tuple[float, int, np.ndarray, int]] = []  # (-area, its first triangle, triangles, cuts so far)

    def put(parts: list[np.ndarray], cuts: int) -> None:
        for part in parts:
            heappush(queue, (-surface.area[part].sum(), part[0], part, cuts))

    put(np.split(order, np.flatnonzero(np.diff(region[order])) + 1), 0)
    done: list[Star] = []
    crumb = CRUMB * surface.area.sum()
    tries = work = 0
    while queue and len(done) < most and tries < 8 * most and work < WORK * len(region):
        _, _, part, cuts = heappop(queue)
        tries, work = tries + 1, work + len(part)
        area = surface.area[part]
        if area.sum() < crumb and done:
            break
        center, reverse = best_center(surface.corners[part], surface.normal[part], area)
        size = half_diagonal(surface.corners[part])
        good = seen(center, reverse, middle[part], surface.normal[part], size) > GRAZING
        star = part[good]
        may_cut = cuts < CUTS and len(part) > 1
        if area[good].sum() >= share * area.sum() or not may_cut:
            met = triangles_met(center, reverse, surface.corners[star], middle[star] - center)
            star = star[met == np.arange(len(star))]
            may_cut &= surface.area[star].sum() < share * area.sum()
        if may_cut:
            put(_halves(middle[part], surface.normal[part], area, part), cuts + 1)
        if may_cut or not len(star):
            continue
        done.append(Star(star, center, reverse))
        rest = np.setdiff1d(part, star)
        if len(rest):
            label = components(len(surface.area), surface.pairs[np.isin(surface.pairs, rest).all(1)])[rest]
            put([rest[label == k] for k in np.unique(label)[:64]], cuts)
    return done


def _halves(middle, normal, area, part) -> list[np.ndarray]:
    """Two means, from the halves before and behind the middle of the longest axis."""
    size = np.linalg.norm(np.ptp(middle, axis=0)) or 1.0
    feature = np.column_stack([2 * middle / size, 0.5 * normal])
    w = area / area.sum()
    centered = feature - w @ feature
    side = centered @ np.linalg.eigh((centered * w[:, None]).T @ centered)[1][:, -1] > 0
    for _ in range(10):
        if side.all() or not side.any():
            break
        one, two = (w[s] @ feature[s] / w[s].sum() for s in (side, ~side))
        new = ((feature - one) ** 2).sum(-1) < ((feature - two) ** 2).sum(-1)
        if np.array_equal(new, side):
            break
        side = new
    if side.all() or not side.any():
        side = np.arange(len(part)) < len(part) // 2
    return [part[side], part[~side]]


def filled(surface: Surface, stars: list[Star], is_worth: Callable[[Star], bool]) -> list[Star]:
    """The stars, largest first, with what is left over and what small ones hold beside them as far as they see it; those
    that are worth it."""
    middle, total = surface.corners.mean(1), surface.area.sum()
    stars = sorted(stars, key=lambda star: -surface.area[star.triangles].sum())
    free = np.ones(len(surface.area), bool)
    for star in stars:
        free[star.triangles] = surface.area[star.triangles].sum() < SMALL * total
    out = []
    for star in stars:
        if surface.area[star.triangles].sum() < SMALL * total:
            star = Star(star.triangles[free[star.triangles]], star.center, star.reverse)
        if not len(star.triangles) or not is_worth(star):
            continue
        mine = np.zeros(len(free), bool)
        mine[star.triangles] = True
        size = half_diagonal(surface.corners[mine])
        more = free & ~mine & (seen(star.center, star.reverse, middle, surface.normal, size) > BARELY)
        label = components(len(free), surface.pairs[(mine | more)[surface.pairs].all(1)])
        more &= np.isin(label, np.unique(label[mine]))
        if more.any():
            both = np.flatnonzero(mine | more)
            met = triangles_met(star.center, star.reverse, surface.corners[both], middle[both] - star.center)
            met = met == np.arange(len(both))
            if met[mine[both]].all():  # else they hide what the star held
                star = Star(both[met], star.center, star.reverse)
        free[star.triangles] = False
        out.append(star)
    return out


def fringe_of(surface: Surface, star: Star) -> np.ndarray:
    """Triangles around the star, over smooth edges, that its centre sees once each as well and that hide none of it."""
    middle, own = surface.corners.mean(1), np.zeros(len(surface.area), bool)
    own[star.triangles] = True
    size = half_diagonal(surface.corners[own])
    may = seen(star.center, star.reverse, middle, surface.normal, size) > GRAZING
    pairs = surface.pairs[~surface.crease]
    rings = int(np.clip(FRINGE * size / np.sqrt(surface.area[own].mean()), 1, MOST_RINGS))
    both = own.copy()
    for _ in range(rings):
        beside = pairs[both[pairs].any(1)].reshape(-1)
        both[beside[may[beside]]] = True
    for _ in range(2):
        all_of = np.flatnonzero(both)
        met = triangles_met(star.center, star.reverse, surface.corners[all_of], middle[all_of] - star.center)
        wrong = met != np.arange(len(all_of))
        if not wrong.any():
            return np.flatnonzero(both & ~own)
        hiding = met[wrong & own[all_of]]
        both[all_of[wrong]] = both[all_of[hiding[hiding >= 0]]] = False
        both |= own
    return np.zeros(0, np.int64)


def half_diagonal(corners: np.ndarray) -> float:
    return float(np.linalg.norm(np.ptp(corners.reshape(-1, 3), axis=0))) / 2
