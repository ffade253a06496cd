"""A reflector's triangles as a surface: which are neighbours, which side mirrors, which edges are creases.

Cycles turns normals towards the ray, so windings say nothing about what is seen: triangles are turned alike across shared
edges (connected components of a graph with two nodes a triangle, one a side), then a closed piece outwards by its volume
and an open one the way most of its normals look. Vertices at one place are one, as sharp edges are often split.
A crease is an edge at which shading normals part, unless the facets beside it stand for a round thing: they meet at less
than flat_parts.ROUND, and neither is a wall (large, with fewer than two alike beside it: flat_parts).

Limits. Edges of three and more triangles separate. What is open mirrors on both sides (two_sided), and what a closed piece
shows from inside is nobody's.
"""

from dataclasses import dataclass

import numpy as np

from .flat_parts import ALIKE, LARGE_PART, ROUND, SAME_NORMAL

# Places differ when they are further apart than this share of the mesh's size ...
SAME_PLACE = 1e-6
# ... a triangle of less area than this (of the size's square) has no normal to speak of ...
NO_AREA = 1e-13
# ... and shading normals at one place part when they differ by more than this, radians: float32 and a modifier's rounding.
PARTED = np.radians(2)


@dataclass(frozen=True)
class Surface:
    """What is left of a mesh without its degenerate and doubled triangles, T of them; lengths over `size`, about `middle`."""

    index: np.ndarray  # (T,) int64 into the mesh's triangles
    corners: np.ndarray  # (T, 3, 3)
    shading: np.ndarray  # (T, 3, 3) unit corner normals on the mirroring side
    normal: np.ndarray  # (T, 3) unit, of the plane, on the mirroring side
    area: np.ndarray  # (T,)
    place: np.ndarray  # (T, 3) int64: corners at one place have one number
    pairs: np.ndarray  # (E, 2) triangles that share an edge
    length: np.ndarray  # (E,) of that edge
    crease: np.ndarray  # (E,) bool
    wall: np.ndarray  # (T,) bool: in a large plane that is shaded flat
    two_sided: np.ndarray  # (T,) bool: its piece is open, so its other side mirrors too
    middle: np.ndarray  # (3,) world, m
    size: float  # m, half the bounding box's diagonal


def components(count: int, pairs: np.ndarray) -> np.ndarray:
    """(count,) int64, 0 and up: connected things have one number; pairs (E, 2) are what connects them."""
    label = np.arange(count)
    a, b = pairs.T if len(pairs) else (np.zeros(0, int),) * 2
    while True:
        la, lb = label[a], label[b]
        low = np.minimum(la, lb)
        new = label.copy()
        np.minimum.at(new, la, low)
        np.minimum.at(new, lb, low)
        while not np.array_equal(further := new[new], new):
            new = further
        if np.array_equal(new, label):
            return np.unique(label, return_inverse=True)[1].reshape(-1)
        label = new


def surface_of(positions: np.ndarray, triangles: np.ndarray, corner_normals: np.ndarray) -> Surface:
    """positions (V, 3) m, triangles (T, 3), corner_normals (T, 3, 3); what is not finite or has no area is left out."""
    positions = np.asarray(positions, np.float64).reshape(-1, 3)
    triangles = np.asarray(triangles, np.int64).reshape(-1, 3)
    keep = np.flatnonzero(np.isfinite(positions[triangles]).all((1, 2)))
    used = positions[triangles[keep]].reshape(-1, 3)
    low, high = (used.min(0), used.max(0)) if len(used) else (np.zeros(3), np.zeros(3))
    middle, size = low / 2 + high / 2, float(np.linalg.norm(high / 2 - low / 2)) or 1.0
    local = np.where(np.isfinite(positions), (positions - middle) / size, 0.0)
    steps = np.rint((local.clip(-1, 1) + 1) / SAME_PLACE).astype(np.int64)
    _, place = np.unique((steps[:, 0] << 42) + (steps[:, 1] << 21) + steps[:, 2], return_inverse=True)
    corners = local[triangles]
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    keep = keep[np.linalg.norm(cross[keep], axis=-1) > 2 * NO_AREA]
    keep = keep[np.unique(np.sort(place[triangles[keep]], 1), axis=0, return_index=True)[1]]
    keep.sort()
    if not len(keep):
        return _nothing(middle, size)
    corners, cross, place = corners[keep], cross[keep], place.reshape(-1)[triangles[keep]]
    area = np.linalg.norm(cross, axis=-1) / 2
    normal = cross / (2 * area[:, None])
    shading = _shading(np.asarray(corner_normals, np.float64).reshape(-1, 3, 3)[keep], normal)
    pairs, ends, alike, open_edge = _edges(place)
    turned, two_sided = _turned(corners, area, (normal * shading.sum(1)).sum(-1), pairs, alike, open_edge)
    normal = normal * turned[:, None]
    shading = shading * np.where((shading.sum(1) * normal).sum(-1) < 0, -1.0, 1.0)[:, None, None]
    first, last = (corners[pairs[:, 0, None], ends[:, :, 0]][:, k] for k in (0, 1))
    length = np.linalg.norm(first - last, axis=-1)
    wall = _walls(normal, shading, area, pairs)
    crease = _creases(normal, shading, wall, pairs, ends)
    return Surface(keep, corners, shading, normal, area, place, pairs, length, crease, wall, two_sided, middle, size)


