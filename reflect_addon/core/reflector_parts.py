"""Any reflector as a few parts that a map over directions can hold.

Problem. A reflector map [estalella-2005 section 4.1] holds one surface point per direction from a centre, and its search
finds one reflection point where the surface is convex; "torus-like geometries" cannot be handled (section 8), and convex
and concave pieces are cut by hand (6.2).
Idea. Regions between creases and changes of curvature's sign (reflector_regions.py) are tried as they are, largest first:
a centre is found that sees most of the region (reflector_center.py); what it sees, one triangle per direction
(part_surface.py), is a part, and the rest is a region again. A region of which too little is seen is cut in two by k-means
over places and normals. What is left over at the end goes to any part beside it that sees it. This is done with finer and
coarser regions, with and without kinds and creases; the cheapest parts win, by what a search in them and what is left out cost.
So a torus becomes its outer half and sectors of its inner half, a bowl its inside, rim and outside.
Limits. A part of mixed kind is called a saddle: search it from several seeds. Parts meet without overlap: continue their
maps. Thin things seen end on are cut often. What `most` parts do not hold is left out: left_out() says how much.
"""

from collections.abc import Callable
from dataclasses import dataclass
from heapq import heappop, heappush

import numpy as np

from .part_surface import surface_of_part, triangles_met
from .reflector_center import GRAZING, best_center, seen
from .reflector_curvature import CONCAVE, CONVEX, FLAT, SADDLE, kinds_of
from .reflector_regions import regions_of
from .reflector_topology import Surface, components, surface_of

# A region of which less than some share is seen is cut, this often at most; crumbs of less area are no parts.
CUTS, CRUMB = 5, 5e-4
# (share of area below which regions are merged, whether kinds separate, whether creases do, share that must be seen).
TRIES = ((0.02, True, True, 0.95), (0.02, True, True, 0.85), (0.06, True, True, 0.9), (0.02, False, True, 0.95), (0.02, False, False, 0.9))
# Cost of a part with one reflection point and of others, of surface in parts of several kinds, and of surface left out:
# 0.1 % of it is worth a part.
COST, COST_MIXED, COST_LEFT_OUT = {"flat": 1.0, "convex": 1.0, "concave": 2.0, "saddle": 2.0}, 40.0, 1000.0
# No better than this is looked for; and not once so many triangles were, when no more than a tenth is left out.
CHEAP, WORK, TENTH = 4.0, 150_000, 0.1
# A part is of a kind that this share of its area is of, flat counting as either.
PURE = 0.93
# What is flat turns by no more than this, radians.
FLATTEST = 0.3
# Starts of the search in a part that may hold several reflection points.
SEEDS = {"flat": 1, "convex": 1, "concave": 5, "saddle": 7}
# A leftover, or what a part below this share of the surface holds, is seen by a part beside it at this q already.
SMALL, BARELY = 0.01, 0.03


@dataclass(frozen=True)
class Part:
    """Triangles of a reflector that its centre sees once each."""

    triangles: np.ndarray  # (T,) int64 into the mesh's, ascending
    center: np.ndarray  # (3,) float64 world
    size: float  # m, half the diagonal of the part's bounding box
    kind: str  # 'flat' | 'convex' | 'concave' | 'saddle' (both, or of several kinds), seen from the mirroring side
    reverse: bool  # the mirroring side faces the centre
    two_sided: bool  # the surface is open there: its other side mirrors too, normals negated, convex and concave swapped
    # (S, 3) unit directions from the centre to start searches in; each meets the part. The first lies in its middle and is
    # enough on a flat or convex side (a two-sided convex part has more for its other side).
    seeds: np.ndarray


def parts_of(
    positions: np.ndarray, triangles: np.ndarray, corner_normals: np.ndarray, most: int = 16
) -> tuple[Part, ...]:
    """The parts, largest area first. positions (V, 3) world, m; triangles (T, 3); corner_normals (T, 3, 3) world. Pass the
    triangles that mirror only. Never raises for bad geometry: what has no area is in no part."""
    surface = surface_of(positions, triangles, corner_normals)
    if not len(surface.area) or most < 1:
        return ()
    kind = kinds_of(surface)
    best, least = [], np.inf
    for tried, (small, by_kind, by_crease, share) in enumerate(TRIES):
        if least <= CHEAP or (tried * len(kind) > WORK and least < TENTH * COST_LEFT_OUT):
            break
        region = regions_of(surface, kind if by_kind else np.where(surface.wall, FLAT, SADDLE), small, by_crease)
        stars = _filled(surface, kind, _stars(surface, region, most, share))
        cost = _cost(surface, kind, stars)
        if cost < least - 0.5:
            best, least = stars, cost
    best.sort(key=lambda star: -surface.area[star.triangles].sum())
    return tuple(_part(surface, kind, star) for star in best)


def left_out(parts: tuple[Part, ...], positions: np.ndarray, triangles: np.ndarray) -> float:
    """Share of the mesh's area, degenerate and doubled triangles apart, that is in no part; 0 of nothing."""
    surface = surface_of(positions, triangles, np.zeros((len(triangles), 3, 3)))
    held = np.isin(surface.index, np.concatenate([np.zeros(0, np.int64), *(p.triangles for p in parts)]))
    return float(surface.area[~held].sum() / max(surface.area.sum(), 1e-300))


