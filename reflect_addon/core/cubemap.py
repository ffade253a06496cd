"""Cube maps as one flat image: where each texel looks, the pyramid, and the look-up as a kernel.

Problem. A kernel may fetch from two-dimensional images only (docs/design), and bilinear look-ups across cube edges
must not show seams.

Layout. Level 0 is a row of six faces, each n x n texels inside a border of one texel, so (n+2) high and 6(n+2) wide.
Border texels look past the face's edge along the face's own plane; a bilinear look-up therefore never needs the
neighbour face. Above it stand the coarser levels: level 1 at the left, levels 2, 3, ... in a column to its right, so
that every offset has a closed form and the whole takes about 9 n^2 texels (8 n^2 would be the least possible).

Channels: rgb = radiance / radiance_scale; a = distance / distance_scale, 0 where the sky is seen. The farthest surface
stands near the top of the half floats' range, so that what is a billion times nearer still keeps all its 11 bits.
"""

import numpy as np

from . import spaces
from .asset import half_with_scale
from .rays import Hits, Rays

# Coarsest level: below 4 texels a face no longer holds a gradient, and its border outweighs it.
COARSEST = 4
# The stored distance of the farthest surface: below the largest half float, a power of two.
FARTHEST = 32768.0


def level_count(n: int) -> int:
    """Levels of a cube map with n (a power of two, at least COARSEST) texels along a face's edge."""
    return int(np.log2(n // COARSEST)) + 1


def level_origin(n: int, level: int) -> tuple[int, int]:
    """(x, y) of a level's lowest left texel in the image."""
    if level == 0:
        return 0, 0
    if level == 1:
        return 0, n + 2
    return 6 * (n // 2 + 2), n + 2 + n // 2 - (2 * n >> level) + 2 * (level - 2)


def image_size(n: int) -> tuple[int, int]:
    """(height, width) of the image that holds all levels."""
    top = max(level_origin(n, i)[1] + (n >> i) + 2 for i in range(level_count(n)))
    return top, 6 * (n + 2)


def check_resolution(n: int) -> None:
    if n < COARSEST or n & (n - 1):
        raise ValueError(f"a cube map's resolution must be a power of two of at least {COARSEST}, not {n}")


def texel_directions(n: int) -> np.ndarray:
    """(n+2, 6(n+2), 3) float64 unit directions of the texel centres of one level, borders included."""
    step = (np.arange(n + 2) - 0.5) / n * 2 - 1
    face, s = np.divmod(np.arange(6 * (n + 2)), n + 2)
    direction = spaces.cube_direction(face[None, :], step[s][None, :], step[:, None])
    return direction / np.linalg.norm(direction, axis=-1, keepdims=True)


def bundle(center: np.ndarray, n: int) -> Rays:
    """The rays that fill level 0, in row order."""
    direction = texel_directions(n).reshape(-1, 3)
    return Rays(np.broadcast_to(np.asarray(center, np.float32), direction.shape).copy(), direction.astype(np.float32))


def assemble(center: np.ndarray, n: int, hits: Hits) -> tuple[np.ndarray, dict[str, float]]:
    """(image (H, W, 4) float16, uniforms) from the traced bundle.

    Distances are taken from the hit positions; the sky has alpha 0.
    """
    distance = np.linalg.norm(hits.position.astype(np.float64) - np.asarray(center, np.float64), axis=-1)
    distance = np.where(hits.hit, distance, 0.0)
    distance_scale = (float(distance.max(initial=0.0)) or 1.0) / FARTHEST
    radiance, scale = half_with_scale(hits.radiance)
    level = np.empty((n + 2, 6 * (n + 2), 4), np.float32)
    level[..., :3] = radiance.reshape(level.shape[:2] + (3,))
    level[..., 3] = (distance / distance_scale).reshape(level.shape[:2])
    return pyramid(level), {
        "radiance_scale": scale,
        "distance_scale": distance_scale,
        "cube_size": float(n),
        "cube_coarsest": float(level_count(n) - 1),
    }


def pyramid(level: np.ndarray) -> np.ndarray:
    """(H, W, 4) float16: the image of a level 0 (n + 2, 6 (n + 2), 4) float32 and its coarser levels."""
    n = level.shape[0] - 2
    image = np.zeros(image_size(n) + (4,), np.float16)
    for i in range(level_count(n)):
        x, y = level_origin(n, i)
        image[y : y + level.shape[0], x : x + level.shape[1]] = level
        if i + 1 < level_count(n):
            level = _halved(level)
    return image


def _halved(level: np.ndarray) -> np.ndarray:
    """The next coarser level: 2x2 means inside the faces; borders looked up where their direction really points."""
    n = level.shape[0] - 2
    faces = level.reshape(n + 2, 6, n + 2, 4)[1:-1, :, 1:-1]
    half = n // 2
    out = np.pad(faces.reshape(half, 2, 6, half, 2, 4).mean((1, 4)), ((1, 1), (0, 0), (1, 1), (0, 0)), mode="edge")
    border = np.ones((half + 2, half + 2), bool)
    border[1:-1, 1:-1] = False
    directions = texel_directions(half).reshape(half + 2, 6, half + 2, 3).transpose(1, 0, 2, 3)[:, border]
    face, s, t = spaces.cube_coordinates(directions)
    # The second round is for the cube's corners, whose texels lie between two borders of the first.
    for _ in range(2):
        values = _bilinear(out, face, (s + 1) / 2 * half + 1, (t + 1) / 2 * half + 1)
        for f in range(6):
            out[:, f][border] = values[f]
    return out.reshape(half + 2, 6 * (half + 2), 4)


def _bilinear(faces: np.ndarray, face: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """(..., 4) of faces with borders (n + 2, 6, n + 2, 4) at texel coordinates x, y (...). The nearest texel would be up to
    half a texel off along the edge, and that shows as a seam."""
    i, j = (x - 0.5).astype(int), (y - 0.5).astype(int)
    fx, fy = (x - 0.5 - i)[..., None], (y - 0.5 - j)[..., None]
    low, high = (faces[j + k, face, i] * (1 - fx) + faces[j + k, face, i + 1] * fx for k in (0, 1))
    return low * (1 - fy) + high * fy


def surface_points(image: np.ndarray, uniforms: dict) -> tuple[np.ndarray, np.ndarray]:
    """((M, 3) float64 world points, (M,) solid angles) of the surfaces that level 0 saw; sky and borders left out."""
    n = int(uniforms["cube_size"])
    inner = np.zeros((n + 2, 6, n + 2), bool)
    inner[1:-1, :, 1:-1] = True
    stored = image[: n + 2, : 6 * (n + 2), 3].astype(np.float64)
    seen = inner.reshape(stored.shape) & (stored > 0)
    directions = texel_directions(n)[seen]
    # A texel's solid angle falls with the cube of its direction's major component over its length.
    weight = np.abs(directions).max(-1) ** 3 * (2 / n) ** 2
    distance = stored[seen] * uniforms["distance_scale"]
    return np.asarray(uniforms["center"]) + directions * distance[:, None], weight


def look_up(k, asset, direction, angle, bottom=0.0, scales=None):
    """Kernel: (radiance vec3, distance float from the centre, FAR for the sky) seen along `direction`.

    direction: vec3 of any length > 0; angle: the footprint's full angle in radians as seen from the centre.
    bottom, scales: of several maps in one image, the row where this one begins and what its radiance and distance are
    stored divided by.
    """
    image, n = asset.images["radiance_tx"], asset.uniforms["cube_size"]
    radiance_scale, distance_scale = scales or (asset.uniforms["radiance_scale"], asset.uniforms["distance_scale"])
    face, s, t = face_of(k, direction)
    # A texel near the middle of a face is 2 / n radians wide; coarser levels only where the footprint passes that.
    coarsest = asset.uniforms["cube_coarsest"]
    level = k.name("cube_level", k.min(k.log2(k.max(angle * n * 0.5, 1.0)), coarsest))
    texel = blend_levels(k, level, coarsest, lambda i: _sample(k, image, n, i, bottom, face, s, t))
    radiance = k.name("cube_radiance", texel.xyz * radiance_scale)
    # Distance is not blended: between a near and a far surface a mean would be a place that does not exist.
    x, y = _texel(n, 1.0, 0.0, bottom, face, s, t)
    stored = k.fetch(image, k.floor(x), k.floor(y)).w
    distance = k.select(stored > 0.0, stored * distance_scale, spaces.FAR)
    return radiance, k.name("cube_distance", distance)


def stored_distance(k, asset, direction, bottom=0.0, blended=False):
    """Kernel: the distance along `direction` as it is stored, over distance_scale; 0 for the sky. Of the nearest texel, or
    blended of four, which beside the sky is nearer than any of them."""
    image = asset.images["radiance_tx"]
    x, y = _texel(asset.uniforms["cube_size"], 1.0, 0.0, bottom, *face_of(k, direction))
    return (k.sample(image, x, y) if blended else k.fetch(image, k.floor(x), k.floor(y))).w


def blend_levels(k, level, coarsest, sample_at):
    """Kernel: trilinear look-up, level in 0..coarsest; the second level is only read where the level is above 0.

    A level that rounding puts on the other side of a whole number is blended with the other neighbour at a share near
    0 or 1, so that the inexact log2 of graphics cards shows nowhere.
    """
    low = k.name("low_level", k.max(k.min(k.floor(level), coarsest - 1.0), 0.0))  # never reads past the coarsest
    fine = sample_at(low)
    return k.branch(level > 0.0, lambda: (k.mix(fine, sample_at(low + 1.0), level - low),), lambda: (fine,))[0]


def face_of(k, d):
    """Kernel form of spaces.cube_coordinates; on ties the first axis wins."""
    ax, ay, az = k.abs(d.x), k.abs(d.y), k.abs(d.z)
    is_x = (ax >= ay) & (ax >= az)
    is_y = ay >= az
    major = k.select(is_x, d.x, k.select(is_y, d.y, d.z))
    s = k.select(is_x, d.y, k.select(is_y, d.z, d.x))
    t = k.select(is_x, d.z, k.select(is_y, d.x, d.y))
    face = k.select(is_x, 0.0, k.select(is_y, 2.0, 4.0)) + k.select(major < 0.0, 1.0, 0.0)
    # A zero direction (no reflection at all) must not become NaN: any texel will do for it.
    inverse = 1.0 / k.max(k.abs(major), 1e-30)
    return k.name("cube_face", face), k.name("face_s", s * inverse), k.name("face_t", t * inverse)


ACROSS_INPUTS = {"face": "float", "s": "float", "t": "float"}


def across(k, scope, face, s, t):
    """Kernel: {face, s, t} of what is seen at coordinates of a face that pass its edge: spaces.cube_direction, then face_of."""
    axis = k.floor(face * 0.5)
    sign = 1.0 - 2.0 * (face - 2.0 * axis)
    is_x, is_y = axis < 0.5, axis < 1.5
    x = k.select(is_x, sign, k.select(is_y, t, s))
    y = k.select(is_x, s, k.select(is_y, sign, t))
    z = k.select(is_x, t, k.select(is_y, s, sign))
    return dict(zip(("face", "s", "t"), face_of(k, k.vec3(x, y, z)), strict=True))


def _texel(n, scale, x0, y0, face, s, t):
    """Texel coordinates in the image of face coordinates (s, t) in a level of n * scale texels at (x0, y0)."""
    size = n * scale
    x = x0 + face * (size + 2.0) + 1.0 + (s + 1.0) * 0.5 * size
    y = y0 + 1.0 + (t + 1.0) * 0.5 * size
    return x, y


def _sample(k, image, n, level, bottom, face, s, t):
    """Bilinear texel of one level."""
    # exp2 may be off by a rounding: 1e-4 of a texel, and the border keeps even that inside the face.
    scale = k.name("level_scale", k.select(level >= 1.0, k.exp2(-level), 1.0))
    column = level >= 2.0
    x0 = k.select(column, 3.0 * n + 12.0, 0.0)
    high = n + 2.0 + 0.5 * n - 2.0 * n * scale + 2.0 * (level - 2.0)
    y0 = k.select(column, high, k.select(level >= 1.0, n + 2.0, 0.0))
    return k.sample(image, *_texel(n, scale, x0, y0 + bottom, face, s, t))
