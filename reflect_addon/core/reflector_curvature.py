"""How a reflector bends at each triangle: flat, convex, concave or like a saddle.

Reflection follows shading normals, so curvature is theirs: each triangle's shape operator is the symmetric one that best
turns its edges into the differences of its corners' normals [Rusinkiewicz 2004, section 3], averaged at vertices by area.
Departures. Tensors stay 3 x 3 in world axes, so that averaging needs no turning of frames. Normals are first averaged over
triangles around a vertex that no crease parts: a ball shaded flat is round then. Averages of averages smooth over a share
of the piece's size, as scans and carved meshes have bumps that no one calls a part.
Limits. Smoothing moves the border between kinds by about that share.

    S. Rusinkiewicz: Estimating Curvatures and Their Derivatives on Triangle Meshes. 3DPVT 2004.
"""

import numpy as np

from .reflector_topology import Surface, components

FLAT, CONVEX, CONCAVE, SADDLE = range(4)
KINDS = ("flat", "convex", "concave", "saddle")
# A curvature times the piece's half diagonal below which it is none: the piece turns by less than about this, radians.
NONE = 0.1
# ... and so is the lesser of two that is less than this share of the other: a tube is no saddle.
LESSER = 0.1
# Curvature is averaged over about this share of the piece's half diagonal, in at most so many rounds.
SMOOTH, ROUNDS = 0.04, 40


def kinds_of(surface: Surface) -> np.ndarray:
    """(T,) int8, FLAT to SADDLE, as seen from the mirroring side."""
    if not len(surface.area):
        return np.zeros(0, np.int8)
    piece = components(len(surface.area), surface.pairs[~surface.crease])
    _, vertex = np.unique(surface.place + piece[:, None] * (surface.place.max() + 1), return_inverse=True)
    vertex = vertex.reshape(-1, 3)
    tensor = _tensors(surface, vertex)
    half = _half_diagonals(surface.corners, piece)
    edge = np.sqrt(np.bincount(piece, surface.area) / np.bincount(piece))
    rounds = np.clip((SMOOTH * half / edge) ** 2, 2, ROUNDS).astype(int)[piece]
    weight = np.bincount(vertex.reshape(-1), np.repeat(surface.area, 3))
    for k in range(rounds.max()):
        moved = np.stack([np.bincount(vertex.reshape(-1), np.repeat(surface.area * t, 3)) / weight for t in tensor.T], -1)
        tensor = np.where((k < rounds)[:, None], moved[vertex].mean(1), tensor)
    least, most = _principal(tensor, surface.normal)
    bound = NONE / half[piece]
    least, most = (
        np.where(np.abs(k) < np.maximum(bound, LESSER * np.abs(other)), 0.0, k) for k, other in ((least, most), (most, least))
    )
    kind = np.full(len(least), FLAT, np.int8)
    kind[most > 0] = CONVEX
    kind[least < 0] = CONCAVE
    kind[(least < 0) & (most > 0)] = SADDLE
    kind[surface.wall] = FLAT  # whatever rounds its rims, averaged into it
    return kind


def _half_diagonals(corners: np.ndarray, piece: np.ndarray) -> np.ndarray:
    """(number of pieces,)."""
    low, high = np.full((piece.max() + 1, 3), np.inf), np.full((piece.max() + 1, 3), -np.inf)
    np.minimum.at(low, piece, corners.min(1))
    np.maximum.at(high, piece, corners.max(1))
    return np.linalg.norm(high - low, axis=-1) / 2


def _frames(normal: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Two (T, 3) unit vectors across each normal and each other."""
    other = np.eye(3)[np.abs(normal).argmin(-1)]
    u = np.cross(normal, other)
    u /= np.linalg.norm(u, axis=-1, keepdims=True)
    return u, np.cross(normal, u)


def _tensors(surface: Surface, vertex: np.ndarray) -> np.ndarray:
    """(T, 6) xx, yy, zz, xy, yz, zx of each triangle's shape operator; positive where it bends away from its normal."""
    turn = surface.shading * surface.area[:, None, None]
    normal = np.stack([np.bincount(vertex.reshape(-1), turn[:, :, k].reshape(-1)) for k in range(3)], -1)
    normal /= np.maximum(np.linalg.norm(normal, axis=-1, keepdims=True), 1e-300)
    normal, corners = normal[vertex], surface.corners
    u, v = _frames(surface.normal)
    edge, turned = np.roll(corners, -1, 1) - corners, np.roll(normal, -1, 1) - normal
    eu, ev, nu, nv = (np.einsum("tkx,tx->tk", a, b) for a, b in ((edge, u), (edge, v), (turned, u), (turned, v)))
    uu, uv, vv, none = (eu * eu).sum(-1), (eu * ev).sum(-1), (ev * ev).sum(-1), np.zeros(len(u))
    matrix = np.stack([uu, uv, none, uv, uu + vv, uv, none, uv, vv], -1).reshape(-1, 3, 3)
    matrix += np.eye(3) * 1e-6 * (uu + vv)[:, None, None]
    right = np.stack([(eu * nu).sum(-1), (ev * nu + eu * nv).sum(-1), (ev * nv).sum(-1)], -1)
    a, b, c = np.linalg.solve(matrix, right[..., None])[..., 0].T
    return np.stack(
        [a * u[:, i] * u[:, j] + b * (u[:, i] * v[:, j] + v[:, i] * u[:, j]) + c * v[:, i] * v[:, j] for i, j in _ENTRIES], -1
    )


_ENTRIES = ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0))


def _principal(tensor: np.ndarray, normal: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """((T,) least, (T,) most) curvature across the normals."""
    full = np.empty((len(tensor), 3, 3))
    for entry, (i, j) in zip(tensor.T, _ENTRIES, strict=True):
        full[:, i, j] = full[:, j, i] = entry
    u, v = _frames(normal)
    uu, uv, vv = (np.einsum("ti,tij,tj->t", a, full, b) for a, b in ((u, u), (u, v), (v, v)))
    mean, half = (uu + vv) / 2, np.hypot((uu - vv) / 2, uv)
    return mean - half, mean + half
