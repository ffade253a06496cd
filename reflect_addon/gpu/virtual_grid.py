"""Virtual vertices on the GPU with a grid [estalella-2005 section 5]: nodes are searched, vertices follow from their cell's eight.

Problem. Every vertex of the scene is searched for every part of a reflector, however small that part is on the screen.
Idea. By share of the vertices, as in the paper (core/virtual_grid.py): one pass searches the nodes, one interpolates the vertices. By a
tolerance in pixels (core/virtual_octree.py): two passes a level before, as core/virtual_follow.py goes through its tables.
Vertices that their cell cannot speak for are put on a list, which is searched at last: they are few and lie scattered, and threads that
run side by side take as long as the slowest. A cell of which no corner was found is given up, as octrees do (core/virtual_follow.py).
Nodes are searched where a vertex around them may be shown (core/virtual_asked.py).
Limits. Passes wait for each other, two a level. How many searches a frame had is known on the GPU alone.
"""

from dataclasses import dataclass

import numpy as np

from ..core import virtual_asked, virtual_follow, virtual_status
from ..core.asset import Asset
from .compute import ComputeInfo
from .counts import Counts
from .program import call_text, program
from .upload import read_texture
from .virtual_draw import FRAME_STRUCT, STATUSES, TABLES
from .virtual_scene import COLUMNS, VirtualScene
from .virtual_search import ARGUMENTS, WANTED, Found, search_kernel
from .virtual_tables import EMPTY, Nodes

# A cone of normals is wider by this, rad, for nodes: around a vertex at the edge of what a part shows, they lie beyond.
NODE_MARGIN = 0.3
# Pixels that stand for any number.
UNBOUNDED = 1e30
_DEFINES = (
    *TABLES, *STATUSES, ("CONVERGED", f"{virtual_status.CONVERGED:.1f}"), ("UNBOUNDED", f"{UNBOUNDED:.1e}"),
    *((name, f"{getattr(virtual_follow, name):.3f}") for name in ("UNSEEN", "WIDE", "FALL")),
)  # fmt: skip
_FORMATS = {"start_img": "RGBA16F", "apart_img": "R32F", "list_img": "R32UI"}  # others: RGBA32F
# How a shader reads nodes: from the images where it writes them, elsewhere as textures, which is faster.
_WRITTEN = (("NODE(texel)", "imageLoad(virtual_img, texel)"), ("NODE_START(texel)", "imageLoad(start_img, texel)"))
_READ = (("NODE(texel)", "texelFetch(node_tx, texel, 0)"), ("NODE_START(texel)", "texelFetch(node_start_tx, texel, 0)"))


@dataclass(frozen=True)
class Seen:
    """The picture that a tolerance in pixels is of."""

    frame: object  # uniform buffer of virtual_draw.frame_of
    width: int
    height: int
    counted: bool  # whether somebody wants to know of all searches: they are read back


