"""The shortest way from an eye to a vertex over a surface: where light goes, by Fermat [the truth that searches are held against].

The length of the way over a point of the surface is minimised in two parameters of the surface, by Newton's method with the Hessian's
eigenvalues made positive and steps halved until the way gets shorter; all pairs at once, in float64. Surfaces are known_reflectors.Known.
Limits. Convex surfaces, whose way has one minimum. Derivatives of the surface are differences.
"""

import numpy as np

# Halvings of a step, and steps, after which a way is as short as float64 can tell.
HALVINGS, STEPS = 12, 60


def way(eye, vertex, point) -> np.ndarray:
    """(N,) length of the way from eye to vertex over points (N, 3)."""
    return np.linalg.norm(eye - point, axis=-1) + np.linalg.norm(vertex - point, axis=-1)


def reflected(known, eye, vertex) -> np.ndarray:
    """(N, 3) where lit pairs are reflected by the endless surface of known_reflectors.Known: the shortest way's point."""
    p = known.touched(eye, vertex)
    left = np.arange(len(p))
    for _ in range(STEPS):
        shorter = _step(known, eye[left], vertex[left], p[left])
        moved = np.abs(shorter - p[left]).max(-1) > 1e-9
        p[left], left = shorter, left[moved]
        if not len(left):
            break
    # Lengths end at the square root of rounding; gradients do not.
    for _ in range(2):
        chart = known.chart(p)
        gradient, hessian = _derivatives(known, eye, vertex, chart)
        small = np.linalg.norm(gradient, axis=-1) < 1e-5
        move = np.zeros_like(gradient)
        move[small] = -np.linalg.solve(hessian[small] + 1e-12 * np.eye(2), gradient[small][..., None])[..., 0]
        p = known.point(move * np.minimum(1e-4 / np.maximum(np.linalg.norm(move, axis=-1, keepdims=True), 1e-30), 1), chart)
    return p


def _step(known, eye, vertex, p) -> np.ndarray:
    """(N, 3) points of shorter ways, or p where none is found."""
    chart = known.chart(p)
    gradient, hessian = _derivatives(known, eye, vertex, chart)
    values, axes = np.linalg.eigh(hessian)
    values = np.maximum(np.abs(values), 1e-9)
    move = -np.einsum("nij,nj->ni", axes, np.einsum("nji,nj->ni", axes, gradient) / values)
    move *= np.minimum(0.5 / np.maximum(np.linalg.norm(move, axis=-1, keepdims=True), 1e-30), 1)
    length, share, best = way(eye, vertex, p), 1.0, p
    left = np.ones(len(p), bool)
    for _ in range(HALVINGS):
        tried = known.point(move * share, chart)
        shorter = left & (way(eye, vertex, tried) < length)
        best = np.where(shorter[:, None], tried, best)
        left &= ~shorter
        share *= 0.5
        if not left.any():
            break
    return best


def _derivatives(known, eye, vertex, chart) -> tuple[np.ndarray, np.ndarray]:
    """(gradient (N, 2), Hessian (N, 2, 2)) of the way in the chart's parameters at 0; the surface's derivatives by differences."""
    h = 1e-4
    zero = np.zeros((len(eye), 2))
    x, y = np.array([h, 0.0]), np.array([0.0, h])
    p = known.point(zero, chart)
    ends = [known.point(zero + s, chart) for s in (x, -x, y, -y)]
    corners = [known.point(zero + s, chart) for s in (x + y, x - y, y - x, -x - y)]
    slope = np.stack([ends[0] - ends[1], ends[2] - ends[3]], 1) / (2 * h)
    xx, yy = (ends[0] - 2 * p + ends[1]) / h**2, (ends[2] - 2 * p + ends[3]) / h**2
    xy = (corners[0] - corners[1] - corners[2] + corners[3]) / (4 * h**2)
    bent = np.stack([np.stack([xx, xy], 1), np.stack([xy, yy], 1)], 1)
    gradient, hessian = 0.0, 0.0
    for other in (eye, vertex):
        to = p - other
        distance = np.linalg.norm(to, axis=-1)[:, None]
        away = to / distance
        along = np.einsum("nix,nx->ni", slope, away)
        gradient = gradient + along
        across = np.einsum("nix,njx->nij", slope, slope) - along[:, :, None] * along[:, None]
        hessian = hessian + across / distance[..., None] + np.einsum("nijx,nx->nij", bent, away)
    return gradient, hessian
