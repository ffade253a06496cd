"""Subdividing a mesh where a function on its surface changes, and nowhere else.

Problem. Radiance known per vertex is only as fine as the mesh: a shadow on two large triangles is lost, while ten
thousand vertices under an even sky say one thing ten thousand times.
Idea. Ask the function between the vertices (at edges' midpoints and inside triangles) and split where the answer differs
from what interpolation says. Edges are split, not triangles: a marked edge is split in every triangle that has it, into
2, 3 or 4 parts, so there are no T-junctions; and whenever an edge of a triangle is marked, so is its longest, which
keeps angles from degenerating [Plaza and Carey 2000, refinement of the skeleton]. All instances are refined together, one
bundle of questions a level, because asking has a price of its own.
Limits. What is narrower than the distance of the questions may be missed. A difference within the answers' own noise is
never a reason to split, so noisy answers give a coarser mesh.
"""

from dataclasses import dataclass, replace

import numpy as np

from .edge_split import PAIRS, closed, cut, edges_of
from .surface_soup import DARK, Ask, Lengths, Soup, inwards, longest, normals, sizes

# Questions inside a triangle stand this many to a side at most ...
MOST_INSIDE = 16
# ... and as densely as this share of the owner's size, so that a spot in the middle of a large floor is found.
APART = 1 / 12


