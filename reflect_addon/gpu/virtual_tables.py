"""Grids around the reflected scene's vertices on the GPU: the tables of core/virtual_grid.py or core/virtual_octree.py as textures.

Tables are those of the scene's shape, made once for all reflectors. What nodes hold is of the part that is being searched, and the next
part's replaces it; only where they were found last is kept for each part, since the next frame's searches start there.
"""

from dataclasses import dataclass

import numpy as np

from ..core.virtual_asked import Asked
from ..core.virtual_grid import grid
from ..core.virtual_mesh import VirtualMesh
from ..core.virtual_octree import octree
from .counts import Counts
from .upload import texture_bytes
from .virtual_scene import image, table

EMPTY = (0.0, 0.0, 0.0, 0.0)


class GridTables:
    """By share of the vertices, or in levels where that is 0; names as in glsl/virtual_cells_lib.glsl and what includes it."""

    def __init__(self, mesh: VirtualMesh, share: float, counts: Counts):
        made = grid(mesh.positions, mesh.instance, share) if share > 0 else octree(mesh.positions, mesh.instance)
        self.nodes, cells = len(made.node_position), len(made.cell_nodes)
        middle, parent = np.full((2, cells), -1)
        node_cell, node_where = np.full(self.nodes, -1), np.zeros((self.nodes, 3))
        self.textures, self.levels = {}, ()
        if share <= 0:
            # Of each level the first and the end of its corners among the nodes, and of its cells.
            self.levels = tuple(zip(made.node_ranges[:, 1:].tolist(), made.cell_ranges.tolist(), strict=True))
            middle, parent = made.cell_nodes[:, 8], made.cell_parent
            node_cell, node_where = made.node_around[:, 0].copy(), made.node_where
            own = np.flatnonzero(middle >= 0)
            node_cell[middle[own]] = own
            self.textures = {
                "around_buf": table("virtual nodes' cells", made.node_around, counts),
                "apart_img": image(cells, "R32F", counts),
            }
        self.asked = Asked(made.cell_nodes, parent, made.vertex_cell, mesh.chunks)
        rows = np.column_stack([made.cell_nodes[:, :8], middle, parent, np.zeros((cells, 2))]).reshape(-1, 4)
        self.textures |= {
            "cells_buf": table("virtual cells", rows, counts),
            "nodes_buf": table("virtual nodes", np.column_stack([made.node_position, made.node_instance]), counts),
            "node_where_buf": table("virtual nodes in cells", np.column_stack([node_cell, node_where]), counts),
            "where_buf": table("virtual vertices in cells", np.column_stack([made.vertex_cell, made.vertex_where]), counts),
            "node_img": image(self.nodes, "RGBA32F", counts),
            "node_place_img": image(self.nodes, "RGBA32F", counts),
            "list_img": image(max(self.nodes, len(mesh.positions)), "R32UI", counts),
            "count_img": image(2 * len(self.levels) + 1, "R32UI", counts),
        }
        self.bytes = sum(map(texture_bytes, self.textures.values()))

    def starts(self, counts: Counts):
        """Where a part's nodes were found last: nowhere yet."""
        return image(self.nodes, "RGBA16F", counts)


@dataclass(frozen=True)
class Nodes:
    """What the searches of one part have of a grid."""

    tables: GridTables
    start: object  # GridTables.starts, the part's own
