"""Cutting triangles along a step: where radiance jumps, halving an edge again and again buys a line with points.

Problem. Along the border of a tile, of a shadow's core, of what stands on a floor, radiance jumps. Interpolated, the jump is as
wide as the finest triangles, and making it half as wide takes twice as many of them.
Idea. An edge whose ends differ and whose middle is like one of them holds a step; bisection finds it, each question halving
where it can be. The edge is then cut twice, just before and just after, and the triangles beside it fall into parts
so that all of the jump lies in slivers along the line: discontinuity meshing [Lischinski, Tampieri, Greenberg 1992] without an
analytic line, and with two values close together in place of two at one vertex, so that it stays a mesh like any other.
A line that crosses a triangle goes through two of its edges, which gives five parts. Cuts are made per edge, for all
triangles that have it, so there are no T-junctions.
Limits. One step an edge. Where three steps meet in one triangle its middle stays interpolated. Smooth edges (a lamp's
penumbra) are no steps, and are left to surface_refine.py.
"""

from dataclasses import replace

import numpy as np

from .edge_split import PAIRS
from .surface_soup import DARK, Ask, Lengths, Soup, inwards, normals

# The answer in the middle of a step is nearer than this share of the jump to one of the ends.
LIKE_AN_END = 0.25
# The jump between the two cuts is at least this share of the one between the ends, or it was no step.
STILL_THERE = 0.5


def cut(
    soup: Soup, values: np.ndarray, ask: Ask, tolerance: np.ndarray | float, halvings: int, lengths: Lengths, most: int = 1 << 18
) -> tuple[Soup, np.ndarray]:
    """(soup, (S, 3) values) with every edge that holds a step cut on both sides of it.

    tolerance: a smaller relative difference between an edge's ends is no step, (owners,) or one for all. halvings: questions an edge; the slivers
    are so many halves of an edge wide. lengths: as refine takes it; where edges are never split
    they are not cut. most: edges that are cut, the highest steps for their length and
    distance."""
    if not halvings or not len(soup.place):
        return soup, values
    least = lengths(soup)[0]
    triangle, k = np.nonzero(np.isfinite(least)[:, None] & _jumps(soup, values, tolerance))
    samples = np.stack([soup.sample[triangle, k], soup.sample[triangle, (k + 1) % 3]], -1)
    _, first = np.unique(np.sort(samples, 1), axis=0, return_index=True)
    triangle, k, samples = triangle[first], k[first], samples[first]
    if not len(triangle):
        return soup, values
    places = np.stack([soup.place[triangle, k], soup.place[triangle, (k + 1) % 3]], -1)
    if len(triangle) > most:
        length = np.linalg.norm(np.diff(soup.points[places], axis=1)[:, 0], axis=-1)
        height = np.abs(values[samples[:, 0]] - values[samples[:, 1]]).max(1)
        chosen = np.sort(np.argsort(-height * length / np.maximum(least[triangle], 1e-300), kind="stable")[:most])
        triangle, samples, places = triangle[chosen], samples[chosen], places[chosen]
    before, after, step = _steps(soup, ask, triangle, places, values[samples], halvings)
    triangle, places, before, after, step = (a[step > 0] for a in (triangle, places, before, after, step))
    if not len(step):
        return soup, values
    # One cut for all that has the edge: the largest jump's. Shares count from the lower place on.
    turned = places[:, 0] > places[:, 1]
    before, after = np.where(turned, 1 - after, before), np.where(turned, 1 - before, after)
    order = np.argsort(-step, kind="stable")
    keys, first = np.unique(np.sort(places, 1)[order], axis=0, return_index=True)
    shares = np.stack([before, after], -1)[order][first]
    cut_soup = _cut(soup, keys, shares)
    fresh = np.unique(cut_soup.sample.ravel(), return_index=True)[1][len(values) :]
    at, corner = fresh // 3, fresh % 3
    points = inwards(cut_soup, at, cut_soup.points[cut_soup.place[at, corner]])
    return cut_soup, np.concatenate([values, ask(points, normals(cut_soup)[at], cut_soup.owner[at], cut_soup.face[at])])


def _jumps(soup: Soup, values: np.ndarray, tolerance: np.ndarray | float) -> np.ndarray:
    """(T, 3) bool: edges whose ends differ."""
    ends = values[soup.sample[:, PAIRS]]  # (T, 3, 2, 3)
    bright = np.abs(ends).max((2, 3))
    mean = np.bincount(soup.owner, weights=bright.mean(1)) / np.maximum(np.bincount(soup.owner), 1)
    scale = np.maximum(np.maximum(bright, DARK * mean[soup.owner, None]), 1e-9)
    return np.abs(ends[:, :, 0] - ends[:, :, 1]).max(-1) > (tolerance + np.zeros(len(mean)))[soup.owner, None] * scale


