"""Triangles split at marked edges, without T-junctions.

Edges are split, not triangles: a marked edge is split in every triangle that has it, into 2, 3 or 4 parts; and whenever an edge of
a triangle is marked, so is its longest, which keeps angles from degenerating [Plaza and Carey 2000, refinement of the skeleton].
Two numbers a corner: its *place*, which edges depend on, and its *sample*, the value: one place has several where a mesh is creased.
"""

from dataclasses import dataclass

import numpy as np

PAIRS = np.array([[0, 1], [1, 2], [2, 0]])
# How a triangle whose longest edge is its first falls into parts, by which of its edges are split (the longest is, when
# any is). Corners 0, 1, 2; midpoints 3 (of 0-1), 4 (of 1-2), 5 (of 2-0).
PIECES = {
    (False, False, False): [(0, 1, 2)],
    (True, False, False): [(0, 3, 2), (3, 1, 2)],
    (True, True, False): [(0, 3, 2), (3, 1, 4), (3, 4, 2)],
    (True, False, True): [(0, 3, 5), (3, 2, 5), (3, 1, 2)],
    (True, True, True): [(0, 3, 5), (3, 2, 5), (3, 1, 4), (3, 4, 2)],
}


@dataclass(frozen=True)
class Cut:
    """Triangles after a split."""

    points: np.ndarray  # (P', 3) places, the old ones first
    place: np.ndarray  # (T', 3)
    sample: np.ndarray  # (T', 3)
    parent: np.ndarray  # (T',) the triangle that each was a part of ...
    corner: np.ndarray  # (T', 3) ... and which of its corners (0 to 2) and edges' middles (3 to 5: PAIRS) its own are
    fresh: np.ndarray  # (T',) bool: a part, not the whole
    ends: np.ndarray  # (S' - S, 2) of each new sample, between which two old ones it lies


def edges_of(points: np.ndarray, place: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """((E, 2) sorted places, (T, 3) which of them a triangle's edges are, (E,) length)."""
    pairs = np.sort(place[:, PAIRS], axis=-1)
    keys, edge_of = np.unique(pairs.reshape(-1, 2), axis=0, return_inverse=True)
    return keys, edge_of.reshape(-1, 3), np.linalg.norm(points[keys[:, 0]] - points[keys[:, 1]], axis=-1)


def closed(mark: np.ndarray, edge_of: np.ndarray, length: np.ndarray) -> np.ndarray:
    """(E,) bool: the marked edges, and the longest of each triangle that has one."""
    mark = mark.copy()
    longest = np.take_along_axis(edge_of, length[edge_of].argmax(1)[:, None], 1)[:, 0]
    while True:
        needs = mark[edge_of].any(1) & ~mark[longest]
        if not needs.any():
            return mark
        mark[longest[needs]] = True


def cut(points, place, sample, keys, edge_of, mark) -> Cut:
    """Split at marked edges, which `closed` has made complete."""
    number = np.cumsum(mark) - 1
    split = mark[edge_of]
    # New samples: one for each pair of samples along a marked edge.
    triangle, k = np.nonzero(split)
    pairs = np.sort(np.stack([sample[triangle, k], sample[triangle, (k + 1) % 3]], -1), 1)
    ends, which = np.unique(pairs, axis=0, return_inverse=True)
    new_sample = np.full(split.shape, -1)
    new_sample[triangle, k] = which.ravel() + int(sample.max(initial=-1)) + 1
    # Corners 0..2 and midpoints 3..5 (3 between 0 and 1, ...) of every triangle.
    places = np.concatenate([place, len(points) + number[edge_of]], 1)
    samples = np.concatenate([sample, new_sample], 1)
    lengths = np.linalg.norm(points[place[:, [1, 2, 0]]] - points[place], axis=-1)
    pieces: list[tuple[np.ndarray, np.ndarray]] = []
    pattern = split @ [1, 2, 4]
    for code in np.unique(pattern):
        rows = np.flatnonzero(pattern == code)
        for first in range(3):  # the longest edge
            mine = rows[lengths[rows].argmax(1) == first]
            if len(mine):
                turn = np.concatenate([(np.arange(3) + first) % 3, (np.arange(3) + first) % 3 + 3])
                pieces.append((mine, turn[PIECES[tuple(bool(code >> (first + i) % 3 & 1) for i in range(3))]]))
    empty = np.zeros(0, int)
    parent = np.concatenate([empty, *(np.repeat(mine, len(parts)) for mine, parts in pieces)])
    corner = np.concatenate([empty.reshape(0, 3), *(np.tile(parts, (len(mine), 1)) for mine, parts in pieces)])
    return Cut(
        np.concatenate([points, points[keys[mark]].mean(1)]),
        np.take_along_axis(places[parent], corner, 1), np.take_along_axis(samples[parent], corner, 1),
        parent, corner, split.any(1)[parent], ends.reshape(-1, 2),
    )  # fmt: skip