class GridSearch:
    """One asset's programs, compiled, with its maps."""

    def __init__(self, asset: Asset, textures, counts: Counts):
        self.counts = counts
        self.tolerance = float(asset.options["grid_tolerance"])
        kernel = search_kernel(asset, (*WANTED, "evaluations"))
        self._images = {sampler: textures.texture(name, asset.images[name]) for name, sampler in kernel.images.items()}
        searching = {
            "generated": (("kernel", kernel.source), ("call", call_text(kernel, ARGUMENTS, "found_"))),
            "uniforms": (("VEC2", "range"), *(("VEC4", name) for name in ("observer", "seed", "block", "ball", "cone"))),
        }  # fmt: skip
        points, own = ("points_buf", "placing_buf"), ("virtual_img", "start_img", "place_img")
        inside = (*points, "cells_buf", "where_buf", "node_tx", "node_start_tx")
        self.listed = self._program("listed", (*inside, *self._images), (*own, "list_img"), _READ, **searching)
        outputs, range_only = ("virtual_img", "place_img", "list_img"), (("VEC2", "range"),)
        if not self.tolerance:
            self.nodes, self.cells = self._program("nodes", (*points, *self._images), own, _WRITTEN, **searching), None
            self.vertices = self._program("vertices", inside, outputs, _READ, uniforms=range_only)
            return
        around, levels = (*points, "cells_buf", *self._images), (*_WRITTEN, ("LEVELS", "1"))
        self.nodes = self._program("nodes", (*around, "node_where_buf", "around_buf"), (*own, "apart_img"), levels, **searching)
        searching["uniforms"] += (("VEC4", "rule"),)
        frame = ((FRAME_STRUCT, "ReflectVirtual", "frame"),)
        self.cells = self._program("cells", around, (*own, "apart_img"), levels, blocks=frame, **searching)
        self.vertices = self._program("vertices", (*inside, "apart_tx"), outputs, (*_READ, ("LEVELS", "1")), uniforms=range_only)

    def _program(self, name: str, samplers, images, defines, **more):
        info = ComputeInfo(
            name=f"reflect_virtual_{name}",
            compute=f"virtual_{name}.comp.glsl",
            group=(64, 1, 1),
            samplers=tuple(("FLOAT_2D", sampler) for sampler in samplers),
            images=tuple(
                (_FORMATS.get(image, "RGBA32F"), "UINT_2D" if image == "list_img" else "FLOAT_2D", image, "READ_WRITE") for image in images
            ),
            defines=(*_DEFINES, *defines),
            **more,
        )  # fmt: skip
        return program(info, self.counts)

    def run(self, scene: VirtualScene, nodes: Nodes, found: Found, observer, part, shown, ranges, seen: Seen):
        """The vertices in `ranges`, each (first, count), of the chunks `shown` (C,) bool, for a piece (virtual_objects.TablePart).
        Unless they are to be counted, nothing is read back, and those searches are counted that are sure to be done."""
        textures = nodes.tables.textures
        given = {
            "observer": observer, "seed": part.start, "block": part.block, "ball": part.ball, "cone": part.cone,
            "placing_buf": found.placing, **textures, **self._images,
        }  # fmt: skip
        self._search_nodes(nodes, given, shown, seen)
        given |= {
            "points_buf": scene.vertices_buf, "virtual_img": found.virtual, "place_img": found.place, "start_img": found.start,
            "node_tx": textures["node_img"], "node_start_tx": nodes.start, "apart_tx": textures.get("apart_img"),
        }  # fmt: skip
        textures["list_img"].clear(format="UINT", value=(0, 0, 0, 0))
        _dispatch(self.vertices, given, ranges)
        _dispatch(self.listed, given, [(0, sum(count for _, count in ranges))])
        if seen.counted:
            self.counts.searches += int(textures["list_img"].read()[0][0])
            self.counts.readbacks += 1

    def _search_nodes(self, nodes: Nodes, given, shown, seen: Seen):
        tables, textures = nodes.tables, nodes.tables.textures
        axis, cosine = given["cone"][:3], np.clip(given["cone"][3], -1, 1)
        given = given | {
            "cone": (*axis, np.cos(min(np.arccos(cosine) + NODE_MARGIN, np.pi))), "points_buf": textures["nodes_buf"],
            "virtual_img": textures["node_img"], "place_img": textures["node_place_img"], "start_img": nodes.start,
        }  # fmt: skip
        asked = tables.asked.nodes(shown)
        if not tables.levels:
            around = virtual_asked.runs(asked, 0, tables.nodes)
            _dispatch(self.nodes, given, around)
            self.counts.searches += sum(count for _, count in around)
            return
        for left in ("apart_img", *(("node_place_img",) if seen.counted else ())):  # what another piece left behind
            textures[left].clear(format="FLOAT", value=EMPTY)
        cells = tables.asked.cells(shown)
        for level, (corners, own) in enumerate(tables.levels):
            _dispatch(self.nodes, given, virtual_asked.runs(asked, *corners))
            sure = float(level >= virtual_follow.SURE)
            rule = (seen.width, seen.height, self.tolerance, sure)
            _dispatch(self.cells, given | {"rule": rule, "frame": seen.frame}, virtual_asked.runs(cells, *own))
        if seen.counted:
            self.counts.searches += int((read_texture(textures["node_place_img"], self.counts)[..., 3] > 0.5).sum())


def _dispatch(shader, given: dict[str, object], ranges):
    """All that the program declares, out of what is given, and its ranges, each (first, count)."""
    if not ranges:
        return
    info = shader.info
    shader.bind()
    for _, name in info.uniforms:
        if name != "range":
            shader.set(name, given[name])
    for _, _, name in info.blocks:
        shader.block(name, given[name])
    for _, name in info.samplers:
        shader.image(name, given[name])
    for _, _, name, _ in info.images:
        shader.store(name, given[name])
    for first, count in ranges:
        shader.set("range", (first, count))
        shader.dispatch(COLUMNS, -(-count // COLUMNS))
