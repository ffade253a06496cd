"""Convex outlines of planar mirrors: hulls, and what is seen of one through another.

A mirror is seen within a convex polygon of its picture, and through it other mirrors are: the part of their outlines that its view's
near plane (the mirror itself) and that polygon leave [Sutherland and Hodgman 1974, "Reentrant polygon clipping"]. Clipped before the division
by w, a half-plane of pixels being a half-space of (x w, y w, w), so outlines that pass the eye need no care of their own.
Plain floats in lists: polygons have few corners, and NumPy's calls would take ten times as long.
"""

import numpy as np

# An outline has no more corners: one around it is taken that has so many. What is added of a disc is 0.6 % of its area.
MOST_CORNERS = 24
# Corners are before the eye, and beyond the near plane, when w and z + w are above this share of the outline's largest w: the other side
# of the pane that a view is made by lies in its near plane, give or take rounding.
BEFORE = 1e-9

Polygon = tuple[tuple[float, float], ...]  # px, counter-clockwise


def hull(points: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """(K, 3): convex hull of points (N, 3) of a plane, counter-clockwise as seen against normal (3,); K is at most MOST_CORNERS."""
    axis = np.eye(3)[np.argmin(np.abs(normal))]
    across = np.cross(axis, normal)
    across /= np.linalg.norm(across)
    along = np.cross(normal, across)
    middle = points.mean(0)
    flat = _hull((points - middle) @ np.stack([across, along], -1))
    if len(flat) > MOST_CORNERS:
        flat = _around(flat)
    return middle + flat @ np.stack([across, along])


def _hull(flat: np.ndarray) -> np.ndarray:
    """(K, 2) counter-clockwise of (N, 2) [Andrew 1979, monotone chain]."""
    points = np.unique(flat, axis=0).tolist()
    ends = []
    for ordered in (points, points[::-1]):
        chain: list = []
        for p in ordered:
            while len(chain) > 1 and _turn(chain[-2], chain[-1], p) <= 0:
                chain.pop()
            chain.append(p)
        ends += chain[:-1]
    return np.array(ends or points)


def _turn(a, b, c) -> float:
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def _around(flat: np.ndarray) -> np.ndarray:
    """(MOST_CORNERS, 2): where the lines that touch the hull in so many even directions meet their neighbours."""
    angle = 2 * np.pi * np.arange(MOST_CORNERS) / MOST_CORNERS
    out = np.stack([np.cos(angle), np.sin(angle)], -1)
    reach = (flat @ out.T).max(0)
    pairs = np.stack([out, np.roll(out, -1, 0)], 1)
    return np.linalg.solve(pairs, np.stack([reach, np.roll(reach, -1)], -1)[..., None])[..., 0]


def seen_through(clip: np.ndarray, width: int, height: int, polygon: Polygon) -> Polygon:
    """What is seen of an outline, clip (K, 4) its corners in clip coordinates, within a convex polygon of a picture of width x height px
    and beyond the near plane; () for nothing."""
    least = BEFORE * float(np.abs(clip[:, 3]).max())
    corners = [((x + w) * 0.5 * width, (y + w) * 0.5 * height, w, z) for x, y, z, w in clip.tolist()]
    corners = _cut(corners, (0.0, 0.0, 1.0, 1.0), least)
    corners = _cut(corners, (0.0, 0.0, 1.0, 0.0), least)
    for (ax, ay), (bx, by) in zip(polygon, (*polygon[1:], *polygon[:1]), strict=True):
        if len(corners) < 3:
            return ()
        # Left of the edge: (b - a) x (p - a) >= 0.
        corners = _cut(corners, (ay - by, bx - ax, ax * (by - ay) - ay * (bx - ax), 0.0), 0.0)
    if len(corners) < 3:
        return ()
    flat = tuple((x / w, y / w) for x, y, w, _ in corners)
    return flat if area(flat) >= 0 else flat[::-1]


def _cut(corners: list, plane: tuple[float, float, float, float], least: float) -> list:
    """The part of a convex polygon where plane . corner >= least."""
    if not corners:
        return corners
    a, b, c, d = plane
    heights = [a * p[0] + b * p[1] + c * p[2] + d * p[3] - least for p in corners]
    if min(heights) >= 0:
        return corners
    kept = []
    for i, p in enumerate(corners):
        h, before = heights[i], heights[i - 1]
        if (h >= 0) != (before >= 0):
            q, t = corners[i - 1], before / (before - h)
            kept.append(tuple(u + t * (v - u) for u, v in zip(q, p, strict=True)))
        if h >= 0:
            kept.append(p)
    return kept


def area(polygon: Polygon) -> float:
    """px^2, > 0 counter-clockwise."""
    if len(polygon) < 3:
        return 0.0
    x0, y0 = polygon[0]
    moved = [(x - x0, y - y0) for x, y in polygon]
    return 0.5 * sum(a[0] * b[1] - a[1] * b[0] for a, b in zip(moved, (*moved[1:], moved[0]), strict=True))


def window_of(polygon: Polygon, width: int, height: int) -> tuple[int, int, int, int]:
    """(x, y, width, height): the pixels of a picture of width x height that a polygon within it touches, at least one."""
    xs, ys = [p[0] for p in polygon], [p[1] for p in polygon]
    left, below = (max(min(int(np.floor(min(v) + 1e-6)), size - 1), 0) for v, size in ((xs, width), (ys, height)))
    right, above = (max(min(int(np.ceil(max(v) - 1e-6)), size), low + 1) for v, size, low in ((xs, width, left), (ys, height, below)))
    return left, below, right - left, above - below
