"""Ranges of a grid's nodes and cells that chosen chunks ask for (core/virtual_asked.py)."""

import numpy as np
import pytest

from reflect_addon.core.virtual_asked import BLOCK, GAP, Asked, runs
from reflect_addon.core.virtual_grid import grid
from reflect_addon.core.virtual_octree import octree

CHUNKS, EACH = 60, 150


def scattered():
    """(positions, instance, chunks): chunks that are patches of three sheets."""
    random = np.random.default_rng(7)
    middle = random.uniform(-5, 5, (CHUNKS, 1, 3)) * [1, 1, 0]
    positions = (middle + random.uniform(-0.5, 0.5, (CHUNKS, EACH, 3)) * [1, 1, 0.2]).reshape(-1, 3).astype(np.float32)
    first = np.arange(CHUNKS) * EACH
    chunks = np.stack([first, np.full(CHUNKS, EACH), first, np.full(CHUNKS, EACH)], -1)
    return positions, np.repeat(np.sort(random.integers(0, 3, CHUNKS)), EACH), chunks


@pytest.mark.parametrize("levels", [False, True])
def test_all_that_a_chunk_needs_is_asked_for_and_little_else(levels):
    positions, instance, chunks = scattered()
    made = octree(positions, instance) if levels else grid(positions, instance, 0.3)
    parent = made.cell_parent if levels else np.full(len(made.cell_nodes), -1)
    asked = Asked(made.cell_nodes, parent, made.vertex_cell, chunks)
    for chunk in (0, 17, 59):
        shown = np.arange(CHUNKS) == chunk
        cells = set(made.vertex_cell[chunk * EACH : (chunk + 1) * EACH].tolist())
        cells |= {above for cell in cells for above in above_of(parent, cell)}
        nodes = np.unique(made.cell_nodes[sorted(cells)])
        for wanted, found in ((np.array(sorted(cells)), asked.cells(shown)), (nodes, asked.nodes(shown))):
            assert set(np.flatnonzero(found)) == set((wanted // BLOCK).tolist())
    assert not asked.nodes(np.zeros(CHUNKS, bool)).any() and asked.cells(np.ones(CHUNKS, bool)).all()


def above_of(parent, cell):
    while (cell := parent[cell]) >= 0:
        yield int(cell)


def test_ranges_hold_what_is_asked_for_once(rng):
    for share in (0.0, 0.02, 0.3, 1.0):
        asked = rng.random(500) < share
        first, end = 3 * BLOCK + 5, 480 * BLOCK - 7
        found = np.zeros(500 * BLOCK, int)
        ranges = runs(asked, first, end)
        for start, count in ranges:
            assert count > 0
            found[start : start + count] += 1
        wanted = np.repeat(asked, BLOCK)
        wanted[:first] = wanted[end:] = False
        assert found.max(initial=0) <= 1 and found[wanted].all() and not found[:first].any() and not found[end:].any()
        between = [b[0] - a[0] - a[1] for a, b in zip(ranges, ranges[1:], strict=False)]
        assert all(gap > GAP * BLOCK for gap in between)
    assert runs(np.ones(4, bool), 70, 70) == []


def test_nothing_asks_for_nothing():
    asked = Asked(np.zeros((0, 8), int), np.zeros(0, int), np.zeros(0, int), np.zeros((0, 4), int))
    assert len(asked.nodes(np.zeros(0, bool))) == 0 and runs(asked.cells(np.zeros(0, bool)), 0, 0) == []
