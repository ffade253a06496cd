"""Grids in levels around the meshes that are reflected, as tables for passes [estalella-2005 section 5 leaves levels open].

Problem. A grid of a fixed share of the vertices (virtual_grid.py) costs as much for a reflector ten pixels wide as for a large one. Where
it has to be fine is known when the picture is drawn, and then no table can be built.
Idea. All levels are built before, each with half the cells' width of the one before, down to cells of few vertices; what is drawn decides
how many of them are searched (virtual_follow.py). Places are counted in one unit, so that a node is the same in all levels. A cell has a
middle as well, which says how far trilinear interpolation is off; it is a corner of the cell's parts.
Sides that are short are halved later than long ones, so that cells stay near to cubes; along an axis in which a mesh has no extent both
ends of a cell are one node.
Nodes and cells are sorted by level, middles before corners: each pass over a level is one range. Only look-ups are needed in a pass, no
scattered writes: a new corner lies on an edge or a face of cells of the level before, or inside one, and so in four of them at most; it
is worth a search where one of these is taken apart.
Limits. As many nodes as half the vertices, about. Which cells hold vertices changes with the mesh's shape: tables are made again then.
"""

from dataclasses import dataclass

import numpy as np

from .virtual_grid import BITS, CORNERS, Boxes, boxes, pack, unpack

# Halvings of a box's longest side in its first level; cells of as few vertices are not taken apart. With 8 there are twice the nodes, for
# as many searches within a tenth (teapot, bunny).
FIRST, FEW = 0, 16
# Places along a side of a box: the finest cells are two wide, since they have a middle.
UNITS = 1 << (BITS - 1)
# Cells of the level before in which a new corner lies, at most.
AROUND = 4


@dataclass(frozen=True)
class Octree:
    """V vertices, N nodes, C cells, L levels; -1 is none. Object space of each instance, m."""

    position: np.ndarray  # (V, 3) float32
    instance: np.ndarray  # (V,) int32
    node_position: np.ndarray  # (N, 3) float32
    node_instance: np.ndarray  # (N,) int32
    node_around: np.ndarray  # (N, AROUND) int32: of a corner, the cells of the level before in which it lies; none in the first level ...
    node_where: np.ndarray  # (N, 3) float32 ... and where in the first of them, 0 to 1
    cell_nodes: np.ndarray  # (C, 9) int32: corners as in Grid, then the middle
    cell_parent: np.ndarray  # (C,) int32, of the level before
    vertex_cell: np.ndarray  # (V,) int32: the last one that it is in ...
    vertex_where: np.ndarray  # (V, 3) float32 ... and where there, 0 to 1
    # (L, 3) int: of the nodes that a level adds, the first middle (as many as cells, in their order), the first corner, and their end
    node_ranges: np.ndarray
    cell_ranges: np.ndarray  # (L, 2) int: a level's first cell, and their end


@dataclass(frozen=True)
class _Cells:
    """C cells, level by level."""

    owner: np.ndarray  # (C,) box
    place: np.ndarray  # (C, 3) of the lower corner, in units
    width: np.ndarray  # (C, 3) units
    parent: np.ndarray  # (C,), -1 in the first level


def octree(positions: np.ndarray, instance: np.ndarray) -> Octree:
    """All instances' levels. positions: (V, 3) object space, m; instance: (V,)."""
    box = boxes(positions, instance)
    cells, ends, vertex_cell, vertex_where = _cells(box)
    count = np.diff(ends, prepend=0)
    level = np.repeat(np.arange(len(count)), count)
    unique, which = np.unique(_nodes(box, cells), return_inverse=True)
    order, first, middle = _order(which.reshape(-1, 9), level, len(unique))
    number = np.empty(len(order), int)
    number[order] = np.arange(len(order))
    nodes = number[which.reshape(-1, 9)]
    owner, place = unpack(unique[order])
    first, middle = first[order], middle[order]
    around, where = _around(cells, nodes, place, level, np.where(middle, -1, first))
    start = np.searchsorted(first, np.arange(len(count) + 1))
    return Octree(
        np.asarray(positions, np.float32).reshape(-1, 3), np.asarray(instance, np.int32),
        box.positions(owner, place / UNITS), box.names[owner].astype(np.int32), around, where,
        nodes.astype(np.int32), cells.parent.astype(np.int32), vertex_cell, vertex_where,
        np.stack([start[:-1], start[:-1] + count, start[1:]], -1), np.stack([ends - count, ends], -1),
    )  # fmt: skip


