"""The surface of a reflector's part as seen from its centre: distance and normal along any direction.

What reflector maps are filled from [estalella-2005 section 4.1]. The paper draws the triangles into the faces of a cube;
here each direction meets the triangle itself, so that points lie on its plane and normals are its corners' weighted as a
ray tracer weighs them. All rays start at one point, so a triangle is a cone: a direction d lies in it when its products
with the cones' three sides (b x c, c x a, a x b) have one sign, and these are the barycentric weights. A shared edge gives
both triangles the same product, negated: no ray slips through. Cones are sorted into a quadtree over the faces of a cube;
a cell and a triangle, both convex there, are apart when a side of either parts them.

Where several triangles lie along a ray, the nearest counts in a part that mirrors towards its centre, else the farthest:
what is seen from there. Limits: a triangle in whose plane the centre lies is met by nothing.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

# A cell is split while it meets more triangles than this (when few rays are asked for: than this), and this often at most ...
FEW, NOT_SO_FEW, DEEPEST = 8, 20, 11
# ... and while a level holds no more pairs than this a triangle: stacks of sheets would fill every cell at every level.
PAIRS = 8
# Triangles about a direction, on average, that are a heap and no surface.
HEAP = 100
# A triangle is met up to this barycentric weight beyond its edges: vertices at one place may differ by rounding.
EDGE = 1e-9
# Cells are this much wider than they are, in half faces: what lies on an edge of two is in both.
SLACK = 1e-8


@dataclass(frozen=True)
class _Tree:
    """Cells 0 to 5 are the faces +x, -x, +y, -y, +z, -z."""

    children: np.ndarray  # (C,) the first of four, -1 in a leaf
    first: np.ndarray  # (C,) into `members`
    count: np.ndarray  # (C,)
    members: np.ndarray  # (M,) triangles


def surface_of_part(
    center: np.ndarray, reverse: bool, corners: np.ndarray, normals: np.ndarray
) -> Callable[[np.ndarray], tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """surface(directions (N, 3)) -> ((N,) distance m, (N, 3) unit shading normal on the mirroring side, (N,) bool inside).

    center (3,), corners (T, 3, 3) world, m; normals (T, 3, 3) of the corners, either way. Where nothing is met distance
    and normal are 0. Directions need not be unit vectors; distances are along unit ones."""
    p = np.asarray(corners, np.float64).reshape(-1, 3, 3) - np.asarray(center, np.float64)
    scale = np.abs(p).max(initial=0.0) or 1.0
    p = p / scale
    sides, volume = _cones(p)
    toward = sides.sum(1) * (-1.0 if reverse else 1.0)  # the planes' normals, on the mirroring side
    n = np.asarray(normals, np.float64).reshape(-1, 3, 3)
    n = n * np.where((n.sum(1) * toward).sum(-1) < 0, -1.0, 1.0)[:, None, None]
    tree = _tree(p, sides, volume, FEW)

    def surface(directions: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        d = np.asarray(directions, np.float64).reshape(-1, 3)
        d = d / np.maximum(np.linalg.norm(d, axis=-1, keepdims=True), 1e-300)
        met, distance = _first(tree, sides, volume, d, nearest=reverse)
        inside = met >= 0
        weight = np.einsum("nkx,nx->nk", sides[met[inside]], d[inside]).clip(0)
        normal = np.zeros_like(d)
        mixed = np.einsum("nk,nkx->nx", weight, n[met[inside]])
        plane = toward[met[inside]]
        lost = np.linalg.norm(mixed, axis=-1) < 1e-6 * weight.sum(-1)
        mixed[lost] = plane[lost]
        normal[inside] = mixed / np.maximum(np.linalg.norm(mixed, axis=-1, keepdims=True), 1e-300)
        return np.where(inside, distance * scale, 0.0), normal, inside

    return surface


def triangles_met(center: np.ndarray, reverse: bool, corners: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """(N,) int: which of the triangles (T, 3, 3) surface_of_part takes along each direction (N, 3), -1 for none, and for all
    when HEAP or more lie about a direction on average: that is no surface, and looking would take minutes."""
    p = corners - center
    p = p / (np.abs(p).max(initial=0.0) or 1.0)
    sides, volume = _cones(p)
    tree = _tree(p, sides, volume, NOT_SO_FEW)
    if tree.count[_cells(tree, directions)].sum() > HEAP * len(directions):
        return np.full(len(directions), -1)
    return _first(tree, sides, volume, directions, nearest=reverse)[0]


def _cones(p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """((T, 3, 3) inward normals of the cones' sides, opposite to each corner, (T,) six times their volume)."""
    sides = np.stack([np.cross(p[:, 1], p[:, 2]), np.cross(p[:, 2], p[:, 0]), np.cross(p[:, 0], p[:, 1])], 1)
    volume = np.einsum("ij,ij->i", p[:, 0], sides[:, 0])
    return sides * np.where(volume < 0, -1.0, 1.0)[:, None, None], np.abs(volume)


def _first(tree: _Tree, sides, volume, d, nearest: bool) -> tuple[np.ndarray, np.ndarray]:
    """((N,) triangle or -1, (N,) distance)."""
    cell = _cells(tree, d)
    order = np.argsort(-tree.count[cell], kind="stable")
    count, first, d = tree.count[cell][order], tree.first[cell][order], d[order]
    met, distance = np.full(len(d), -1), np.full(len(d), np.inf if nearest else -np.inf)
    for k in range(int(count[0]) if len(count) else 0):
        rays = np.searchsorted(-count, -k, side="left")  # those whose cell has more than k
        triangle = tree.members[first[:rays] + k]
        weight = np.einsum("nkx,nx->nk", sides[triangle], d[:rays])
        a, b, c = weight.T
        total = a + b + c
        at = volume[triangle] / np.where(total > 0, total, np.inf)
        better = (np.minimum(np.minimum(a, b), c) >= -EDGE * total) & (total > 0) & ((at < distance[:rays]) if nearest else (at > distance[:rays]))
        met[:rays][better], distance[:rays][better] = triangle[better], at[better]
    back = np.empty_like(order)
    back[order] = np.arange(len(order))
    return met[back], distance[back]


def _cells(tree: _Tree, d: np.ndarray) -> np.ndarray:
    """(N,) the leaf that each direction lies in."""
    axis = np.abs(d).argmax(-1)
    major = np.take_along_axis(d, axis[:, None], 1)[:, 0]
    cell = 2 * axis + (major < 0)
    across = np.stack([np.take_along_axis(d, ((axis + k) % 3)[:, None], 1)[:, 0] for k in (1, 2)], -1)
    at = (across / np.maximum(np.abs(major), 1e-300)[:, None] + 1) / 2  # 0..1
    for _ in range(DEEPEST):
        inner = tree.children[cell] >= 0
        at = at * 2
        bit = at >= 1
        at = at - bit
        cell = np.where(inner, tree.children[cell] + bit[:, 0] + 2 * bit[:, 1], cell)
        if not inner.any():
            break
    return cell


def _tree(p: np.ndarray, sides: np.ndarray, volume: np.ndarray, most_in_cell: int) -> _Tree:
    """Level by level: pairs of cell and triangle, of which those stay that meet."""
    rows, triangles = _on_faces(p, sides, np.flatnonzero(volume > 1e-15))
    most = PAIRS * len(rows) + 1000
    middle, half = np.zeros((6, 2)), 1.0
    row = np.arange(len(rows))
    cell = rows[:, 16].astype(int)
    children, spans, members = [], [], []
    done = start = 0  # members and cells of the levels above
    for depth in range(DEEPEST + 1):
        stay = _meet(rows[row], middle[cell], half)
        cell, row = cell[stay], row[stay]
        count = np.bincount(cell, minlength=len(middle))
        split = (count > most_in_cell) & (depth < DEEPEST) & (len(cell) <= most)
        below = start + len(middle)
        number = np.cumsum(split) - 1
        children.append(np.where(split, below + 4 * number, -1))
        leaf = ~split[cell]
        order = np.argsort(cell[leaf], kind="stable")
        members.append(triangles[row[leaf]][order])
        held = np.where(split, 0, count)
        spans.append(np.stack([done + np.cumsum(held) - held, held], -1))
        done += len(members[-1])
        if not split.any():
            break
        half /= 2
        step = np.array([[-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0], [1.0, 1.0]]) * half
        middle = (middle[split][:, None] + step).reshape(-1, 2)
        cell = (4 * number[cell[~leaf]][:, None] + np.arange(4)).reshape(-1)
        row, start = np.repeat(row[~leaf], 4), below
    span = np.concatenate(spans)
    return _Tree(np.concatenate(children), span[:, 0], span[:, 1], np.concatenate(members))


def _on_faces(p: np.ndarray, sides: np.ndarray, usable: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """((M, 17), (M,) triangle), of each face and each triangle that has corners before it, on the plane one before the eye:
    columns 0-3 the triangle's low and high s and t; 4-15 for each cone's side its product with (1, s, t) and what half a
    cell's width times adds to that; 16 the face."""
    rows, triangles = [], []
    for face in range(6):
        axis, sign = face // 2, 1.0 - 2.0 * (face % 2)
        order = [axis, (axis + 1) % 3, (axis + 2) % 3]
        depth = p[usable, :, axis] * sign
        mine = usable[np.maximum(np.maximum(depth[:, 0], depth[:, 1]), depth[:, 2]) > 0]
        major, s, t = np.moveaxis(p[mine][:, :, order], 2, 0)
        major = major * sign
        whole = np.minimum(np.minimum(major[:, 0], major[:, 1]), major[:, 2]) > 1e-6  # else it has no bounds: it reaches behind
        row = np.empty((len(mine), 17))
        for k, across in enumerate((s, t)):
            a, b, c = (across / np.where(whole[:, None], major, 1.0)).T
            row[:, 2 * k] = np.where(whole, np.minimum(np.minimum(a, b), c), -2.0)
            row[:, 2 * k + 1] = np.where(whole, np.maximum(np.maximum(a, b), c), 2.0)
        for k in range(3):
            one, s, t = sides[mine, k][:, order].T
            one = one * sign
            # Rounding may not part what touches.
            row[:, 4 + 4 * k] = one + SLACK * (np.abs(one) + np.abs(s) + np.abs(t))
            row[:, 5 + 4 * k], row[:, 6 + 4 * k], row[:, 7 + 4 * k] = s, t, np.abs(s) + np.abs(t)
        row[:, 16] = face
        near = (row[:, 0] <= 1 + SLACK) & (row[:, 1] >= -1 - SLACK) & (row[:, 2] <= 1 + SLACK) & (row[:, 3] >= -1 - SLACK)
        rows.append(row[near])
        triangles.append(mine[near])
    return np.concatenate(rows), np.concatenate(triangles)


def _meet(rows: np.ndarray, middle: np.ndarray, half: float) -> np.ndarray:
    """(M,) bool: whether cells about these middles (M, 2) have a direction in common with triangles; none is missed."""
    s, t = middle.T
    wide = half + SLACK
    stay = (rows[:, 0] <= s + wide) & (rows[:, 1] >= s - wide) & (rows[:, 2] <= t + wide) & (rows[:, 3] >= t - wide)
    for k in (4, 8, 12):
        stay &= rows[:, k] + rows[:, k + 1] * s + rows[:, k + 2] * t + rows[:, k + 3] * half >= 0
    return stay
