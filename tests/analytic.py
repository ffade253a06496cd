"""Scenes with closed-form answers: what the methods' mathematics is judged by. NumPy in float64, no code under test.

A `Room` is a box turned any way; `look_at` traces it as scene/raytrace.py would trace a real scene, so that a method's own
bake can run on it without Blender.
"""

from dataclasses import dataclass, field

import numpy as np

from reflect_addon.core.rays import Hits, Rays

SKY = 1.0e9  # spaces.FAR, written out: a test that read it from the code could not see it change


def rotation(rng) -> np.ndarray:
    """(3, 3) a random turn: rows are orthonormal axes, right-handed."""
    q, r = np.linalg.qr(rng.normal(size=(3, 3)))
    q = q * np.sign(np.diag(r))
    return q if np.linalg.det(q) > 0 else -q


def unit(vectors) -> np.ndarray:
    vectors = np.asarray(vectors, np.float64)
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def directions(rng, count: int) -> np.ndarray:
    """(count, 3) float64 unit vectors, evenly random; the first 26 point along axes, edges and corners of a cube."""
    d = rng.normal(size=(count, 3))
    steps = np.stack(np.meshgrid(*[[-1.0, 0.0, 1.0]] * 3), -1).reshape(-1, 3)
    steps = steps[np.abs(steps).sum(1) > 0]
    d[: len(steps)] = steps[: len(d)]
    return unit(d)


def smooth(direction) -> np.ndarray:
    """(..., 3) positive radiance that changes slowly and differs in all directions; at most 1.5 per radian."""
    d = unit(direction)
    return np.stack([2 + d[..., 0] + 0.5 * d[..., 1] * d[..., 2], 2 + d[..., 1] ** 2 - d[..., 2], 2 + d[..., 2] * d[..., 0]], -1)


@dataclass(frozen=True)
class Room:
    """An empty box seen from inside. axes: rows, world; low, high: along the axes from `center`, world, m."""

    axes: np.ndarray
    low: np.ndarray
    high: np.ndarray
    center: np.ndarray
    open_sides: tuple[int, ...] = ()  # cube-face indices that show the sky
    spheres: tuple = field(default=())  # ((3,) world centre, radius) of furniture

    def exits(self, origin, direction) -> np.ndarray:
        """(N,) distance to the wall, plane by plane: the smallest positive one of six, SKY through an open side."""
        p = (np.asarray(origin, np.float64) - self.center) @ self.axes.T
        d = np.asarray(direction, np.float64) @ self.axes.T
        nearest, face_of = np.full(len(d), np.inf), np.zeros(len(d), int)
        for face in range(6):
            axis, outward = face // 2, 1 - 2 * (face % 2)
            wall = self.high[axis] if outward > 0 else self.low[axis]
            leaving = d[:, axis] * outward > 0
            t = np.full(len(d), np.inf)
            t[leaving] = (wall - p[leaving, axis]) / d[leaving, axis]
            face_of = np.where(t < nearest, face, face_of)
            nearest = np.minimum(nearest, t)
        return np.where(np.isin(face_of, self.open_sides), SKY, nearest)

    def distances(self, origin, direction) -> np.ndarray:
        """exits, or the nearer furniture."""
        out = self.exits(origin, direction)
        for middle, radius in self.spheres:
            out = np.minimum(out, sphere_distance(origin, direction, middle, radius))
        return out

    def look_at(self, rays: Rays, hide=(), samples=1, paint=smooth) -> Hits:
        """A tracer for BakeJob: radiance is paint(direction from the room's centre to what is hit)."""
        t = self.distances(rays.origin, rays.direction)
        return hits(rays, t, lambda position: paint(position - self.center))


def sphere_distance(origin, direction, middle, radius) -> np.ndarray:
    """(N,) nearest positive intersection with a sphere by the quadratic's roots, inf where there is none."""
    m = np.asarray(origin, np.float64) - middle
    d = np.asarray(direction, np.float64)
    b, c = (m * d).sum(-1), (m * m).sum(-1) - radius**2
    root = np.sqrt(np.maximum(b * b - c, 0))
    t = np.where(-b - root > 0, -b - root, -b + root)
    return np.where((b * b >= c) & (t > 0), t, np.inf)


def hits(rays: Rays, distance, paint) -> Hits:
    """Hits at these distances; SKY or more is the sky."""
    hit = distance < SKY
    position = np.asarray(rays.origin, np.float64) + np.asarray(rays.direction, np.float64) * np.minimum(distance, SKY)[:, None]
    return Hits(
        np.asarray(paint(position), np.float32), position.astype(np.float32), -np.asarray(rays.direction, np.float32),
        np.where(hit, 0, -1).astype(np.int32), hit, ("Room",),
    )  # fmt: skip


def random_room(rng, least=1.0, most=6.0, center=(0.0, 0.0, 0.0)) -> Room:
    """Turned any way, its centre anywhere in the middle 80 % of its sides."""
    size, share = rng.uniform(least, most, 3), rng.uniform(0.1, 0.9, 3)
    return Room(rotation(rng), -size * share, size * (1 - share), np.asarray(center, np.float64))
