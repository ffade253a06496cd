"""Four ways to keep all directions in one picture: sphere map, cube map, dual paraboloid, octahedron [nielsen-2002 2.3 and section 4].

Problem. The paper draws curved mirrors with a sphere map for each viewer or a cube map for all, and expects "a less complex environment map
representation than cube mapping (e.g. dual-paraboloid mapping)" to be faster.
Idea. Each is a projection between directions and a unit square, kernels in the language of all methods, so NumPy measures what a shader does:
  * sphere: the picture of a mirror ball from far away along +Z; all directions, the one behind stretched over the whole rim [Haeberli, Segal 1993]
  * cube: six faces (core/cubemap.py), here without borders, in a row of a square's height each
  * dual paraboloid: two mirrors back to back along Z, each for its half of the directions [Heidrich and Seidel 1998]
  * octahedral: the directions' octahedron, its lower half folded out into the corners of the square [Praun and Hoppe 2003]
Projected by vertices, only the cube's faces are pictures that rasterisers draw: straight lines stay straight. The others are drawn bent,
which needs small triangles, or from a cube map by one pass more. The paper's sphere map is one wide view (curved_views.approximate_view).
Limits. Bilinear look-ups do not cross the seams of cube, paraboloid and octahedron; they are clamped there.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from . import cubemap, spaces


@dataclass(frozen=True)
class Projection:
    """A map's layout: `pictures` squares in a row."""

    name: str
    pictures: int
    passes: int  # views of the scene that fill it: a view has less than 180 degrees, and a cube map's faces are the least that see all
    place: Callable  # kernel (k, scope, direction) -> {picture, s, t}, s, t in -1..1
    directions: Callable  # (picture, s, t) arrays -> (..., 3) float64 directions of any length; NaN outside of the map


INPUTS = {"direction": "vec3"}


def _sphere(k, scope, direction):
    m = k.sqrt(2.0 * k.max(1.0 + direction.z, 1e-12))
    return {"picture": 0.0, "s": direction.x / m, "t": direction.y / m}


def _from_sphere(picture, s, t):
    square = s * s + t * t
    with np.errstate(invalid="ignore"):
        around = 2.0 * np.sqrt(1.0 - square)
    return np.stack([s * around, t * around, np.where(square <= 1, 1.0 - 2.0 * square, np.nan)], -1)


def _cube(k, scope, direction):
    face, s, t = cubemap.face_of(k, direction)
    return {"picture": face, "s": s, "t": t}


def _paraboloid(k, scope, direction):
    m = 1.0 / (1.0 + k.abs(direction.z))
    return {"picture": k.select(direction.z < 0.0, 1.0, 0.0), "s": direction.x * m, "t": direction.y * m}


def _from_paraboloid(picture, s, t):
    # Beyond the rim each goes on into the other's half, which is what a look-up beside the seam blends.
    return np.stack([s, t, (0.5 - 0.5 * (s * s + t * t)) * (1.0 - 2.0 * picture)], -1)


def _octahedron(k, scope, direction):
    scale = 1.0 / (k.abs(direction.x) + k.abs(direction.y) + k.abs(direction.z))
    x, y = direction.x * scale, direction.y * scale
    side_x, side_y = k.select(x < 0.0, -1.0, 1.0), k.select(y < 0.0, -1.0, 1.0)
    below = direction.z < 0.0
    return {
        "picture": 0.0,
        "s": k.select(below, (1.0 - k.abs(y)) * side_x, x),
        "t": k.select(below, (1.0 - k.abs(x)) * side_y, y),
    }


def _from_octahedron(picture, s, t):
    z = 1.0 - np.abs(s) - np.abs(t)
    fold = np.maximum(-z, 0.0)
    return np.stack([s - np.copysign(fold, s), t - np.copysign(fold, t), z], -1)


# The sphere map as the paper makes it is one view of less than half of all directions; a whole one is made from a cube map.
PROJECTIONS = (
    Projection("sphere", 1, 1 + 6, _sphere, _from_sphere),
    Projection("cube", 6, 6, _cube, spaces.cube_direction),
    Projection("dual paraboloid", 2, 1 + 6, _paraboloid, _from_paraboloid),
    Projection("octahedral", 1, 1 + 6, _octahedron, _from_octahedron),
)


def side_for(projection: Projection, texels: int) -> int:
    """px of a picture's side so that all pictures have about so many texels."""
    return int(round((texels / projection.pictures) ** 0.5))


def filled(projection: Projection, side: int, radiance) -> np.ndarray:
    """(side, pictures * side, 3) float64; radiance: (N, 3) unit directions -> (N, 3). Corners outside of a map hold the nearest rim's."""
    step = (np.arange(side) + 0.5) / side * 2 - 1
    picture, s, t = np.broadcast_arrays(np.repeat(np.arange(projection.pictures), side)[None], np.tile(step, projection.pictures)[None], step[:, None])
    direction = projection.directions(picture, s, t)
    outside = ~np.isfinite(direction).all(-1)
    if outside.any():
        rim = np.maximum(np.hypot(s, t), 1.0) * (1 + 1e-9)
        direction = np.where(outside[..., None], projection.directions(picture, s / rim, t / rim), direction)
    direction = direction / np.linalg.norm(direction, axis=-1, keepdims=True)
    return radiance(direction.reshape(-1, 3)).reshape(side, -1, 3)


def look_up(picture: np.ndarray, s: np.ndarray, t: np.ndarray, image: np.ndarray) -> np.ndarray:
    """(N, 3): bilinear, within one picture. picture, s, t: (N,), as `place` says."""
    side = image.shape[0]
    x, y = (np.clip((c + 1) / 2 * side - 0.5, 0, side - 1) for c in (s, t))
    i, j = np.minimum(x.astype(int), side - 2), np.minimum(y.astype(int), side - 2)
    fx, fy = (x - i)[:, None], (y - j)[:, None]
    first = np.rint(picture).astype(int) * side + i
    low, high = (image[j + k, first] * (1 - fx) + image[j + k, first + 1] * fx for k in (0, 1))
    return low * (1 - fy) + high * fy
