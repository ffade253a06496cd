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
from .weighted import weighted_median

# Rounds of assign-and-move; four settle rooms up to 20:1, the rest is for slabs.
ROUNDS = 12
# A side of which less than this share of its solid angle shows surfaces is open to the sky.
OPEN_SIDE = 0.25
# Points this near to a wall, relative to their distance, belong to it; half a texel at a slant is as much.
ON_WALL = 0.02
# Points from which the walls' directions are told: 25 in every patch of 8 degrees, and a second rather than 15 of them.
ENOUGH = 40000


@dataclass(frozen=True)
class Box:
    axes: np.ndarray  # (3, 3) float64, rows: the box's x, y, z in world space, orthonormal
    low: np.ndarray  # (3,) float64, m, along the axes, from the centre
    high: np.ndarray  # (3,) float64, m
    # Where the walls beside an open side end; what lies past that is the sky. 2 FAR where the side is closed.
    rim_low: np.ndarray  # (3,) float64, m
    rim_high: np.ndarray  # (3,) float64, m

    def has_walls(self) -> bool:
        """Whether it differs from the sky at all."""
        return bool(np.any(self.high < spaces.FAR) or np.any(self.low > -spaces.FAR))

    def is_open(self) -> bool:
        """Whether a ray can leave it into the sky."""
        return bool(np.any(self.high == spaces.FAR) or np.any(self.low == -spaces.FAR))


def fit(points: np.ndarray, weight: np.ndarray, center) -> Box:
    """points (M, 3) world, weight (M,) steradian; an empty set gives a box at FAR (the sky's)."""
    relative = np.asarray(points, np.float64) - np.asarray(center, np.float64)
    has_direction = np.any(relative != 0, axis=-1)
    relative, weight = relative[has_direction], np.asarray(weight)[has_direction]
    if len(relative) < 16:
        return Box(np.eye(3), np.full(3, -spaces.FAR), np.full(3, spaces.FAR), np.zeros(3), np.zeros(3))
    candidates = [np.eye(3), _axes_from_planes(relative, weight)]
    boxes = [_fit_sides(relative @ axes.T, weight, axes) for axes in candidates]
    errors = [error(relative @ b.axes.T, weight, b) for b in boxes]
    # World axes unless turning the box pays: a tie must not tilt an axis-aligned room by rounding.
    return boxes[1] if errors[1] < 0.9 * errors[0] else boxes[0]


def _axes_from_planes(relative: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Orthonormal axes from the two commonest plane directions."""
    if len(relative) > ENOUGH:
        some = np.random.default_rng(5).choice(len(relative), ENOUGH, replace=False)
        relative, weight = relative[some], weight[some]
    normals = _plane_normals(relative, weight)
    if len(normals) < 8:
        return np.eye(3)
    first = _mode(normals)
    # Where floor and ceiling are far wider than they are apart, hardly any patch of a wall is free of them: leave them out.
    height = relative @ first
    low, high = np.percentile(height, (1, 99))
    between = (height > low + 0.05 * (high - low)) & (height < high - 0.05 * (high - low))
    beside = np.concatenate([_plane_normals(relative[between], weight[between]), normals])
    across = beside[np.abs(beside @ first) < 0.2]
    second = _mode(across) if len(across) else np.eye(3)[np.argmin(np.abs(first))]
    second = second - first * (second @ first)
    second /= np.linalg.norm(second)
    axes = np.array([first, second, np.cross(first, second)])
    return _nearest_to_world(axes)


def _plane_normals(relative: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """(K, 3) unit normals of the neighbourhoods of random points that are flat, 400 at most."""
    rng = np.random.default_rng(7)
    direction = relative / np.linalg.norm(relative, axis=-1, keepdims=True)
    picks = []
    if len(relative):
        picks = rng.choice(len(relative), min(3000, len(relative)), replace=False, p=weight / weight.sum())
    normals = []
    for i in picks:
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
    return np.array(normals).reshape(-1, 3)


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
                    value = weighted_median(p[mine, axis], weight[mine])
                    target[axis] = value if value * sign > 0 else sign * 1e-6 * reach[axis]
        if np.allclose(new_low, low, rtol=1e-6) and np.allclose(new_high, high, rtol=1e-6):
            break
        low, high = new_low, new_high
    low, high = _open_to_the_sky(p, weight, low, high)
    return Box(axes, low, high, *_rims(p, low, high))


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
    directions = even_directions(20000)
    whole = np.bincount(_side_of(directions, low, high), minlength=6) * (4 * np.pi / len(directions))
    seen = np.bincount(side, weights=weight, minlength=6)
    for face in range(6):
        if seen[face] < OPEN_SIDE * whole[face] or seen[face] == 0:
            (low if face % 2 else high)[face // 2] = -spaces.FAR if face % 2 else spaces.FAR
    return low, high


def _rims(p: np.ndarray, low: np.ndarray, high: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(low, high) ends of the closed walls along the axes of open sides; points off the walls do not count."""
    walls = p[np.abs(_exit(p, low, high) - 1) < ON_WALL]
    rim_low, rim_high = np.full(3, -2 * spaces.FAR), np.full(3, 2 * spaces.FAR)
    for axis in range(3):
        if low[axis] == -spaces.FAR:
            rim_low[axis] = walls[:, axis].min(initial=0.0)
        if high[axis] == spaces.FAR:
            rim_high[axis] = walls[:, axis].max(initial=0.0)
    return rim_low, rim_high


def _exit(p: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """(M,) where the rays from the centre through the points leave the box, in units of the points' distances."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(p > 0, high / p, np.where(p < 0, low / p, np.inf)).min(-1)


def even_directions(n: int) -> np.ndarray:
    """(n, 3) unit directions on a Fibonacci spiral."""
    i = np.arange(n) + 0.5
    z, angle = 1 - 2 * i / n, i * np.pi * (3 - np.sqrt(5))
    r = np.sqrt(1 - z * z)
    return np.stack([r * np.cos(angle), r * np.sin(angle), z], -1)


def error(p: np.ndarray, weight: np.ndarray, box: Box) -> float:
    """Mean relative distance error of the box as seen from the centre, each point's error capped at 1."""
    off = np.abs(_exit(p, box.low, box.high) - 1)
    return float(np.average(np.minimum(off, 1), weights=weight))
