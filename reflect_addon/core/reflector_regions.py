"""Regions of a reflector: pieces between creases, cut where the sign of curvature changes, small ones merged.

The paper wants reflectors "segmented into concave or convex pieces ... currently done manually" [estalella-2005 section 6.2].
Here triangles of one kind that share a smooth edge are one region; then each region below a share of the surface goes to
the neighbour that it shares most border with, all at once and again until none is left that has a neighbour. Flat regions
in one plane are one, wherever they lie in it.
Limits. Merging knows borders only: a region of several kinds may come of it, and its kind is then that of most of its area.
"""

import numpy as np

from .flat_parts import MOST_PARTS, SAME_NORMAL, SAME_OFFSET
from .reflector_curvature import FLAT
from .reflector_topology import Surface, components


def regions_of(surface: Surface, kind: np.ndarray, small: float, creases: bool = True) -> np.ndarray:
    """(T,) int64, 0 and up. kind (T,): what separates (all equal: creases alone); small: share of the surface's area below
    which a region goes to a neighbour; creases: whether they separate."""
    open_edge = ~surface.crease if creases else np.ones(len(surface.pairs), bool)
    pairs, length = surface.pairs[open_edge], surface.length[open_edge]
    region = components(len(kind), pairs[kind[pairs[:, 0]] == kind[pairs[:, 1]]])
    alike = surface.wall[pairs[:, 0]] == surface.wall[pairs[:, 1]]  # no rim goes to the wall that it rims, nor the other way
    region = merged(region, pairs[alike], length[alike], surface.area, small * surface.area.sum())
    return _coplanar(surface, kind, region)


def merged(region: np.ndarray, pairs: np.ndarray, length: np.ndarray, area: np.ndarray, least: float) -> np.ndarray:
    """(T,) int64, 0 and up: regions with less area than `least` in the neighbour they share most border with, by its length."""
    while True:
        size = np.bincount(region, area)
        a, b = region[pairs].T
        apart = a != b
        both = np.concatenate([np.stack([a, b], -1)[apart], np.stack([b, a], -1)[apart]])
        both, border = both[size[both[:, 0]] < least], np.concatenate([length[apart]] * 2)[size[both[:, 0]] < least]
        if not len(both):
            return region
        couple, at = np.unique(both, axis=0, return_inverse=True)
        shared = np.bincount(at.reshape(-1), border)
        order = np.lexsort((couple[:, 1], -shared, couple[:, 0]))
        _, first = np.unique(couple[order, 0], return_index=True)
        region = components(len(size), couple[order[first]])[region]


def _coplanar(surface: Surface, kind: np.ndarray, region: np.ndarray) -> np.ndarray:
    """The regions with those in the planes of the largest flat ones joined."""
    size = np.bincount(region, surface.area)
    flat = np.flatnonzero(np.bincount(region, surface.area * (kind == FLAT)) > 0.999 * size)
    flat = flat[np.argsort(-size[flat], kind="stable")]
    weighted, middle = (surface.area[:, None] * v for v in (surface.normal, surface.corners.mean(1)))
    normal, place = (np.stack([np.bincount(region, v[:, k]) for k in range(3)], -1)[flat] for v in (weighted, middle))
    normal /= np.maximum(np.linalg.norm(normal, axis=-1, keepdims=True), 1e-300)
    place /= size[flat, None]
    joined, left = np.arange(len(size)), np.arange(len(flat))
    for _ in range(MOST_PARTS):
        if not len(left):
            break
        first = left[0]
        same = normal[left] @ normal[first] > np.cos(SAME_NORMAL)
        same &= np.abs((place[left] - place[first]) @ normal[first]) < SAME_OFFSET
        same[0] = True
        joined[flat[left[same]]] = flat[first]
        left = left[~same]
    return np.unique(joined[region], return_inverse=True)[1].reshape(-1)
