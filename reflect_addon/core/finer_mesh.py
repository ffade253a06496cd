"""A finer tessellation of a smooth-shaded mesh: curved PN triangles.

Problem. A reflector map "can be created with a highly tessellated version of the reflector" [estalella-2005 section 4.1],
but what a scene holds is the drawn mesh. Its corners' normals tell how it was meant to bend: a cubic patch over each
triangle that is across the normals at the corners, and a quadratic field of normals over it [Vlachos et al. 2001]. Patches
of two triangles with the same normals at a shared edge meet without a crack.
Departure. The paper's normals lack Bernstein's 2 at the edges' terms: along an arc they lag by a quarter at a quarter of it.
Limits. Cycles reflects at the drawn triangles under linearly mixed normals: against it a finer mesh is only nearer where
the drawn one is a poor stand-in. At a crease, where normals part, patches may gape by a fraction of an edge's sag; facets
stay flat. Bends of more than about 90 degrees within a triangle fold.

    A. Vlachos, J. Peters, C. Boyd, J. L. Mitchell: Curved PN Triangles. Symposium on Interactive 3D Graphics 2001.
"""

from dataclasses import replace

import numpy as np

from .reflector_parts import Part


def finer(
    positions: np.ndarray, triangles: np.ndarray, corner_normals: np.ndarray, times: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """((V', 3) positions, (T times^2, 3) triangles, (T times^2, 3, 3) unit corner normals): each edge in `times` pieces, 1 and
    up. Triangle t's pieces are t times^2 and on; each triangle has vertices of its own. Units and spaces as given."""
    corners = np.asarray(positions, np.float64)[np.asarray(triangles)].reshape(-1, 3, 3)
    normals = np.asarray(corner_normals, np.float64).reshape(-1, 3, 3)
    weights, pieces = _lattice(times)
    points = np.einsum("kj,tjx->tkx", _cubic(weights), _control_points(corners, normals))
    mixed = np.einsum("kj,tjx->tkx", _quadratic(weights), _control_normals(corners, normals))
    length = np.linalg.norm(mixed, axis=-1, keepdims=True)
    flat = np.einsum("kj,tjx->tkx", weights, normals)
    mixed = np.where(length > 1e-6, mixed / np.maximum(length, 1e-6), flat)
    index = (np.arange(len(corners))[:, None, None] * len(weights) + pieces).reshape(-1, 3)
    return points.reshape(-1, 3), index, mixed[:, pieces].reshape(-1, 3, 3)


def finer_part(part: Part, times: int) -> Part:
    """The part of the mesh that finer(..., times) made of the part's."""
    pieces = part.triangles[:, None] * times**2 + np.arange(times**2)
    return replace(part, triangles=pieces.reshape(-1), own=np.repeat(part.own, times**2))


def _lattice(times: int) -> tuple[np.ndarray, np.ndarray]:
    """((K, 3) barycentric weights, (times^2, 3) triangles among them, wound like the whole)."""
    at = [(i, j) for i in range(times + 1) for j in range(times + 1 - i)]
    number = {place: k for k, place in enumerate(at)}
    pieces = []
    for i, j in at:
        if i + j < times:
            pieces.append([number[i, j], number[i + 1, j], number[i, j + 1]])
        if i + j < times - 1:
            pieces.append([number[i + 1, j], number[i + 1, j + 1], number[i, j + 1]])
    ij = np.array(at) / times
    return np.column_stack([1 - ij.sum(1), ij]), np.array(pieces)


# Edges by their corners, in the order in which control points and normals are listed.
_EDGES = ((0, 1), (1, 2), (2, 0))


def _control_points(p: np.ndarray, n: np.ndarray) -> np.ndarray:
    """(T, 10, 3): three corners, two on each edge [b210, b120, ...], the middle [Vlachos et al. 2001, section 3.1]."""
    edge = []
    for i, j in _EDGES:
        for a, b in ((i, j), (j, i)):
            lift = np.einsum("tx,tx->t", p[:, b] - p[:, a], n[:, a])
            edge.append((2 * p[:, a] + p[:, b] - lift[:, None] * n[:, a]) / 3)
    mean = sum(edge) / 6
    return np.stack([*np.moveaxis(p, 1, 0), *edge, mean + (mean - p.mean(1)) / 2], 1)


def _cubic(w: np.ndarray) -> np.ndarray:
    """(K, 10)"""
    edge = [3 * w[:, a] ** 2 * w[:, b] for i, j in _EDGES for a, b in ((i, j), (j, i))]
    return np.column_stack([*(w**3).T, *edge, 6 * w.prod(1)])


def _control_normals(p: np.ndarray, n: np.ndarray) -> np.ndarray:
    """(T, 6, 3): three corners, one on each edge: their sum mirrored at the edge's plane across [section 3.2]."""
    edge = []
    for i, j in _EDGES:
        along, total = p[:, j] - p[:, i], n[:, i] + n[:, j]
        share = 2 * np.einsum("tx,tx->t", along, total) / np.maximum(np.einsum("tx,tx->t", along, along), 1e-300)
        middle = total - share[:, None] * along
        edge.append(middle / np.maximum(np.linalg.norm(middle, axis=-1, keepdims=True), 1e-300))
    return np.stack([*np.moveaxis(n, 1, 0), *edge], 1)


def _quadratic(w: np.ndarray) -> np.ndarray:
    """(K, 6)"""
    return np.column_stack([*(w**2).T, *(2 * w[:, i] * w[:, j] for i, j in _EDGES)])