def _steps(soup: Soup, ask: Ask, triangle, places, ends, halvings) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """((E,) share of the edge where the step is not yet, (E,) where it is over, (E,) how high it is: 0 for none)."""
    low, high = np.zeros(len(triangle)), np.ones(len(triangle))
    at_low, at_high = ends[:, 0].copy(), ends[:, 1].copy()
    height = np.abs(ends[:, 0] - ends[:, 1]).max(1)
    alive = np.ones(len(triangle), bool)
    towards = normals(soup)
    for turn in range(halvings):
        of = np.flatnonzero(alive)
        if not len(of):
            break
        share = (low[of] + high[of]) / 2
        along = soup.points[places[of]]
        points = along[:, 0] * (1 - share)[:, None] + along[:, 1] * share[:, None]
        points = inwards(soup, triangle[of], points)
        answer = ask(points, towards[triangle[of]], soup.owner[triangle[of]], soup.face[triangle[of]])
        off = np.abs(answer[:, None] - ends[of]).max(-1)  # (n, 2)
        to_low = off[:, 0] < off[:, 1]
        low[of[to_low]], at_low[of[to_low]] = share[to_low], answer[to_low]
        high[of[~to_low]], at_high[of[~to_low]] = share[~to_low], answer[~to_low]
        if turn == 0:
            alive[of[off.min(1) > LIKE_AN_END * height[of]]] = False
    alive &= np.abs(at_low - at_high).max(1) > STILL_THERE * height
    # A step right at an end is cut once within the last interval: no sliver is empty.
    low, high = np.where(low == 0, high / 2, low), np.where(high == 1, (1 + low) / 2, high)
    return low, high, np.where(alive, height, 0.0)


def _cut(soup: Soup, keys: np.ndarray, shares: np.ndarray) -> Soup:
    """keys (E, 2), sorted: ends of the edges that are cut at shares (E, 2) of the way from the first to the second."""
    pairs = soup.place[:, PAIRS]
    up = pairs[..., 0] < pairs[..., 1]  # as the key runs
    width = len(soup.points) + 1
    codes = keys @ [width, 1]
    asked = np.sort(pairs, -1) @ [width, 1]
    at = np.minimum(np.searchsorted(codes, asked), len(codes) - 1)
    is_cut = codes[at] == asked  # (T, 3)
    ends = soup.points[keys]
    fresh_points = ends[:, None, 0] * (1 - shares)[..., None] + ends[:, None, 1] * shares[..., None]  # (E, 2, 3)
    first = len(soup.points) + 2 * at
    near_place = np.where(up, first, first + 1)  # nearer to the edge's first corner in this triangle
    far_place = np.where(up, first + 1, first)
    # Samples: two for each pair of samples along a cut edge.
    triangle, k = np.nonzero(is_cut)
    ends = np.stack([soup.sample[triangle, k], soup.sample[triangle, (k + 1) % 3]], -1)
    _, which = np.unique(np.sort(ends, 1), axis=0, return_inverse=True)
    number = np.full(is_cut.shape, -1)
    number[triangle, k] = 2 * which.ravel() + int(soup.sample.max(initial=-1)) + 1
    near_sample, far_sample = np.where(up, number, number + 1), np.where(up, number + 1, number)
    near = np.where(up, shares[at, 0], 1 - shares[at, 1])
    far = np.where(up, shares[at, 1], 1 - shares[at, 0])
    start, end = soup.weights, soup.weights[:, [1, 2, 0]]
    weights = [start] + [start * (1 - s)[..., None] + end * s[..., None] for s in (near, far)]
    # Corners 0..2, the nearer cuts 3..5 of the edges 0-1, 1-2, 2-0, the farther ones 6..8.
    place = np.concatenate([soup.place, near_place, far_place], 1)
    sample = np.concatenate([soup.sample, near_sample, far_sample], 1)
    weights = np.concatenate(weights, 1)
    pattern = is_cut @ [1, 2, 4]
    pieces = []
    for code in np.unique(pattern):
        mine = np.flatnonzero(pattern == code)
        turn, parts = _PARTS[int(code)]
        turned = np.concatenate([(np.arange(3) + turn) % 3 + 3 * group for group in range(3)])
        pieces.append((mine, turned[np.array(parts)]))
    rows = np.concatenate([np.repeat(mine, len(parts)) for mine, parts in pieces])
    corner = np.concatenate([np.tile(parts, (len(mine), 1)) for mine, parts in pieces])
    return replace(
        soup,
        points=np.concatenate([soup.points, fresh_points.reshape(-1, 3)]),
        place=np.take_along_axis(place[rows], corner, 1),
        sample=np.take_along_axis(sample[rows], corner, 1),
        face=soup.face[rows],
        weights=np.take_along_axis(weights[rows], corner[..., None], 1),
        side=soup.side[rows],
        owner=soup.owner[rows],
    )


# Parts of a triangle by which edges are cut. Edge 0-1 alone; edges 0-1 and 2-0; all. Corners 0..2; cuts 3 and 6 of 0-1, 4 and
# 7 of 1-2, 5 and 8 of 2-0, the first nearer to the edge's first corner.
_ONE = [(0, 3, 2), (3, 6, 2), (6, 1, 2)]
_TWO = [(0, 3, 8), (3, 6, 5), (3, 5, 8), (6, 1, 5), (1, 2, 5)]
_THREE = [(0, 3, 8), (1, 4, 6), (2, 5, 7), (3, 6, 4), (3, 4, 7), (3, 7, 5), (3, 5, 8)]
# Which edges, as bits -> (corners are turned by, parts).
_PARTS = {
    0: (0, [(0, 1, 2)]), 1: (0, _ONE), 2: (1, _ONE), 4: (2, _ONE),
    5: (0, _TWO), 3: (1, _TWO), 6: (2, _TWO), 7: (0, _THREE),
}  # fmt: skip
