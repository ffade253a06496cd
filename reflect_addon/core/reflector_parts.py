"""Any reflector as a few parts that a map over directions can hold.

Problem. A reflector map [estalella-2005 section 4.1] holds one surface point per direction from a centre, and its search
finds one reflection point where the surface is convex; "torus-like geometries" cannot be handled (section 8), and convex
and concave pieces are cut by hand (6.2).
Idea. Regions between creases and changes of curvature's sign (reflector_regions.py) become stars, sets of triangles that a
centre sees once each (reflector_stars.py). This is done with finer and coarser regions, with and without kinds and creases,
and the cheapest stars are the parts, by what a search in them and what is left out cost.
So a torus becomes its outer half and sectors of its inner half, a bowl its inside, rim and outside.
Limits. A part of mixed kind is called a saddle. Beyond its fringe a part's map is to be continued. Thin things seen end on are cut
often. What `most` parts do not hold is left out: left_out() says how much.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .part_surface import surface_of_part
from .reflector_curvature import CONCAVE, CONVEX, FLAT, SADDLE, kinds_of
from .reflector_regions import regions_of
from .reflector_stars import Star, filled, fringe_of, half_diagonal, stars_of
from .reflector_topology import Surface, surface_of

# (share of area below which regions are merged, whether kinds separate, whether creases do, share that must be seen).
TRIES = ((0.02, True, True, 0.95), (0.02, True, True, 0.85), (0.06, True, True, 0.9), (0.02, False, True, 0.95), (0.02, False, False, 0.9))
# Cost of a part with one reflection point and of others, of surface in parts of several kinds, and of surface left out:
# 0.1 % of it is worth a part.
COST, COST_MIXED, COST_LEFT_OUT = {"flat": 1.0, "convex": 1.0, "concave": 2.0, "saddle": 2.0}, 40.0, 1000.0
# No better than this is looked for; and not once so many triangles were, when no more than a tenth is left out.
CHEAP, WORK, TENTH = 4.0, 150_000, 0.1
# A part is of a kind that this share of its area is of, flat counting as either.
PURE = 0.93
# A convex part has this share of its planes' area behind none of its points: what rims a torus's hole hardly ever tells.
BEHIND = 0.8
# What is flat turns by no more than this, radians.
FLATTEST = 0.3
# How far above a plane others may lie, as a share of the part's half diagonal: facets and noise.
ABOVE = 0.02
# So many planes are tried against so many points.
SAMPLES = 400


@dataclass(frozen=True)
class Part:
    """Triangles of a reflector that its centre sees once each, and a fringe of those around them, for a search to pass over
    their border on true ground."""

    triangles: np.ndarray  # (T,) int64 into the mesh's, ascending
    own: np.ndarray  # (T,) bool: no fringe; each triangle is some part's own, or no part's
    center: np.ndarray  # (3,) float64 world
    size: float  # m, half the diagonal of its own triangles' bounding box
    kind: str  # 'flat' | 'convex' | 'concave' | 'saddle' (both, or of several kinds), seen from the mirroring side
    reverse: bool  # the mirroring side faces the centre
    two_sided: bool  # the surface is open there: its other side mirrors too, normals negated, convex and concave swapped


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
        stars = filled(surface, stars_of(surface, region, most, share), lambda star: _cost(surface, kind, [star]) < COST_LEFT_OUT)
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
    (N,) bool inside), of the mesh that the part is of."""
    corners = np.asarray(positions, np.float64)[np.asarray(triangles)[part.triangles]]
    return surface_of_part(part.center, part.reverse, corners, np.asarray(corner_normals)[part.triangles])


def _cost(surface: Surface, kind: np.ndarray, stars: list[Star]) -> float:
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
    if one_sign[word] < PURE or (word == "convex" and _lies_behind(surface.corners[triangles].mean(1), normal, area) < BEHIND):
        word = "saddle"
    return word, 0.0 if parted else max(*one_sign.values(), share[SADDLE])


def _lies_behind(middle: np.ndarray, normal: np.ndarray, area: np.ndarray) -> float:
    """Share of area whose plane has all of the part behind it. middle, normal (T, 3), area (T,)."""
    some = np.argsort(-area, kind="stable")[:: -(-len(area) // SAMPLES)]
    p, n = middle[some], normal[some]
    above = (n @ p.T).max(1) - np.einsum("ij,ij->i", n, p)
    size = np.linalg.norm(np.ptp(middle, axis=0)) / 2
    return float(area[some][above <= ABOVE * size].sum() / area[some].sum())


def _part(surface: Surface, kind: np.ndarray, star: Star) -> Part:
    word, _ = _word(surface, kind, star.triangles)
    two_sided = bool(surface.two_sided[star.triangles].any())
    both = np.sort(np.concatenate([star.triangles, fringe_of(surface, star)]))
    return Part(
        surface.index[both],
        np.isin(both, star.triangles),
        surface.middle + surface.size * star.center,
        surface.size * half_diagonal(surface.corners[star.triangles]),
        word,
        star.reverse,
        two_sided,
    )
