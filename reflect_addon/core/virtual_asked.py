"""Which ranges of a grid's nodes and cells are asked for, by the chunks that a part of a reflector may show (virtual_cull.py).

Problem. A part of a reflector shows some chunks of the scene; nodes around the others need no search. But nodes belong to cells, and
these to as many chunks as have vertices there.
Idea. Nodes and cells stand in blocks of BLOCK, each with the chunks whose vertices lie in one of its cells or, where grids have levels,
in a part of one. A block is asked for where one of them is shown. Blocks that follow each other, but for GAP, are one range.
Limits. Nodes are sorted along axes, not by nearness: a block of a mesh with few nodes asks for all of it.
"""

import numpy as np

BLOCK = 64
# Blocks that are gone through though nobody asks, for one range fewer: what a dispatch costs, about.
GAP = 4


class Asked:
    """Of C cells around V vertices, and their N nodes."""

    def __init__(self, cell_nodes: np.ndarray, cell_parent: np.ndarray, vertex_cell: np.ndarray, chunks: np.ndarray):
        """cell_nodes: (C, K); cell_parent: (C,), -1 for none, before its parts; vertex_cell: (V,); chunks: VirtualMesh.chunks."""
        count = max(len(chunks), 1)
        chunk = np.repeat(np.arange(len(chunks)), chunks[:, 1])
        found = [np.unique(vertex_cell.astype(np.int64) * count + chunk)]
        while len(found[-1]):
            cell, chunk = np.divmod(found[-1], count)
            above = cell_parent[cell].astype(np.int64)
            found.append(np.unique((above * count + chunk)[above >= 0]))
        cell, chunk = np.divmod(np.unique(np.concatenate(found)), count)
        self._cells = _blocks(cell, chunk, count)
        self._nodes = _blocks(cell_nodes[cell].ravel(), np.repeat(chunk, cell_nodes.shape[1]), count)

    def nodes(self, shown: np.ndarray) -> np.ndarray:
        """(B,) bool, of the nodes' blocks; shown: (chunks,) bool."""
        return _any(shown, *self._nodes)

    def cells(self, shown: np.ndarray) -> np.ndarray:
        """The same of the cells' blocks."""
        return _any(shown, *self._cells)


def runs(asked: np.ndarray, first: int, end: int) -> list[tuple[int, int]]:
    """(first, count) of what is asked for from `first` to before `end`; asked: (B,) of blocks."""
    if end <= first:
        return []
    start = first // BLOCK
    wanted = np.flatnonzero(asked[start : -(-end // BLOCK)]) + start
    if not len(wanted):
        return []
    jump = np.flatnonzero(np.diff(wanted) > GAP + 1)
    low = np.maximum(wanted[np.concatenate([[0], jump + 1])] * BLOCK, first)
    high = np.minimum((wanted[np.concatenate([jump, [len(wanted) - 1]])] + 1) * BLOCK, end)
    return list(zip(low.tolist(), (high - low).tolist(), strict=True))


def _blocks(item: np.ndarray, chunk: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """((P,) chunks, block by block, (B,) where each block's begin)."""
    block, chunk = np.divmod(np.unique(item // BLOCK * count + chunk), count)
    return chunk, np.searchsorted(block, np.arange(block.max(initial=-1) + 1))


def _any(shown: np.ndarray, chunk: np.ndarray, start: np.ndarray) -> np.ndarray:
    return np.logical_or.reduceat(shown[chunk], start) if len(start) else np.zeros(0, bool)
