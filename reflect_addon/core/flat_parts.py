"""The flat parts of a mesh, and what can be told of its inside.

A floor, a table top, a wall: large planes that a billboard fits exactly. The facets of a tube or of a coarse ball are
planes too, but stand for a round surface: each of them meets others of about its size at a small angle on both sides.
"""

from itertools import product

import numpy as np

from .snapshot import Instance, SceneSnapshot

# Planes of a mesh that are smaller than this share of its surface are not worth a quad.
LARGE_PART = 0.02
# Triangles belong to one plane when their normals differ by less than this, in radians (about half a degree) ...
SAME_NORMAL = 0.01
# ... and their distances from the mesh's centre by less than this share of its size ...
SAME_OFFSET = 1e-3
# ... and more planes than this mean that the mesh is round, not built of walls.
MOST_PARTS = 64
# Facets that meet at less than this angle may stand for one round surface (a tube of nine sides) ...
ROUND = np.radians(41)
# ... when the smaller has at least this share of the larger's area: a bevel is no neighbour of the face that it rims.
ALIKE = 0.5


def flat_parts(corners: np.ndarray, cross: np.ndarray, area: np.ndarray) -> list[np.ndarray]:
    """Indices of the triangles of each large plane, the facets of round surfaces left out; [] for round meshes.

    corners (T, 3, 3), world; cross (T, 3): the triangles' cross products; area (T,)."""
    parts = _planes(corners, cross, area)
    if len(parts) > MOST_PARTS:
        return []
    is_facet = _facets(parts, corners, cross, area)
    return [part for part, facet in zip(parts, is_facet, strict=True) if not facet]


def _facets(parts: list[np.ndarray], corners: np.ndarray, cross: np.ndarray, area: np.ndarray) -> np.ndarray:
    """(P,) bool: whether two or more others like it meet the part at a small angle."""
    if len(parts) < 3:
        return np.zeros(len(parts), bool)
    normal = np.array([cross[p].sum(0) / max(np.linalg.norm(cross[p].sum(0)), 1e-300) for p in parts])
    size = np.array([area[p].sum() for p in parts])
    owner = np.full(len(corners), -1)
    for index, part in enumerate(parts):
        owner[part] = index
    # Vertices at one place are one; edges as pairs of them.
    scale = np.ptp(corners.reshape(-1, 3), axis=0).max()
    _, place = np.unique(np.round((corners.reshape(-1, 3) - corners.min((0, 1))) / scale, 6), axis=0, return_inverse=True)
    place = place.reshape(-1, 3)
    edges = np.sort(np.concatenate([place[:, [0, 1]], place[:, [1, 2]], place[:, [2, 0]]]), axis=1)
    owners = np.tile(owner, 3)
    order = np.lexsort((owners, edges[:, 1], edges[:, 0]))
    edges, owners = edges[order], owners[order]
    meet = np.all(edges[1:] == edges[:-1], axis=1) & (owners[1:] != owners[:-1]) & (owners[:-1] >= 0)
    a, b = np.unique(np.stack([owners[:-1][meet], owners[1:][meet]], -1), axis=0).T
    shallow = np.einsum("ij,ij->i", normal[a], normal[b]) > np.cos(ROUND)
    alike = np.minimum(size[a], size[b]) >= ALIKE * np.maximum(size[a], size[b])
    near = shallow & alike
    return np.bincount(np.concatenate([a[near], b[near]]), minlength=len(parts)) >= 2