def _nothing(middle: np.ndarray, size: float) -> Surface:
    three, flags = np.zeros((0, 3, 3)), np.zeros(0, bool)
    whole, pairs = np.zeros((0, 3), np.int64), np.zeros((0, 2), np.int64)
    return Surface(
        pairs[:, 0], three, three, three[:, 0], three[:, 0, 0], whole, pairs, three[:, 0, 0], flags, flags, flags, middle, size
    )  # fmt: skip


def _shading(given: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """(T, 3, 3) unit; the plane's normal where none is given."""
    given = np.where(np.isfinite(given), given, 0.0)
    length = np.linalg.norm(given, axis=-1, keepdims=True)
    return np.where(length > 1e-6, given / np.maximum(length, 1e-6), normal[:, None])


def _edges(place: np.ndarray):
    """((E, 2) pairs of triangles, (E, 2, 2) [end, which of the two]: their corners there, (E,) whether they run against each
    other as alike turned ones do, (3 T,) whether half-edge 3 t + k is no such pair's)."""
    start, end = place.reshape(-1), place[:, [1, 2, 0]].reshape(-1)
    key = np.minimum(start, end) * (place.max(initial=0) + 1) + np.maximum(start, end)
    order = np.argsort(key, kind="stable")
    _, at, count = np.unique(key[order], return_index=True, return_counts=True)
    a, b = order[at[count == 2]], order[at[count == 2] + 1]
    against = start[a] == end[b]
    corner = np.stack([[a % 3, (a + 1) % 3], [b % 3, (b + 1) % 3]]).transpose(2, 1, 0)
    # Half-edge k runs from corner k to k + 1; rows of `corner` are then brought to the same places.
    corner[against, :, 1] = corner[against, ::-1, 1]
    alone = np.ones(len(key), bool)
    alone[a] = alone[b] = False
    return np.stack([a // 3, b // 3], -1), corner, against, alone


def _turned(corners, area, agreement, pairs, alike, open_edge):
    """((T,) +1 or -1 for each winding, (T,) whether its piece is open or has one side only)."""
    count = len(corners)
    a, b = pairs.T
    sides = np.concatenate([np.stack([2 * a, 2 * b + ~alike], -1), np.stack([2 * a + 1, 2 * b + alike], -1)])
    front, back = components(2 * count, sides).reshape(-1, 2).T
    piece = np.unique(np.minimum(front, back), return_inverse=True)[1]
    turned = np.where(front <= back, 1.0, -1.0)
    open_piece = np.bincount(piece, open_edge.reshape(-1, 3).any(1) | (front == back)) > 0
    middle = np.stack([np.bincount(piece, corners[:, :, k].mean(1) * area) for k in range(3)], -1)
    middle /= np.maximum(np.bincount(piece, area), 1e-300)[:, None]
    p = corners - middle[piece][:, None]
    volume = np.bincount(piece, turned * (p[:, 0] * np.cross(p[:, 1], p[:, 2])).sum(-1))
    looks = np.bincount(piece, turned * area * agreement)
    wrong = np.where(open_piece, looks, volume) < 0
    return np.where(wrong[piece], -turned, turned), open_piece[piece]


def _walls(normal, shading, area, pairs) -> np.ndarray:
    """(T,) bool: in a plane that is shaded flat, holds LARGE_PART of the surface and is no facet of something round."""
    a, b = pairs.T
    angle = (normal[a] * normal[b]).sum(-1)
    face = components(len(normal), pairs[angle > np.cos(SAME_NORMAL)])
    size = np.bincount(face, area)
    mean = np.stack([np.bincount(face, area * n) for n in normal.T], -1)
    mean /= np.maximum(np.linalg.norm(mean, axis=-1, keepdims=True), 1e-300)
    # A fine ball's triangles differ from neighbours by less than SAME_NORMAL too: all must be near the mean.
    bent = np.einsum("tkx,tx->tk", shading, mean[face]).min(-1, initial=1.0) < np.cos(SAME_NORMAL)
    flat = np.bincount(face, bent) == 0
    fa, fb = face[a], face[b]
    met = np.unique(np.sort(np.stack([fa, fb], -1)[(angle > np.cos(ROUND)) & (fa != fb)], 1), axis=0)
    met = met[size[met].min(1) >= ALIKE * size[met].max(1)]
    is_facet = np.bincount(met.reshape(-1), minlength=len(size)) >= 2
    return (flat & ~is_facet & (size >= LARGE_PART * area.sum()))[face]


def _creases(normal, shading, wall, pairs, ends) -> np.ndarray:
    """(E,) bool."""
    a, b = pairs.T
    apart = np.zeros(len(pairs))
    for k in range(2):
        apart = np.maximum(apart, 1 - (shading[a, ends[:, k, 0]] * shading[b, ends[:, k, 1]]).sum(-1))
    parted = apart > 1 - np.cos(PARTED)
    shallow = (normal[a] * normal[b]).sum(-1) > np.cos(ROUND)
    return parted & ~(shallow & ~wall[a] & ~wall[b])
