"""Reflector maps: position and normal of a reflector over directions from its centre [estalella-2005 section 4.1].

Problem. The search for a reflection point walks over the reflector and may ask for nothing but look-ups.
Idea. A star-shaped piece of surface is a function of the direction from a centre; two images hold its positions and normals. They
are made once, from the reflector alone, as finely as wanted (4.1), and know nothing of eye and scene.
Layout. Cubes, as the paper's: six faces in a row, in a border that goes on in the face's own plane (cubemap.py), so that no look-up
crosses an edge. An octahedron unfolded into one square [Engelhardt and Dachsbacher 2008] was tried: a bilinear look-up across its folds
errs by a texel, not by its square, and that is where searches failed (256 texels: 3e-3 of the size at the folds, 6e-6 on cubes).
Closing. Where the rays from the centre miss an open reflector (6.2), its tangent planes go on, farther off means of them:
a search may pass there, and says so when it ends there. What is convex goes on to where all its tangent planes leave room, and so stays
convex: a vertex has one reflection point on it, and is hidden where the line of sight passes through. w of a position is 1 on the
reflector and 0 where it was closed.
Limits. What is not star-shaped needs several maps (reflector_parts.py). Bilinear: errors fall with the square of a texel's size.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .asset_document import MAX_SIDE
from .cubemap import face_of, texel_directions
from .errors import ReflectError
from .pull_push import continued

IMAGES = ("reflector_position_buf", "reflector_normal_buf")
# Rows of an atlas, as many as every graphics card holds.
TALLEST = 8192
# Rounds in which tangent planes go on, a texel each; after that a plane may be far away.
PLANES = 4
# A tangent plane goes on where it is met no flatter than this and no farther than so many times its own distance.
STEEP, FAR_OFF = 0.2, 2.0

# Tangent planes that close a convex surface: of its rim, and of all of it, about as many. Texels at a time.
ENCLOSING, BATCH = 1024, 4096

# surface(directions (N, 3) unit) -> (distance (N,) m, normal (N, 3) unit, inside (N,) bool): what rays from the centre meet.
Surface = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray, np.ndarray]]


@dataclass(frozen=True)
class ReflectorMap:
    """One piece of a reflector. Map space: world axes at the bake, (x - center) / size."""

    center: np.ndarray  # (3,) float64, world, m
    size: float  # m
    position: np.ndarray  # (n, 6 n, 4) float32, n = side + 2, map space; w 1 on the reflector, 0 where it was closed
    normal: np.ndarray  # (n, 6 n, 4) float32, unit, of the reflecting side; w unused

    @property
    def side(self) -> int:
        return len(self.position) - 2


def build(center: np.ndarray, size: float, side: int, surface: Surface, convex: bool = False) -> ReflectorMap:
    """The map of what rays from the centre meet. side: texels along a face's edge, from 2 on; convex: how it is closed."""
    directions = texel_directions(side).reshape(side + 2, 6, side + 2, 3).swapaxes(0, 1)
    distance, normal, inside = surface(directions.reshape(-1, 3))
    shape = directions.shape[:3]
    inside = (inside & np.isfinite(distance) & (distance > 0)).reshape(shape)
    distance = np.where(inside, np.reshape(distance, shape) / (size or 1.0), 0.0)
    normal = np.where(inside[..., None], np.reshape(normal, directions.shape), 0.0)
    distance, normal = (_enclosed if convex else _closed)(directions, distance, normal, inside)
    position = np.concatenate([directions * distance[..., None], inside[..., None]], -1)
    normal = np.concatenate([normal, np.zeros((*shape, 1))], -1)
    return ReflectorMap(np.asarray(center, np.float64), float(size), *(_in_a_row(v) for v in (position, normal)))


