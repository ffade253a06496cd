"""Fit a box, turned any way, to a room seen from one point inside it.

Problem. Given points on the surfaces around a centre (from a cube map) and the solid angle each stands for, find the
box whose inner walls a ray from near the centre hits where it would hit the room.
Idea. Orientation from the points' own normals: in a room most solid angle lies on few directions. Then every point
belongs to the wall that its direction leaves the current box through; each wall moves to the weighted median of its
points' coordinates, and that is repeated until nothing changes. A median ignores the furniture as long as more than
half of what is seen in a wall's direction is the wall itself.
"""

from dataclasses import dataclass

import numpy as np

from . import spaces

# Rounds of assign-and-move; four settle rooms up to 20:1, the rest is for slabs.
ROUNDS = 12
# A side of which less than this share of its solid angle shows surfaces is open to the sky.
OPEN_SIDE = 0.25


@dataclass(frozen=True)
class Box:
    axes: np.ndarray  # (3, 3) float64, rows: the box's x, y, z in world space, orthonormal
    low: np.ndarray  # (3,) float64, m, along the axes, from the centre
    high: np.ndarray  # (3,) float64, m


def fit(points: np.ndarray, weight: np.ndarray, center) -> Box:
    """points (M, 3) world, weight (M,) steradian; an empty set gives a box at FAR (the sky's)."""
    relative = np.asarray(points, np.float64) - np.asarray(center, np.float64)
    if len(relative) < 16:
        return Box(np.eye(3), np.full(3, -spaces.FAR), np.full(3, spaces.FAR))
    candidates = [np.eye(3), _axes_from_planes(relative, weight)]
    boxes = [_fit_sides(relative @ axes.T, weight, axes) for axes in candidates]
    errors = [_error(relative @ b.axes.T, weight, b) for b in boxes]
    # World axes unless turning the box pays: a tie must not tilt an axis-aligned room by rounding.
    return boxes[1] if errors[1] < 0.9 * errors[0] else boxes[0]


def _axes_from_planes(relative: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Orthonormal axes from the two commonest plane directions among random neighbouring triples of points."""
    rng = np.random.default_rng(7)
    direction = relative / np.linalg.norm(relative, axis=-1, keepdims=True)
    pick = rng.choice(len(relative), min(3000, len(relative)), replace=False, p=weight / weight.sum())
    normals = []
    for i in pick:
        near = np.flatnonzero(direction @ direction[i] > 0.99)
        if len(near) < 8:
            continue
        near = near[:: max(1, len(near) // 64)]
        patch = relative[near] - relative[near].mean(0)
        values, vectors = np.linalg.eigh(patch.T @ patch)
        if values[0] < 1e-4 * values[1]:  # flat: thickness under 1 % of its narrower width
            normals.append(vectors[:, 0])
        if len(normals) >= 400:
            break
    if len(normals) < 8:
        return np.eye(3)
    normals = np.array(normals)
    first = _mode(normals)
    across = normals[np.abs(normals @ first) < 0.2]
    second = _mode(across) if len(across) else np.eye(3)[np.argmin(np.abs(first))]
    second = second - first * (second @ first)
    second /= np.linalg.norm(second)
    axes = np.array([first, second, np.cross(first, second)])
    return _nearest_to_world(axes)


def _mode(normals: np.ndarray) -> np.ndarray:
    """The direction (sign ignored) with most others within 5 degrees, averaged over them."""
    close = np.abs(normals @ normals.T) > np.cos(np.radians(5))
    best = np.argmax(close.sum(1))
    chosen = normals[close[best]]
    chosen = chosen * np.sign(chosen @ normals[best])[:, None]
    mean = chosen.mean(0)
    return mean / np.linalg.norm(mean)


def _nearest_to_world(axes: np.ndarray) -> np.ndarray:
    """The same box's axes, ordered and signed to lie nearest to x, y, z, right-handed."""
    left, out = [0, 1, 2], np.empty((3, 3))
    for world in (2, 0, 1):
        i = max(left, key=lambda j: abs(axes[j][world]))
        left.remove(i)
        out[world] = axes[i] * (1.0 if axes[i][world] >= 0 else -1.0)
    if np.linalg.det(out) < 0:
        out[1] = -out[1]
    return out


def _fit_sides(p: np.ndarray, weight: np.ndarray, axes: np.ndarray) -> Box:
    reach = np.abs(p).max(0).clip(1e-9)
    low, high = -reach, reach.copy()
    for _ in range(ROUNDS):
        side = _side_of(p, low, high)
        new_low, new_high = low.copy(), high.copy()
        for axis in range(3):
            for sign, target in ((-1, new_low), (1, new_high)):
                mine = side == axis * 2 + (sign < 0)
                if weight[mine].sum() > 0:
                    value = _weighted_median(p[mine, axis], weight[mine])
                    target[axis] = value if value * sign > 0 else sign * 1e-6 * reach[axis]
        if np.allclose(new_low, low, rtol=1e-6) and np.allclose(new_high, high, rtol=1e-6):
            break
        low, high = new_low, new_high
    return Box(axes, *_open_to_the_sky(p, weight, low, high))


def _side_of(p: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """(M,) int: cube-face index of the wall that the ray from the centre through each point leaves by."""
    with np.errstate(divide="ignore", invalid="ignore"):
        t = np.where(p > 0, high / p, np.where(p < 0, low / p, np.inf))
    axis = np.argmin(t, axis=-1)
    return axis * 2 + (np.take_along_axis(p, axis[:, None], -1)[:, 0] < 0)


def _open_to_the_sky(p, weight, low, high):
    """Sides that hardly any surface was seen on move to FAR, so that the sky has no parallax."""
    side = _side_of(p, low, high)
    low, high = low.copy(), high.copy()
    # A wall's solid angle from the centre, by 20,000 even directions.
    directions = _even_directions(20000)
    whole = np.bincount(_side_of(directions, low, high), minlength=6) * (4 * np.pi / len(directions))
    seen = np.bincount(side, weights=weight, minlength=6)
    for face in range(6):
        if seen[face] < OPEN_SIDE * whole[face] or seen[face] == 0:
            (low if face % 2 else high)[face // 2] = -spaces.FAR if face % 2 else spaces.FAR
    return low, high


def _even_directions(n: int) -> np.ndarray:
    """(n, 3) unit directions on a Fibonacci spiral."""
    i = np.arange(n) + 0.5
    z, angle = 1 - 2 * i / n, i * np.pi * (3 - np.sqrt(5))
    r = np.sqrt(1 - z * z)
    return np.stack([r * np.cos(angle), r * np.sin(angle), z], -1)


def _weighted_median(values: np.ndarray, weight: np.ndarray) -> float:
    order = np.argsort(values)
    cumulative = np.cumsum(weight[order])
    return float(values[order][np.searchsorted(cumulative, cumulative[-1] / 2)])


def _error(p: np.ndarray, weight: np.ndarray, box: Box) -> float:
    """Mean relative distance error of the box as seen from the centre, each point's error capped at 1."""
    with np.errstate(divide="ignore", invalid="ignore"):
        t = np.where(p > 0, box.high / p, np.where(p < 0, box.low / p, np.inf)).min(-1)
    return float(np.average(np.minimum(np.abs(t - 1), 1), weights=weight))
