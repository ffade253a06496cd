"""A point that sees a whole region of a reflector, every spot once and none at a grazing angle.

A region is star-shaped about c where its normals all look away from c (or all at it: reverse). The sphere that fits its
normals best, least squares in (c, r) of n.(p - c) = r, gives such a point at once for spheres, tubes, caps and tori; for
planes and shallow caps it is undetermined or far away, where the region would be a speck of the map: points half a size
behind or before it are tried as well, and the best is moved on by subgradient steps. Best is where most area is seen well:
q = n.(p - c) / sqrt(|p - c|^2 + (size / 4)^2), which also falls when c comes close to the surface, less
what distance costs.
Limits. Whether two spots lie in one direction is not asked here: part_surface.triangles_met tells.
"""

import numpy as np

# Seen at less than this q a spot is not seen: 84 degrees from its normal.
GRAZING = 0.1
# Enough q: more is no gain.
ENOUGH = 0.4
# What seeing a region from farther than half its diagonal costs, for each such length: it fills less of the map.
FAR = 0.2
# Steps towards more, and so many triangles are looked at while searching.
STEPS, SAMPLES = 16, 800


def seen(center: np.ndarray, reverse: bool, points: np.ndarray, normal: np.ndarray, size: float) -> np.ndarray:
    """(T,) q of points with these normals (T, 3), from center (3,); size: half the region's diagonal."""
    away = points - center
    q = np.einsum("ij,ij->i", away, normal) / np.sqrt(np.einsum("ij,ij->i", away, away) + size * size / 16)
    return -q if reverse else q


def best_center(corners: np.ndarray, normal: np.ndarray, area: np.ndarray) -> tuple[np.ndarray, bool]:
    """((3,) center, reverse) for triangles by their corners (T, 3, 3), normals on the mirroring side (T, 3) and area (T,)."""
    step = -(-len(area) // SAMPLES)
    order = np.argsort(-area, kind="stable")[::step]
    p, n = corners[order].reshape(-1, 3), np.repeat(normal[order], 3, 0)
    w = np.repeat(area[order], 3) / (3 * area[order].sum())
    size = float(np.linalg.norm(np.ptp(p, axis=0))) / 2
    mean = w @ p
    look = w @ n
    long = np.linalg.norm(look)
    tries = [mean] if long < 1e-6 else [mean + side * size * look / long for side in (-0.5, -1.0, 0.5, 1.0)]
    fit = _sphere(p, n, w, mean, size) - mean
    far = max(np.linalg.norm(fit) / size, 1e-9)
    tries += [mean, mean + fit * min(1.0, 1.0 / far), mean + fit * min(1.0, 0.5 / far)]
    rated = [(_rate(c, side, p, n, w, size), -i, c, side) for i, c in enumerate(tries) for side in (False, True)]
    rated.sort(key=lambda r: r[:2], reverse=True)
    best = max((_improved(c, side, p, n, w, size) for _, _, c, side in rated[:3]), key=lambda r: r[0])
    return best[1], best[2]


def _sphere(p, n, w, mean, size) -> np.ndarray:
    """(3,) centre of the sphere that fits the normals best; near the mean where they leave it open."""
    row = np.column_stack([n, np.full(len(n), 1.0)])
    matrix = (row * w[:, None]).T @ row + np.diag([1e-4, 1e-4, 1e-4, 1e-6])
    return mean + np.linalg.solve(matrix, (row * w[:, None]).T @ (n * (p - mean)).sum(-1))[:3]


def _rate(center, reverse, p, n, w, size) -> float:
    q = seen(center, reverse, p, n, size)
    far = w @ np.linalg.norm(p - center, axis=-1) / size
    return float(w @ (q > GRAZING) + 0.5 * (w @ q.clip(GRAZING, ENOUGH)) - FAR * max(0.0, far - 1.0))


def _improved(center, reverse, p, n, w, size) -> tuple[float, np.ndarray, bool]:
    best = (_rate(center, reverse, p, n, w, size), center, reverse)
    step = 0.3 * size
    for _ in range(STEPS):
        # Against the normals of what is seen badly, unless it is seen from behind by far and lost anyway.
        q = seen(center, reverse, p, n, size)
        poor = w * ((q < ENOUGH / 2) & (q > -0.5))
        move = -(poor @ n) * (-1.0 if reverse else 1.0)
        length = np.linalg.norm(move)
        if length < 1e-9:
            break
        center = center + step * move / length
        rate = _rate(center, reverse, p, n, w, size)
        if rate > best[0]:
            best = (rate, center, reverse)
        else:
            center, step = best[1], step * 0.7
    return best