def atlas(maps: list[ReflectorMap]) -> tuple[dict[str, np.ndarray], list[tuple[float, float, float]]]:
    """(images by name (H, W, 4) float32, block (x, y, side) of each map), one above the other, in columns of at most TALLEST.

    ReflectError when that is more than an asset's images may hold."""
    blocks, columns, x, y = [], [[]], 0, 0
    for one in maps:
        height, width = one.position.shape[:2]
        if y + height > TALLEST:
            x, y = x + max(m.position.shape[1] for m in columns[-1]), 0
            columns.append([])
        columns[-1].append(one)
        blocks.append((float(x), float(y), float(one.side)))
        y += height
    size = max(sum(len(m.position) for m in column) for column in columns), sum(max(m.position.shape[1] for m in c) for c in columns)
    if max(size) > MAX_SIDE:
        raise ReflectError(f"{len(maps)} reflector maps of up to {maps[0].side} texels do not fit one image.", "Lower Map Texels or Parts.")
    images = {name: np.zeros((*size, 4), np.float32) for name in IMAGES}
    for one, (x, y, _) in zip(maps, blocks, strict=True):
        height, width = one.position.shape[:2]
        for name, values in zip(IMAGES, (one.position, one.normal), strict=True):
            images[name][int(y) : int(y) + height, int(x) : int(x) + width] = values
    return images, blocks


def _in_a_row(faces: np.ndarray) -> np.ndarray:
    """(6, n, n, 4) as (n, 6 n, 4) float32."""
    return faces.swapaxes(0, 1).reshape(faces.shape[1], -1, 4).astype(np.float32)


