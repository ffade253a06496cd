"""Any reflector as a few parts that a map over directions can hold.

Problem. A reflector map [estalella-2005 section 4.1] holds one surface point per direction from a centre, and its search
finds one reflection point where the surface is convex; "torus-like geometries" cannot be handled (section 8), and convex
and concave pieces are cut by hand (6.2).
Idea. Regions between creases and changes of curvature's sign (reflector_regions.py) are tried as they are, largest first:
a centre is found that sees most of the region (reflector_center.py); what it sees, one triangle per direction
(part_surface.py), is a part, and the rest is a region again. A region of which too little is seen is cut in two by k-means
over places and normals. What is left over at the end goes to any part beside it that sees it. When `most` parts do not
hold the surface, all is done again with coarser regions: larger ones, then without kinds, then without creases.
So a torus becomes its outer half and sectors of its inner half, a bowl its inside, rim and outside.
Limits. A part of mixed kind is called a saddle: search it from several seeds. Parts meet without overlap: continue their
maps. Thin things seen end on are cut often. What `most` parts do not hold is left out: left_out() says how much.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .part_surface import surface_of_part, triangles_met
from .reflector_center import GRAZING, best_center, seen
from .reflector_curvature import CONCAVE, CONVEX, FLAT, kinds_of
from .reflector_regions import regions_of
from .reflector_topology import Surface, components, surface_of

# A region is a part when its centre sees this share of it; a smaller share is one after so many cuts.
SEEN, CUTS = 0.9, 5
# Shares of the surface: regions below it are not tried, and a surface is held when no more than this is left out.
CRUMB, HELD = 5e-4, 0.98
# (share below which regions are merged, whether kinds separate, whether creases do), tried in turn.
COARSER = ((0.02, True, True), (0.06, True, True), (0.02, False, True), (0.02, False, False))
# A part is of a kind that this share of its area is of, flat counting as either.
PURE = 0.93
# Starts of the search in a part that may hold several reflection points.
SEEDS = {"flat": 1, "convex": 1, "concave": 5, "saddle": 7}
# A leftover is seen by a part beside it at this q already.
BARELY = 0.03


@dataclass(frozen=True)
class Part:
    """Triangles of a reflector that its centre sees once each."""

    triangles: np.ndarray  # (T,) int64 into the mesh's, ascending
    center: np.ndarray  # (3,) float64 world
    size: float  # m, half the diagonal of the part's bounding box
    kind: str  # 'flat' | 'convex' | 'concave' | 'saddle' (both, or of several kinds), seen from the mirroring side
    reverse: bool  # the mirroring side faces the centre
    two_sided: bool  # the surface is open there: its other side mirrors too, normals negated, convex and concave swapped
    seeds: np.ndarray  # (S, 3) unit directions from the centre to start searches in; each meets the part


def parts_of(
    positions: np.ndarray, triangles: np.ndarray, corner_normals: np.ndarray, most: int = 16
) -> tuple[Part, ...]:
    """The parts, largest area first. positions (V, 3) world, m; triangles (T, 3); corner_normals (T, 3, 3) world. Pass the
    triangles that mirror only. Never raises for bad geometry: what has no area is in no part."""
    surface = surface_of(positions, triangles, corner_normals)
    if not len(surface.area) or most < 1:
        return ()
    kind = kinds_of(surface)
    best: tuple[float, list] = (-1.0, [])
    for small, by_kind, by_crease in COARSER:
        region = regions_of(surface, kind if by_kind else np.zeros_like(kind), small, by_crease)
        held = _filled(surface, _stars(surface, region, most))
        share = sum(surface.area[t].sum() for t, _, _ in held) / surface.area.sum()
        if share > best[0] + 0.01:
            best = (share, held)
        if best[0] >= HELD:
            break
    order = sorted(best[1], key=lambda held: -surface.area[held[0]].sum())
    return tuple(_part(surface, kind, *held) for held in order)


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


def _stars(surface: Surface, region: np.ndarray, most: int) -> list[tuple[np.ndarray, np.ndarray, bool]]:
    """[(triangles, center, reverse)], at most `most`: regions, largest first, cut until a centre sees them."""
    middle = surface.corners.mean(1)
    order = np.argsort(region, kind="stable")
    queue = [(part, 0) for part in np.split(order, np.flatnonzero(np.diff(region[order])) + 1)]
    done: list[tuple[np.ndarray, np.ndarray, bool]] = []
    least = CRUMB * surface.area.sum()
    tries = 0
    while queue and len(done) < most and tries < 8 * most:
        at = max(range(len(queue)), key=lambda k: surface.area[queue[k][0]].sum())
        part, cuts = queue.pop(at)
        tries += 1
        area = surface.area[part]
        if area.sum() < least and done:
            break
        center, reverse = best_center(middle[part], surface.normal[part], area)
        size = _half_diagonal(surface.corners[part])
        good = seen(center, reverse, middle[part], surface.normal[part], size) > GRAZING
        star = part[good]
        star = star[triangles_met(center, reverse, surface.corners[star], middle[star] - center) == np.arange(len(star))]
        if not len(star) or (surface.area[star].sum() < SEEN * area.sum() and cuts < CUTS and len(part) > 1):
            if len(part) > 1 and cuts < CUTS:
                queue += [(half, cuts + 1) for half in _halves(middle[part], surface.normal[part], area, part)]
            continue
        done.append((star, center, reverse))
        rest = np.setdiff1d(part, star)
        if len(rest):
            label = components(len(surface.area), surface.pairs[np.isin(surface.pairs, rest).all(1)])[rest]
            queue += [(rest[label == k], cuts) for k in np.unique(label)[:64]]
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


def _filled(surface: Surface, stars: list[tuple[np.ndarray, np.ndarray, bool]]):
    """The stars with the leftovers that they see beside them."""
    middle = surface.corners.mean(1)
    free = np.ones(len(surface.area), bool)
    for triangles, _, _ in stars:
        free[triangles] = False
    out = []
    for triangles, center, reverse in stars:
        if not free.any():
            out.append((triangles, center, reverse))
            continue
        size = _half_diagonal(surface.corners[triangles])
        mine = np.zeros(len(free), bool)
        mine[triangles] = True
        more = free & (seen(center, reverse, middle, surface.normal, size) > BARELY)
        open_edge = surface.pairs[(mine | more)[surface.pairs].all(1)]
        label = components(len(free), open_edge)
        more &= np.isin(label, np.unique(label[triangles]))
        all_of = np.flatnonzero(mine | more)
        met = triangles_met(center, reverse, surface.corners[all_of], middle[all_of] - center) == np.arange(len(all_of))
        lost = surface.area[all_of[mine[all_of] & ~met]].sum()
        if lost < 1e-3 * surface.area[triangles].sum():
            triangles = all_of[met]
            free[all_of[mine[all_of] & ~met]] = True
            free[triangles] = False
        out.append((triangles, center, reverse))
    return out


def _part(surface: Surface, kind: np.ndarray, triangles: np.ndarray, center: np.ndarray, reverse: bool) -> Part:
    area = surface.area[triangles]
    share = np.bincount(kind[triangles], area, minlength=4) / area.sum()
    word = "saddle"
    if share[FLAT] >= PURE:
        word = "flat"
    elif share[FLAT] + share[CONVEX] >= PURE:
        word = "convex"
    elif share[FLAT] + share[CONCAVE] >= PURE:
        word = "concave"
    direction = surface.corners[triangles].mean(1) - center
    direction /= np.maximum(np.linalg.norm(direction, axis=-1, keepdims=True), 1e-300)
    mean = area @ direction
    chosen = [int((direction @ mean).argmax())]
    for _ in range(SEEDS[word] - 1):
        # The one farthest from those there are.
        chosen.append(int((direction @ direction[chosen].T).max(-1).argmin()))
    seeds = direction[sorted(set(chosen), key=chosen.index)]
    return Part(
        np.sort(surface.index[triangles]),
        surface.middle + surface.size * center,
        surface.size * _half_diagonal(surface.corners[triangles]),
        word,
        reverse,
        bool(surface.two_sided[triangles].any()),
        seeds,
    )


def _half_diagonal(corners: np.ndarray) -> float:
    return float(np.linalg.norm(np.ptp(corners.reshape(-1, 3), axis=0))) / 2
