"""Searches where the screen needs them: octrees of grids, by pixel tolerance [estalella-2005 section 5 leaves this open].

Problem. A grid of a fixed share of the vertices (virtual_grid.py) costs as much for a reflector ten pixels wide as for a large one.
Idea. Grids in levels, each halving the cells of the one before; places are counted in one unit, so that nodes are the same over all
levels and are searched once. From the coarsest level on, a cell's middle is searched too and compared with the mean of the corners:
what trilinear interpolation would say. Only where the two differ by more than the tolerance, in pixels, is the cell taken apart.
A vertex is interpolated in the last cell that it is in; a cell of few vertices is not taken apart, but they are searched.
Sides that are short are halved later than long ones, so that cells stay near to cubes.
A cell across the reflector's silhouette, or with nodes that were not found (virtual_grid.py), is taken apart until its reflected side is
no wider on the screen than the tolerance; corners that were not found then are what the others are. Vertices of the last such cells
are searched. Cells that are hidden altogether show nothing and count as good; those where nothing was found at all are given up: this
part of the reflector shows nothing of them. All this only from the level SURE on, before which nodes are too few to say so.
Limits. One sample a cell: what bends both ways between corners and middle goes unseen, but in the
first levels' cells. Across the face between cells of different
levels interpolation jumps, by less than the tolerance; the mesh stays whole, as each vertex has one value.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .virtual_grid import BITS, CORNERS, across_silhouette, boxes, pack, trilinear, unpack
from .virtual_status import CONVERGED, FAILED, HIDDEN

# Halvings of a box's longest side in its first level; cells of as few vertices are not taken apart.
FIRST, FEW = 1, 8
# Places along a side of a box: the finest cells are two wide, since they have a middle.
UNITS = 1 << (BITS - 1)
# From this level on what nodes say is taken for the whole cell: that nothing of it is found, or how much of the screen it takes.
SURE = 2
# What may lie between a cell's middle and its corners, over what is seen at its middle, where bends across its axes may cancel.
UNSEEN = 2.0
# Before that level, cells wider on the screen than so many tolerances are taken apart whatever their middles say.
WIDE = 8.0

# search(points (n, 3) object space, instance (n,)) -> (virtual (n, 4), status (n,)); project(virtual (n, 4)) -> (n, 2) px
Search = Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]
Project = Callable[[np.ndarray], np.ndarray]


@dataclass(frozen=True)
class Level:
    """C cells, of which cells of the next level are parts."""

    nodes: np.ndarray  # (C, 9) int32: corners as in Grid, then the middle
    parent: np.ndarray  # (C,) int32 into the level before
    leaf: np.ndarray  # (C,) bool: has no parts
    vertex: np.ndarray  # (M,) int32: the vertices in its cells ...
    cell: np.ndarray  # (M,) int32 ... in which each is ...
    where: np.ndarray  # (M, 3) float32 ... and where there, 0 to 1


@dataclass(frozen=True)
class Octree:
    """V vertices, N nodes. Object space of each instance, m."""

    position: np.ndarray  # (V, 3) float32
    instance: np.ndarray  # (V,) int32
    node_position: np.ndarray  # (N, 3) float32
    node_instance: np.ndarray  # (N,) int32, ascending
    levels: tuple[Level, ...]


def octree(positions: np.ndarray, instance: np.ndarray) -> Octree:
    """All instances' levels, down to cells of few vertices. positions: (V, 3) object space, m; instance: (V,)."""
    box = boxes(positions, instance)
    with np.errstate(divide="ignore"):
        start = np.rint(np.log2(np.maximum(box.shape, 2.0**-64))).astype(np.int64) + FIRST
    found, keys = [], []
    vertex, parent = np.arange(len(box.owner)), np.zeros(len(box.owner), np.int64)
    while len(vertex):
        number = 1 << np.maximum(start + len(found), 0)
        cell, where = (values[vertex] for values in box.cells(number))
        unit = UNITS // number[box.owner[vertex]]
        cells, first, of, count = np.unique(
            pack(box.owner[vertex], cell * unit), return_index=True, return_inverse=True, return_counts=True
        )
        owner, place = unpack(cells)
        unit = unit[first]
        offsets = np.concatenate([2 * CORNERS, [[1, 1, 1]]])
        keys.append(pack(owner[:, None], place[:, None] + unit[:, None] // 2 * offsets))
        leaf = (count <= FEW) | (unit.min(1) < 4) | (box.extent.max(1) == 0)[owner]
        found.append((parent[first].astype(np.int32), leaf, vertex.astype(np.int32), of.astype(np.int32), where.astype(np.float32)))
        on = ~leaf[of]
        vertex, parent = vertex[on], of[on]
    nodes, which = np.unique(np.concatenate([np.zeros(0, np.int64), *(k.ravel() for k in keys)]), return_inverse=True)
    owner, place = unpack(nodes)
    parts = np.split(which.astype(np.int32), np.cumsum([k.size for k in keys])[:-1]) if keys else []
    return Octree(
        np.asarray(positions, np.float32).reshape(-1, 3), np.asarray(instance, np.int32),
        box.positions(owner, place / UNITS), box.names[owner].astype(np.int32),
        tuple(Level(part.reshape(-1, 9), *rest) for part, rest in zip(parts, found, strict=True)),
    )  # fmt: skip


def follow(tree: Octree, search: Search, project: Project, tolerance: float) -> tuple[np.ndarray, np.ndarray, int]:
    """(virtual (V, 4), status (V,), how many searches) of the vertices, to a tolerance in pixels."""
    virtual, status = np.zeros((len(tree.position), 4)), np.full(len(tree.position), FAILED)
    value, state = np.zeros((len(tree.node_position), 4)), np.zeros(len(tree.node_position))
    searched, active = 0, None
    by_itself = [np.zeros(0, np.int32)]
    for number, level in enumerate(tree.levels):
        active = np.ones(len(level.nodes), bool) if active is None else active[level.parent]
        nodes = np.unique(level.nodes[active])
        nodes = nodes[state[nodes] == 0]
        value[nodes], state[nodes] = search(tree.node_position[nodes], tree.node_instance[nodes])
        searched += len(nodes)
        apart = np.zeros(len(level.nodes), bool)
        apart[active] = _errs(value[level.nodes[active]], state[level.nodes[active]], project, tolerance, number >= SURE)
        mine = (active & ~apart)[level.cell]
        cell, vertex = level.nodes[level.cell[mine], :8], level.vertex[mine]
        virtual[vertex] = trilinear(_filled(value[cell], state[cell]), level.where[mine])
        status[vertex] = state[cell].min(1, initial=FAILED)
        by_itself.append(level.vertex[(apart & level.leaf)[level.cell]])
        active = apart & ~level.leaf
    rest = np.concatenate(by_itself)
    virtual[rest], status[rest] = search(tree.position[rest], tree.instance[rest])
    return virtual, status, searched + len(rest)


def _errs(value, state, project: Project, tolerance: float, sure: bool) -> np.ndarray:
    """(C,) bool: which cells are taken apart, of what was found at their corners and middles, (C, 9, 4) and (C, 9)."""
    error = UNSEEN * np.linalg.norm(project(value[:, 8]) - project(value[:, :8].mean(1)), axis=1)
    reflected, failed = state == CONVERGED, state == FAILED
    place = project(value.reshape(-1, 4)).reshape(-1, 9, 2)
    high, low = (np.where(reflected[..., None], place, far) for far in (-np.inf, np.inf))
    with np.errstate(invalid="ignore"):
        shown = np.nan_to_num(np.linalg.norm(high.max(1) - low.min(1), axis=1), posinf=0.0)
    wide = np.where((reflected.sum(1) < 2) | (not sure), np.inf, shown)
    error = np.where(failed.any(1) | across_silhouette(state), wide, error if sure else np.maximum(error, shown / WIDE))
    return ~(error <= tolerance) & ~(state == HIDDEN).all(1) & ~(failed.all(1) & sure)


def _filled(value: np.ndarray, state: np.ndarray) -> np.ndarray:
    """(M, 8, 4) with what failed replaced by the mean of the cell's other corners."""
    found = (state != FAILED)[..., None]
    mean = np.where(found, value, 0).sum(1) / np.maximum(found.sum(1), 1)
    return np.where(found, value, mean[:, None])