def _planes(corners: np.ndarray, cross: np.ndarray, area: np.ndarray) -> list[np.ndarray]:
    """Indices of the triangles of each plane that holds at least LARGE_PART of the surface; [] for round meshes."""
    size = np.ptp(corners.reshape(-1, 3), axis=0).max()
    normal = cross / np.maximum(np.linalg.norm(cross, axis=-1, keepdims=True), 1e-300)
    offset = np.einsum("ij,ij->i", normal, corners.mean(1) - corners.reshape(-1, 3).mean(0)) / max(size, 1e-300)
    left = np.argsort(-area)
    around = _area_around(normal, offset, area)
    parts: list[np.ndarray] = []
    while len(left) and len(parts) <= MOST_PARTS:
        seeds = np.flatnonzero(around[left] >= LARGE_PART * area.sum())
        if not len(seeds):
            break
        first = left[seeds[0]]
        same = (normal[left] @ normal[first] > np.cos(SAME_NORMAL)) & (np.abs(offset[left] - offset[first]) < SAME_OFFSET)
        part, left = left[same], left[~same]
        if area[part].sum() >= LARGE_PART * area.sum():
            parts.append(part)
        elif area[left].sum() < LARGE_PART * area.sum():
            break
        elif len(part) == 1 and len(parts) == 0 and area[first] < LARGE_PART / 4 * area.sum():
            break  # the largest triangle is small and alone: a round mesh
    return parts


def _area_around(normal: np.ndarray, offset: np.ndarray, area: np.ndarray) -> np.ndarray:
    """(T,) an upper bound of the area of the plane that a triangle could be the first of: with it a mesh of ten thousand
    small planes is known for one at once. Summed over the cells of a grid in (normal, offset) around the triangle's."""
    # A cell's side is at least as long as the chord of SAME_NORMAL and as the tolerance of the offset.
    cells = np.floor(np.column_stack([normal / SAME_NORMAL, offset / SAME_OFFSET])).astype(np.int64)
    cells -= cells.min(0) - 1
    strides = np.cumprod([1, *(cells.max(0)[:3] + 2)])
    key, of = np.unique(cells @ strides, return_inverse=True)
    inside = np.bincount(of, weights=area)
    total = np.zeros(len(key))
    for step in product((-1, 0, 1), repeat=4):
        neighbour = key + np.dot(step, strides)
        at = np.minimum(np.searchsorted(key, neighbour), len(key) - 1)
        total += np.where(key[at] == neighbour, inside[at], 0.0)
    return total[of]


def contains(scene: SceneSnapshot, instance: Instance, point: np.ndarray) -> bool:
    """Whether a point (3,) lies inside the instance's closed mesh: by the solid angles of its triangles
    [van Oosterom and Strackee 1983, eq. 8]. False for open meshes."""
    low, high = scene.bounds([instance])
    triangles = scene.meshes[instance.mesh].triangles
    if not (np.all(low < point) and np.all(point < high) and _all_edges_shared(triangles)):
        return False
    a, b, c = np.moveaxis(scene.world_positions(instance)[triangles] - point, 1, 0) / (high - low).max()
    la, lb, lc = (np.linalg.norm(v, axis=-1) for v in (a, b, c))
    volume = np.einsum("ij,ij->i", a, np.cross(b, c))
    beside = la * lb * lc + (a * b).sum(-1) * lc + (b * c).sum(-1) * la + (c * a).sum(-1) * lb
    return bool(abs(2 * np.arctan2(volume, beside).sum()) > 2 * np.pi)


def visible_sides(triangles: np.ndarray, corners: np.ndarray, inside: bool) -> tuple[float, ...]:
    """The sides of its triangles that a mesh can be seen from: both, or of a closed mesh the outer or the inner one."""
    if not _all_edges_shared(triangles):
        return (1.0, -1.0)
    centered = corners - corners.reshape(-1, 3).mean(0)
    volume = np.einsum("ij,ij->i", centered[:, 0], np.cross(centered[:, 1], centered[:, 2])).sum()
    return (1.0,) if (volume > 0) != inside else (-1.0,)


def is_closed(positions: np.ndarray, triangles: np.ndarray) -> bool:
    """Whether the triangles bound a volume; vertices at one place count as one (sharp edges are often split)."""
    _, place = np.unique(positions, axis=0, return_inverse=True)
    return _all_edges_shared(place.ravel()[triangles])


def _all_edges_shared(triangles: np.ndarray) -> bool:
    """Whether every edge belongs to exactly two triangles."""
    edges = np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1)
    _, uses = np.unique(edges, axis=0, return_counts=True)
    return bool(np.all(uses == 2))