def _enclosed(directions, distance, normal, inside) -> tuple[np.ndarray, np.ndarray]:
    """As _closed, of a convex surface: out to the nearest of its tangent planes, no farther than FAR_OFF of its farthest point."""
    if inside.all() or not inside.any():
        return _closed(directions, distance, normal, inside)
    rim = np.flatnonzero(inside & _beside(~inside))
    within = np.flatnonzero(inside)
    chosen = np.concatenate([found[:: max(len(found) // ENCLOSING, 1)] for found in (rim, within)])
    planes = normal.reshape(-1, 3)[chosen]
    offset = np.einsum("nc,nc->n", planes, directions.reshape(-1, 3)[chosen]) * distance.reshape(-1)[chosen]
    planes, offset = planes[offset > 0], offset[offset > 0]
    farthest = FAR_OFF * distance.max()
    distance, normal = distance.reshape(-1), normal.reshape(-1, 3)
    rest = np.flatnonzero(~inside)
    for first in range(0, len(rest), BATCH):
        some = rest[first : first + BATCH]
        along = directions.reshape(-1, 3)[some]
        nearness = (along @ planes.T) / offset  # of the plane's place on the ray, inverse
        which = nearness.argmax(1)
        met = nearness[np.arange(len(some)), which] * farthest > 1
        distance[some] = np.where(met, 1 / np.maximum(nearness.max(1), 1 / farthest), farthest)
        normal[some] = np.where(met[:, None], planes[which], along)
    return distance.reshape(inside.shape), normal.reshape(directions.shape)


def _closed(directions, distance, normal, inside) -> tuple[np.ndarray, np.ndarray]:
    """(distance, unit normal) everywhere; all (6, n, n, ...). distance and normal are written to."""
    known = inside.copy()
    if known.all():
        return distance, normal
    if not known.any():
        return np.ones_like(distance), directions
    offset = np.einsum("fyxc,fyxc->fyx", directions, normal) * distance
    # (normal, its plane's distance from the centre, the point's, 1), in a border of nothing.
    planes = np.concatenate([normal, np.stack([offset, distance, np.ones_like(distance)], -1)], -1) * known[..., None]
    planes = np.pad(planes, ((0, 0), (1, 1), (1, 1), (0, 0)))
    for _ in range(PLANES):
        f, y, x = np.nonzero(~known & _beside(known))
        near = planes[f, y, x + 1] + planes[f, y + 2, x + 1] + planes[f, y + 1, x] + planes[f, y + 1, x + 2]
        mean = near[:, :5] / near[:, 5:]
        length = np.maximum(np.linalg.norm(mean[:, :3], axis=-1), 1e-12)
        facing = (directions[f, y, x] * mean[:, :3]).sum(-1)
        met = mean[:, 3] / np.where(np.abs(facing) > STEEP * length, facing, np.inf)
        fresh = (met > 0) & (met < FAR_OFF * mean[:, 4])
        f, y, x, mean, met, length = (v[fresh] for v in (f, y, x, mean, met, length))
        distance[f, y, x], normal[f, y, x], known[f, y, x] = met, mean[:, :3] / length[:, None], True
        offset = (directions[f, y, x] * normal[f, y, x]).sum(-1) * met
        planes[f, y + 1, x + 1] = np.concatenate([normal[f, y, x], np.stack([offset, met, np.ones_like(met)], -1)], -1)
    # Farther off: planes that are means of ever wider parts of the rim, no farther than FAR_OFF.
    facing = np.einsum("fyxc,fyxc->fyx", directions, normal)
    weights = known.astype(float)[..., None]
    spread = _spread(np.concatenate([normal, (facing * distance)[..., None], distance[..., None]], -1) * weights, weights[..., 0])
    turned, offset, far = spread[..., :3], spread[..., 3], spread[..., 4]
    length = np.linalg.norm(turned, axis=-1, keepdims=True)
    turned = np.where(length > 1e-6, turned / np.maximum(length, 1e-12), directions)
    facing, offset = np.einsum("fyxc,fyxc->fyx", directions, turned), offset / np.maximum(length[..., 0], 1e-6)
    facing = np.where(offset < 0, -facing, facing)
    met = np.where(facing > 0, np.abs(offset) / np.maximum(facing, 1e-6), np.inf)
    far = np.minimum(met, FAR_OFF * far)
    return np.where(known, distance, far), np.where(known[..., None], normal, turned)


def _beside(known: np.ndarray) -> np.ndarray:
    """Whether one of the four neighbours within a face is."""
    out = np.zeros_like(known)
    out[:, 1:] |= known[:, :-1]
    out[:, :-1] |= known[:, 1:]
    out[:, :, 1:] |= known[:, :, :-1]
    out[:, :, :-1] |= known[:, :, 1:]
    return out


def _spread(values: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """values (6, n, n, c), already times weights, continued to where the weights are 0: means of ever wider parts of the cube.

    Faces lie in one picture, so what is near is near on the cube for the most part; what is far is all the same."""
    n, channels = values.shape[1], values.shape[-1]
    side = 1 << (n - 1).bit_length()
    out = np.empty(values.shape)
    for first in range(0, channels, 3):
        some = values[..., first : first + 3]
        picture = np.zeros((8, side, side, 4), np.float32)
        picture[:6, :n, :n, : some.shape[-1]], picture[:6, :n, :n, 3] = some, weights
        filled = continued(picture.reshape(8 * side, side, 4)).reshape(8, side, side, -1)
        out[..., first : first + 3] = filled[:6, :n, :n, : some.shape[-1]]
    return out


@dataclass(frozen=True)
class Look:
    """Kernel: one evaluation of a map: P and N, and how both change over a texel in either direction."""

    point: object  # vec3, map space
    normal: object  # vec3, not of unit length
    point_x: object
    point_y: object
    normal_x: object
    normal_y: object
    inside: object  # float: share of the four texels that are on the reflector


def look(k, scope, block, direction, slopes: bool = True) -> Look:
    """Kernel: bilinear look-up along `direction` (vec3 of any length) in the map of `block` (vec4: x, y, side, and 1 or -1:
    whether the normals are the map's or those of the other side)."""
    face, s, t = face_of(k, direction)
    x = k.name("map_x", block.x + face * (block.z + 2.0) + 0.5 + (s + 1.0) * 0.5 * block.z)
    y = k.name("map_y", block.y + 0.5 + (t + 1.0) * 0.5 * block.z)
    x0, y0 = k.floor(x), k.floor(y)
    fx, fy = x - x0, y - y0

    def bilinear(name):
        image = scope.images[name]
        a, b, c, d = (k.fetch(image, x0 + i, y0 + j) for j in (0.0, 1.0) for i in (0.0, 1.0))
        low, high = k.mix(a, b, fx), k.mix(c, d, fx)
        value = k.mix(low, high, fy)
        return value, k.mix(b - a, d - c, fy) if slopes else None, high - low if slopes else None

    position, position_x, position_y = bilinear(IMAGES[0])
    normal, normal_x, normal_y = bilinear(IMAGES[1])
    slope = (None,) * 4
    if slopes:
        slope = (position_x.xyz, position_y.xyz, normal_x.xyz * block.w, normal_y.xyz * block.w)
    return Look(position.xyz, normal.xyz * block.w, *slope, position.w)
