"""What tests of reflector maps and searches share: formulas, Alhazen's solution, a bevelled cube, a recorder of single functions."""

import numpy as np
from analytic import unit

from reflect_addon.evaluation import known_reflectors as known

ROUND = {
    "sphere": known.ellipsoid(1, 1, 1),
    "ellipsoid": known.ellipsoid(1, 0.5, 0.7),
    "ellipsoid 5:1": known.ellipsoid(1, 0.2, 1),
    "ellipsoid 10:1": known.ellipsoid(1, 0.1, 0.1),
    "ellipsoid 50:1": known.ellipsoid(1, 0.02, 0.02),
}
OPEN = {"plane": known.plane(), "paraboloid": known.paraboloid()}


def bevelled_cube(bevel: float = 0.01):
    """surface(directions) of a cube with edges rounded over `bevel`, half sides 1 / sqrt(3)."""
    half = 3**-0.5

    def surface(d):
        low, high = np.zeros(len(d)), np.full(len(d), 2.0)
        for _ in range(60):
            middle = (low + high) / 2
            p = d * middle[:, None]
            outside = np.linalg.norm(p - np.clip(p, bevel - half, half - bevel), axis=-1) > bevel
            low, high = np.where(outside, low, middle), np.where(outside, middle, high)
        p = d * high[:, None]
        return high, unit(p - np.clip(p, bevel - half, half - bevel)), np.ones(len(d), bool)

    return surface


def alhazen(eye, vertex) -> np.ndarray:
    """(N, 3) where the unit sphere reflects: the root of Alhazen's quartic with the shortest way.

    In the plane of centre, eye a (real) and vertex b, the point z of the unit circle has (a - z)(b - z) / z^2 real, that is
    a b* z^4 - (a + b*) z^3 + (a + b) z - a b = 0."""
    first = unit(eye)
    second = unit(vertex - (vertex * first).sum(-1, keepdims=True) * first)
    a, b = np.linalg.norm(eye, axis=-1), (vertex * first).sum(-1) + 1j * (vertex * second).sum(-1)
    quartic = np.stack([a * b.conj(), -(a + b.conj()), 0 * b, a + b, -a * b], -1)
    companion = np.zeros((len(a), 4, 4), complex)
    companion[:, 0] = -quartic[:, 1:] / quartic[:, :1]
    companion[:, [1, 2, 3], [0, 1, 2]] = 1
    roots = np.linalg.eigvals(companion)
    z = roots / np.abs(roots)
    off_circle = np.abs(np.abs(roots) - 1) > 1e-5
    best = (np.abs(z - a[:, None]) + np.abs(z - b[:, None]) + 1e9 * off_circle).argmin(-1)
    z = np.take_along_axis(z, best[:, None], -1)
    return z.real * first + z.imag * second


def off(answer: dict, point) -> np.ndarray:
    """(N,) distance of what was found from the true points."""
    return np.linalg.norm(answer["point"][:, :3] - point, axis=-1)