def part_surface(
    part: Part, positions: np.ndarray, triangles: np.ndarray, corner_normals: np.ndarray
) -> Callable[[np.ndarray], tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """surface(directions (N, 3)) -> ((N,) distance from part.center, m, (N, 3) unit shading normal on the mirroring side,
    (N,) bool inside); the mesh that the part is of, or a finer one with the part's triangles there (finer_mesh.py)."""
    corners = np.asarray(positions, np.float64)[np.asarray(triangles)[part.triangles]]
    return surface_of_part(part.center, part.reverse, corners, np.asarray(corner_normals)[part.triangles])


@dataclass(frozen=True)
class _Star:
    """What a part is made of, in the Surface's units and numbers."""

    triangles: np.ndarray
    center: np.ndarray
    reverse: bool


def _stars(surface: Surface, region: np.ndarray, most: int, share: float) -> list[_Star]:
    """At most `most`: regions, largest first, cut until a centre sees this share of them."""
    middle = surface.corners.mean(1)
    order = np.argsort(region, kind="stable")
    queue: list[tuple[float, int, np.ndarray, int]] = []  # (-area, its first triangle, triangles, cuts so far)

    def put(parts: list[np.ndarray], cuts: int) -> None:
        for part in parts:
            heappush(queue, (-surface.area[part].sum(), part[0], part, cuts))

    put(np.split(order, np.flatnonzero(np.diff(region[order])) + 1), 0)
    done: list[_Star] = []
    crumb = CRUMB * surface.area.sum()
    tries = 0
    while queue and len(done) < most and tries < 8 * most:
        _, _, part, cuts = heappop(queue)
        tries += 1
        area = surface.area[part]
        if area.sum() < crumb and done:
            break
        center, reverse = best_center(surface.corners[part], surface.normal[part], area)
        size = _half_diagonal(surface.corners[part])
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
        done.append(_Star(star, center, reverse))
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


def _filled(surface: Surface, kind: np.ndarray, stars: list[_Star]) -> list[_Star]:
    """The stars, largest first, with what is left over and what small ones hold beside them as far as they see it; those
    that are then worth their cost."""
    middle, total = surface.corners.mean(1), surface.area.sum()
    stars = sorted(stars, key=lambda star: -surface.area[star.triangles].sum())
    free = np.ones(len(surface.area), bool)
    for star in stars:
        free[star.triangles] = surface.area[star.triangles].sum() < SMALL * total
    out = []
    for star in stars:
        if surface.area[star.triangles].sum() < SMALL * total:
            star = _Star(star.triangles[free[star.triangles]], star.center, star.reverse)
        if not len(star.triangles) or _cost(surface, kind, [star]) > COST_LEFT_OUT:
            continue
        mine = np.zeros(len(free), bool)
        mine[star.triangles] = True
        size = _half_diagonal(surface.corners[mine])
        more = free & ~mine & (seen(star.center, star.reverse, middle, surface.normal, size) > BARELY)
        label = components(len(free), surface.pairs[(mine | more)[surface.pairs].all(1)])
        more &= np.isin(label, np.unique(label[mine]))
        if more.any():
            both = np.flatnonzero(mine | more)
            met = triangles_met(star.center, star.reverse, surface.corners[both], middle[both] - star.center)
            met = met == np.arange(len(both))
            if met[mine[both]].all():  # else they hide what the star held
                star = _Star(both[met], star.center, star.reverse)
        free[star.triangles] = False
        out.append(star)
    return out


def _cost(surface: Surface, kind: np.ndarray, stars: list[_Star]) -> float:
    share = surface.area / surface.area.sum()
    cost = COST_LEFT_OUT
    for star in stars:
        held = share[star.triangles].sum()
        word, pure = _word(surface, kind, star.triangles)
        cost += COST[word] + COST_MIXED * (1 - pure) * held - COST_LEFT_OUT * held
    return cost


def _word(surface: Surface, kind: np.ndarray, triangles: np.ndarray) -> tuple[str, float]:
    """(a part's kind, share of it that is of that kind: 0 with a crease or a wall among others in it)."""
    area = surface.area[triangles]
    share = np.bincount(kind[triangles], area, minlength=4) / area.sum()
    normal = surface.normal[triangles]
    mean = area @ normal
    if share[FLAT] >= PURE and (normal @ mean).min() > np.cos(FLATTEST) * np.linalg.norm(mean):
        return "flat", 1.0
    mine = np.zeros(len(surface.area), bool)
    mine[triangles] = True
    parted = surface.wall[triangles].any() or mine[surface.pairs[surface.crease]].all(1).any()
    one_sign = {"convex": share[FLAT] + share[CONVEX], "concave": share[FLAT] + share[CONCAVE]}
    word = max(one_sign, key=one_sign.get)
    if one_sign[word] < PURE:
        word = "saddle"
    return word, 0.0 if parted else max(*one_sign.values(), share[SADDLE])


def _part(surface: Surface, kind: np.ndarray, star: _Star) -> Part:
    word, two_sided = _word(surface, kind, star.triangles)[0], bool(surface.two_sided[star.triangles].any())
    corners = surface.corners[star.triangles]
    direction = corners.mean(1) - star.center
    direction /= np.maximum(np.linalg.norm(direction, axis=-1, keepdims=True), 1e-300)
    chosen = [int((direction @ (surface.area[star.triangles] @ direction)).argmax())]
    nearest = direction @ direction[chosen[0]]
    for _ in range(SEEDS["concave" if two_sided and word == "convex" else word] - 1):
        # The one farthest from those there are.
        chosen.append(int(nearest.argmin()))
        nearest = np.maximum(nearest, direction @ direction[chosen[-1]])
    return Part(
        np.sort(surface.index[star.triangles]),
        surface.middle + surface.size * star.center,
        surface.size * _half_diagonal(corners),
        word,
        star.reverse,
        two_sided,
        direction[sorted(set(chosen), key=chosen.index)],
    )


def _half_diagonal(corners: np.ndarray) -> float:
    return float(np.linalg.norm(np.ptp(corners.reshape(-1, 3), axis=0))) / 2
