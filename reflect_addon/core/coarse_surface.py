"""Coarser meshes of what surfaces send out, for views that see them from afar.

Problem. Surface radiance is refined for the eye beside it: a wall with a shadow has fifty thousand triangles. Every mirrored view draws them again, deep in a
row of mirrors for a few pixels.
Idea. Vertices are gathered in the cells of a grid [Rossignac and Borrel 1993, "Multi-resolution 3D approximations for rendering complex scenes"]: a
cell has one place, so nothing tears, and for each way that its surfaces face the mean of their radiance. Places on corners and edges of the object's own
triangles go before others, so outlines and flat faces stay. A view takes the coarsest mesh whose cells are no larger than its pixels.
Limits. What is thinner than a cell falls flat, by less than a pixel. Means are over vertices, of which there are more where light changes.
Reflectors are left as they are, since series find mirrors by their planes (mirror_series.py), and so is what deforms.
"""

from dataclasses import dataclass

import numpy as np

from .surface_asset import SurfaceMesh

# Fewer triangles are not worth a second mesh; a coarser one has this share of the last one's at most.
LEAST, SHARE = 1000, 0.6
# Cells over the median edge: twice as large each time, so many times.
FIRST, TIMES = 1.0, 8
# Of a pixel at the nearest place that a view may see: cells are no larger.
PIXELS = 0.5


@dataclass(frozen=True)
class Coarse:
    """A mesh in object space whose detail is `cell` m there."""

    cell: float
    positions: np.ndarray  # (V, 3) float32
    radiance: np.ndarray  # (V, 3) float32
    triangles: np.ndarray  # (T, 3)


def coarser(mesh: SurfaceMesh) -> tuple[Coarse, ...]:
    """Fine to coarse; none of a small mesh."""
    found, before = [], len(mesh.triangles)
    if before < LEAST:
        return ()
    corners = mesh.positions[mesh.triangles].astype(np.float64)
    edge = float(np.median(np.linalg.norm(corners - corners[:, [1, 2, 0]], axis=-1)))
    for step in range(TIMES if edge > 0 else 0):
        made = clustered(mesh, FIRST * edge * 2.0**step)
        if len(made.triangles) <= SHARE * before:
            found.append(made)
            before = len(made.triangles)
        if before < LEAST / 4:
            break
    return tuple(found)


def clustered(mesh: SurfaceMesh, cell: float) -> Coarse:
    """One vertex for each cell and each way of facing; triangles that keep three places."""
    at = np.floor((mesh.positions - mesh.positions.min(0)).astype(np.float64) / cell).astype(np.int64)
    _, place = np.unique(at, axis=0, return_inverse=True)
    place = place.ravel()
    # Corners of the object's own triangles first, then places on their edges, then those nearest to the cell's middle.
    inner = (mesh.weights > 1e-6).sum(1)
    off = np.linalg.norm((mesh.positions - mesh.positions.min(0)) / cell - at - 0.5, axis=1)
    order = np.lexsort((off, inner, place))
    first = order[np.unique(place[order], return_index=True)[1]]  # by place
    facing = np.rint(1.4 * mesh.normals).astype(np.int64) @ [9, 3, 1]
    keys, vertex = np.unique(np.column_stack([place, facing]), axis=0, return_inverse=True)
    vertex = vertex.ravel()
    count = np.bincount(vertex)
    radiance = np.stack([np.bincount(vertex, weights=channel) / count for channel in mesh.radiance.T.astype(np.float64)], -1)
    places = place[mesh.triangles]
    kept = (places[:, 0] != places[:, 1]) & (places[:, 1] != places[:, 2]) & (places[:, 2] != places[:, 0])
    return Coarse(cell, mesh.positions[first[keys[:, 0]]], radiance.astype(np.float32), vertex[mesh.triangles[kept]])


def chosen(cells: list[float], scale: float, pixel: float) -> int:
    """Index of the coarsest of these cells (fine to coarse) that is no larger than a pixel, -1 for none. scale: largest growth from object to world
    space; pixel: m at the nearest place that may be seen."""
    return int(np.searchsorted(np.asarray(cells) * scale, PIXELS * pixel, "right")) - 1
