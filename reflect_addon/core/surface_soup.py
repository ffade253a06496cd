"""Triangles of many instances as one, of which values are asked: what is subdivided (surface_refine.py) and cut (surface_cuts.py).

Two numbers a corner: its *place* (which edges and cracks depend on) and its *sample* (the value): where a mesh has a
sharp edge, and on the two sides of a sheet, one place has several samples.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

# Differences are judged relative to the radiance there, but not to less than this share of the owner's mean.
DARK = 0.1
# Questions at edges and corners are moved this share of the way to the triangle's middle: what lies beyond a concave
# edge must not answer.
INWARDS = 1e-3


@dataclass(frozen=True)
class Soup:
    """Triangles of any number of instances. T triangles, P places, S samples.

    `weights` say where a corner lies in the triangle `face` of the instance's own mesh, so that whatever is done to that
    mesh later can be done to the corner.
    """

    points: np.ndarray  # (P, 3) float64, world, m
    place: np.ndarray  # (T, 3) int into points
    sample: np.ndarray  # (T, 3) int: corners with the same value
    face: np.ndarray  # (T,) int
    weights: np.ndarray  # (T, 3, 3) float64: barycentric coordinates of each corner in that face
    side: np.ndarray  # (T,) float, 1 or -1: the side of the triangle that is seen
    owner: np.ndarray  # (T,) int: instance


# (points (N, 3), normals (N, 3), owner (N,), face (N,)) -> (N, 3) values. Normals are of the triangle, towards its side;
# face: the triangle of the owner's own mesh.
Ask = Callable[[np.ndarray, np.ndarray, np.ndarray, np.ndarray], np.ndarray]
# soup -> ((T,) m: edges of a triangle that are no longer are not split; (T,) m: of those that are no longer and whose ends agree
# no question is asked; (T,) m: longer ones are split, whatever they show).
Lengths = Callable[[Soup], tuple[np.ndarray, np.ndarray, np.ndarray]]


def normals(soup: Soup) -> np.ndarray:
    """(T, 3) unit normals towards the seen side."""
    corners = soup.points[soup.place]
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(cross, axis=-1, keepdims=True)
    return soup.side[:, None] * cross / np.where(length > 0, length, 1)


def inwards(soup: Soup, triangle: np.ndarray, points: np.ndarray) -> np.ndarray:
    """(N, 3) points of the triangles (N,), moved a little to their middles."""
    return points * (1 - INWARDS) + soup.points[soup.place[triangle]].mean(1) * INWARDS


def longest(soup: Soup) -> np.ndarray:
    """(T,) length of each triangle's longest edge, m."""
    corners = soup.points[soup.place]
    return np.linalg.norm(corners[:, [1, 2, 0]] - corners, axis=-1).max(1, initial=0)


def sizes(soup: Soup) -> np.ndarray:
    """(owners,) the longest side of each instance's bounding box, m."""
    owners = int(soup.owner.max(initial=-1)) + 1
    low, high = np.full((owners, 3), np.inf), np.full((owners, 3), -np.inf)
    corners = soup.points[soup.place]
    np.minimum.at(low, soup.owner, corners.min(1))
    np.maximum.at(high, soup.owner, corners.max(1))
    return np.where(np.isfinite(low), high - low, 0).max(1, initial=0)