def _cells(box: Boxes) -> tuple[_Cells, np.ndarray, np.ndarray, np.ndarray]:
    """(cells, (L,) where each level ends, (V,) int32 last cell of each vertex, (V, 3) float32 where in it). One level at least."""
    with np.errstate(divide="ignore"):
        start = np.rint(np.log2(np.maximum(box.shape, 2.0**-64))).astype(np.int64) + FIRST
    levels, ends = [], []
    last, last_where = np.zeros(len(box.owner), np.int32), np.zeros((len(box.owner), 3), np.float32)
    vertex, parent, before = np.arange(len(box.owner)), np.full(len(box.owner), -1), 0
    while len(vertex) or not levels:
        number = 1 << np.maximum(start + len(levels), 0)
        cell, where = (values[vertex] for values in box.cells(number))
        width = UNITS // number
        keys, index, of, count = np.unique(
            pack(box.owner[vertex], cell * width[box.owner[vertex]]), return_index=True, return_inverse=True, return_counts=True
        )
        owner, place = unpack(keys)
        levels.append((owner, place, width[owner], parent[index]))
        ends.append(before + len(keys))
        last[vertex], last_where[vertex] = before + of, where
        leaf = (count <= FEW) | (width[owner].min(1, initial=UNITS) < 4) | (box.extent.max(1) == 0)[owner]
        on = ~leaf[of]
        vertex, parent, before = vertex[on], before + of[on], ends[-1]
    return _Cells(*map(np.concatenate, zip(*levels, strict=True))), np.array(ends), last, last_where


def _nodes(box: Boxes, cells: _Cells) -> np.ndarray:
    """(C, 9) packed: corners and middles."""
    offsets = np.concatenate([2 * CORNERS, [[1, 1, 1]]]) * box.thick[cells.owner][:, None]
    return pack(cells.owner[:, None], cells.place[:, None] + cells.width[:, None] // 2 * offsets)


def _order(nodes: np.ndarray, level: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """((N,) the nodes by level, middles first and as their cells are, (N,) the level that adds a node, (N,) bool: as a middle)."""
    cells = np.arange(len(nodes))[::-1]
    first, cell_of = np.zeros(count, int), np.full(count, -1)
    first[nodes[cells].ravel()] = np.repeat(level[cells], 9)  # the last that is written is the first level
    cell_of[nodes[cells, 8]] = cells
    return np.lexsort((np.where(cell_of >= 0, cell_of, np.arange(count)), cell_of < 0, first)), first, cell_of >= 0


def _around(cells: _Cells, nodes, place, level, corner_of) -> tuple[np.ndarray, np.ndarray]:
    """(node_around, node_where); corner_of: (N,) the level that adds a node as a corner, -1 for middles; level: (C,)."""
    around, where = np.full((len(place), AROUND), -1, np.int32), np.full((len(place), 3), 0.5, np.float32)
    new = (corner_of[nodes] == level[:, None]) & (level > 0)[:, None]
    node, parent = np.divmod(
        np.unique((nodes * len(cells.owner) + np.maximum(cells.parent, 0)[:, None])[new]), max(len(cells.owner), 1)
    )
    nth = np.arange(len(node)) - np.searchsorted(node, node)
    around[node, nth] = parent
    node, parent = node[nth == 0], parent[nth == 0]
    where[node] = (place[node] - cells.place[parent]) / cells.width[parent]
    return around, where