def refine(
    soup: Soup, ask: Ask, tolerance: float, levels: int, lengths: Lengths, noise: np.ndarray | float = 0.0, most: int = 1 << 18
) -> tuple[Soup, np.ndarray]:
    """(refined soup, (S, 3) float64 value of each sample).

    tolerance: largest relative difference between the function and its interpolation that is left where the levels allow
    it. noise: of the answers, (owners,) or one for all. most: samples, about; those edges are split that are the longest for what the shortest there may be.
    """
    soup = _no_wider(soup, lengths, levels, most)
    allowed = np.broadcast_to(tolerance + noise, int(soup.owner.max(initial=-1)) + 1)
    values = np.zeros((0, 3))
    fresh_triangles = np.ones(len(soup.place), bool)
    for level in range(levels + 1):
        shortest, sure, _ = lengths(soup)
        may = fresh_triangles & (longest(soup) > shortest) & (level < levels) & (len(values) < most)
        corners, edges, inside = _first_of(soup.sample.ravel(), len(values)), _edges(soup, may), _inside(soup, may)
        if len(corners) and np.any(sure > shortest):  # what the corners say decides what is asked about
            values = np.concatenate([values, _answers(soup, ask, _corner_points(soup, corners), corners // 3)])
            corners = corners[:0]
            edges = _doubtful(soup, edges, values, sure, allowed / 2)
        points = np.concatenate([_corner_points(soup, corners), edges.middle, inside.points])
        if not len(points):
            break
        answers = _answers(soup, ask, points, np.concatenate([corners // 3, edges.triangle, inside.triangle]))
        own, at_edges, within = np.split(answers, np.cumsum([len(corners), len(edges.middle)]))
        values = np.concatenate([values, own])
        if not len(edges.middle) + len(inside.points):
            break
        brightness = _brightness(soup, values)
        off = np.abs(at_edges - values[edges.samples].mean(1)).max(1)
        marked = off > allowed[soup.owner[edges.triangle]] * _scale(brightness, soup.owner[edges.triangle], at_edges)
        told = np.einsum("nk,nkc->nc", inside.weights, values[soup.sample[inside.triangle]])
        off = np.abs(within - told).max(1)
        wrong = np.zeros(len(soup.place), bool)
        wrong[inside.triangle[off > allowed[soup.owner[inside.triangle]] * _scale(brightness, soup.owner[inside.triangle], within)]] = True
        marked, wrong = _widest(soup, edges, marked, wrong, shortest, most - len(values))
        soup, fresh_triangles = _split(soup, edges.places[marked], wrong, shortest)
    return soup, values


def _answers(soup: Soup, ask: Ask, points: np.ndarray, triangle: np.ndarray) -> np.ndarray:
    return ask(points, normals(soup)[triangle], soup.owner[triangle], soup.face[triangle])


def _no_wider(soup: Soup, lengths: Lengths, levels: int, most: int) -> Soup:
    """The soup with edges that are too long in any case split, unseen. Each has two more halvings than refinement has:
    neither is the other's price."""
    for _ in range(levels + 2):
        shortest, _, widest = lengths(soup)
        wide = longest(soup) > widest
        if not wide.any() or len(soup.points) > most:
            break
        corners = soup.points[soup.place]
        edges = np.linalg.norm(corners[:, [1, 2, 0]] - corners, axis=-1)
        triangle, k = np.nonzero(wide[:, None] & (edges > widest[:, None]))
        places = np.sort(np.stack([soup.place[triangle, k], soup.place[triangle, (k + 1) % 3]], -1), 1)
        soup, _ = _split(soup, places, np.zeros(len(soup.place), bool), shortest)
    return soup


@dataclass(frozen=True)
class _Edges:
    """Edges that may be split, one for each pair of samples."""

    triangle: np.ndarray  # (E,) a triangle that has it
    samples: np.ndarray  # (E, 2)
    places: np.ndarray  # (E, 2), sorted
    middle: np.ndarray  # (E, 3) world, a little inside the triangle


def _doubtful(soup: Soup, edges: _Edges, values: np.ndarray, sure: np.ndarray, tolerance: np.ndarray) -> _Edges:
    """Without the short edges whose ends agree."""
    ends = values[edges.samples]
    off = np.abs(ends[:, 0] - ends[:, 1]).max(-1)
    differ = off > tolerance[soup.owner[edges.triangle]] * _scale(_brightness(soup, values), soup.owner[edges.triangle], ends.mean(1))
    length = np.linalg.norm(np.diff(soup.points[edges.places], axis=1)[:, 0], axis=-1)
    chosen = differ | (length > sure[edges.triangle])
    return _Edges(edges.triangle[chosen], edges.samples[chosen], edges.places[chosen], edges.middle[chosen])


def _widest(soup: Soup, edges: _Edges, marked: np.ndarray, wrong: np.ndarray, shortest: np.ndarray, room: int):
    """(marked, wrong) with at most about `room` new samples: those edges and triangles that are the longest for what the
    shortest there may be."""
    at, of = np.flatnonzero(marked), np.flatnonzero(wrong)
    length = np.linalg.norm(np.diff(soup.points[edges.places[at]], axis=1)[:, 0], axis=-1)
    least = np.maximum(shortest, 1e-300)
    wide = np.concatenate([length / least[edges.triangle[at]], (longest(soup) / least)[of]])
    price = np.repeat([1.0, 1.5], [len(at), len(of)])  # an edge has two triangles
    order = np.argsort(-wide, kind="stable")
    left_out = order[np.cumsum(price[order]) > room]
    marked, wrong = marked.copy(), wrong.copy()
    marked[at[left_out[left_out < len(at)]]] = False
    wrong[of[left_out[left_out >= len(at)] - len(at)]] = False
    return marked, wrong


@dataclass(frozen=True)
class _Inside:
    points: np.ndarray  # (N, 3)
    triangle: np.ndarray  # (N,)
    weights: np.ndarray  # (N, 3)


def _first_of(numbers: np.ndarray, known: int) -> np.ndarray:
    """Index of the first occurrence of each number from `known` on, in the numbers' order."""
    unique, first = np.unique(numbers, return_index=True)
    return first[unique >= known]


def _corner_points(soup: Soup, corners: np.ndarray) -> np.ndarray:
    triangle, k = corners // 3, corners % 3
    return inwards(soup, triangle, soup.points[soup.place[triangle, k]])


def _edges(soup: Soup, active: np.ndarray) -> _Edges:
    triangle = np.repeat(np.flatnonzero(active), 3)
    pair = np.tile(PAIRS, (len(triangle) // 3, 1))
    samples = np.take_along_axis(soup.sample[triangle], pair, 1)
    places = np.take_along_axis(soup.place[triangle], pair, 1)
    _, first = np.unique(np.sort(samples, 1), axis=0, return_index=True)
    triangle, samples, places = triangle[first], samples[first], places[first]
    return _Edges(triangle, samples, np.sort(places, 1), inwards(soup, triangle, soup.points[places].mean(1)))


def _inside(soup: Soup, active: np.ndarray) -> _Inside:
    """A triangular grid of questions inside each active triangle, as many as its size asks for: none in small ones, whose
    edges are asked anyway."""
    chosen = np.flatnonzero(active)
    count = longest(soup)[chosen] / np.maximum(APART * sizes(soup)[soup.owner[chosen]], 1e-300)
    chosen, count = chosen[count > 1], np.minimum(np.ceil(count[count > 1]), MOST_INSIDE).astype(int)
    points, triangles, weights = [np.zeros((0, 3))], [np.zeros(0, int)], [np.zeros((0, 3))]
    for n in np.unique(count):
        i, j = np.meshgrid(np.arange(n), np.arange(n), indexing="ij")
        i, j = i[i + j < n], j[i + j < n]
        w = np.stack([(i + 1 / 3) / n, (j + 1 / 3) / n], -1)
        w = np.column_stack([w, 1 - w.sum(1)])
        mine = chosen[count == n]
        points.append(np.einsum("nk,tkx->tnx", w, soup.points[soup.place[mine]]).reshape(-1, 3))
        triangles.append(np.repeat(mine, len(w)))
        weights.append(np.tile(w, (len(mine), 1)))
    return _Inside(np.concatenate(points), np.concatenate(triangles), np.concatenate(weights))


def _brightness(soup: Soup, values: np.ndarray) -> np.ndarray:
    """(owners,) mean over an instance's triangles of the brightest channel."""
    bright = np.abs(values[soup.sample]).max((1, 2), initial=0)
    count = np.bincount(soup.owner)
    return np.bincount(soup.owner, weights=bright) / np.maximum(count, 1)


def _scale(brightness: np.ndarray, owner: np.ndarray, values: np.ndarray) -> np.ndarray:
    return np.maximum(np.maximum(np.abs(values).max(1), DARK * brightness[owner]), 1e-9)


def _split(soup: Soup, places: np.ndarray, wrong: np.ndarray, shortest: np.ndarray) -> tuple[Soup, np.ndarray]:
    """(soup with edges split and neighbours closed, (T,) bool: triangles that are new). places (E, 2), sorted: ends of the
    edges; wrong (T,) bool: triangles all of whose edges are; shortest (T,) m: no edge below is."""
    keys, edge_of, length = edges_of(soup.points, soup.place)
    limit = np.full(len(keys), np.inf)
    np.minimum.at(limit, edge_of.ravel(), np.repeat(shortest, 3))
    mark = np.zeros(len(keys), bool)
    at = np.searchsorted(keys[:, 0] * (len(soup.points) + 1) + keys[:, 1], places @ [len(soup.points) + 1, 1])
    mark[at] = True
    mark[edge_of[wrong].ravel()] = True
    return _cut(soup, keys, edge_of, closed(mark & (length > limit), edge_of, length))


def _cut(soup: Soup, keys: np.ndarray, edge_of: np.ndarray, mark: np.ndarray) -> tuple[Soup, np.ndarray]:
    found = cut(soup.points, soup.place, soup.sample, keys, edge_of, mark)
    weights = np.concatenate([soup.weights, soup.weights[:, PAIRS].mean(2)], 1)
    rows = found.parent
    return (
        replace(
            soup,
            points=found.points,
            place=found.place,
            sample=found.sample,
            face=soup.face[rows],
            weights=np.take_along_axis(weights[rows], found.corner[..., None], 1),
            side=soup.side[rows],
            owner=soup.owner[rows],
        ),
        found.fresh,
    )
