"""Virtual vertices on the GPU with a grid [estalella-2005 section 5]: nodes are searched, vertices follow from their cell's eight.

Problem. Every vertex of the scene is searched for every part of a reflector, however small that part is on the screen.
Idea. By share of the vertices, as in the paper (core/virtual_grid.py): one pass searches the nodes, one interpolates the vertices. By a
tolerance in pixels (core/virtual_octree.py): before that, level by level, as core/virtual_follow.py goes through its tables.
Vertices that their cell cannot speak for are put on a list, which is searched at last: they are few and lie scattered, and threads that
run side by side take as long as the slowest. A cell of which no corner was found is given up, as octrees do (core/virtual_follow.py).
Nodes are searched where a vertex around them may be shown (core/virtual_asked.py).
Limits. Passes wait for each other, five a level. How many searches a frame had is known on the GPU alone. In passes over levels a texture
of nodes is read while others of its texels are written. Not faster for every scene, nor as exact: docs/decisions.md has what was measured.
"""

from dataclasses import dataclass

import numpy as np

from ..core import virtual_asked, virtual_follow, virtual_status
from ..core.asset import Asset
from .compute import ComputeInfo
from .counts import Counts
from .program import call_text, program
from .virtual_draw import FRAME_STRUCT, STATUSES, TABLES
from .virtual_scene import VirtualScene
from .virtual_search import ARGUMENTS, Found, search_kernel
from .virtual_tables import EMPTY, Nodes

# A cone of normals is wider by this, rad, for nodes: around a vertex at the edge of what a part shows, they lie beyond.
NODE_MARGIN = 0.3
# Of so many points one is expected on a list, which has as many threads, and more turns where it is longer; so many at least.
LISTED, FEWEST = 8, 1024
# Pixels that stand for any number, and a cell's before it is judged.
UNBOUNDED, UNJUDGED = 1e30, -1.0
_DEFINES = (
    *TABLES, *STATUSES, ("CONVERGED", f"{virtual_status.CONVERGED:.1f}"), ("UNBOUNDED", f"{UNBOUNDED:.1e}"),
    ("UNJUDGED", f"({UNJUDGED:.1f})"),
    *((name, f"{getattr(virtual_follow, name):.3f}") for name in ("UNSEEN", "WIDE", "FALL")),
    ("NODE(texel)", "texelFetch(node_tx, texel, 0)"), ("NODE_START(texel)", "texelFetch(node_start_tx, texel, 0)"),
)  # fmt: skip
# Formats and kinds of images; others are tables of four floats.
_KINDS = {
    "start_img": ("RGBA16F", "FLOAT_2D"), "apart_img": ("R32F", "FLOAT_2D"), "list_img": ("R32UI", "UINT_2D"), "count_img": ("R32UI", "UINT_2D"),
}  # fmt: skip
_ANY = ("RGBA32F", "FLOAT_2D")
_POINTS = ("points_buf", "placing_buf", "cells_buf", "where_buf", "node_tx", "node_start_tx")
_RULE = (("VEC4", "rule"),)


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
        kernel = search_kernel(asset)
        self._images = {sampler: textures.texture(name, asset.images[name]) for name, sampler in kernel.images.items()}
        lists, found = ("list_img", "count_img"), ("virtual_img", "place_img")
        searching = {
            "samplers": (*_POINTS, *self._images),
            "uniforms": tuple(("VEC4", name) for name in ("observer", "seed", "block", "ball", "cone")),
            "generated": (("kernel", kernel.source), ("call", call_text(kernel, ARGUMENTS, "found_"))),
        }  # fmt: skip
        self.listed = self._program("listed", images=(*found, "start_img", *lists), **searching)
        if not self.tolerance:
            self.all = self._program("listed", ("ALL",), images=(*found, "start_img"), **searching)
            self.vertices = self._program("points", ("LISTS",), samplers=_POINTS, images=(*found, *lists))
            return
        self.vertices = self._program("points", ("LISTS", "LEVELS"), samplers=(*_POINTS, "apart_tx"), images=(*found, *lists))
        around = (*_POINTS, "apart_tx", "around_buf")
        self.corners = self._program("points", ("LISTS", "LEVELS", "NODES"), samplers=around, images=(*found, *lists))
        self.cells = self._program("cells", ("LISTS",), samplers=_POINTS, images=(*found, "apart_img", *lists), uniforms=_RULE)
        frame = ((FRAME_STRUCT, "ReflectVirtual", "frame"),)
        corners = ("cells_buf", "node_tx", "node_start_tx")
        self.apart = self._program("apart", samplers=corners, images=("apart_img",), uniforms=_RULE, blocks=frame)

    def _program(self, name: str, switches: tuple[str, ...] = (), samplers=(), images=(), uniforms=(), **more):
        info = ComputeInfo(
            name=f"reflect_virtual_{name}",
            compute=f"virtual_{name}.comp.glsl",
            group=(64, 1, 1),
            uniforms=(("VEC4", "range"), *uniforms),
            samplers=tuple(("FLOAT_2D", sampler) for sampler in samplers),
            images=tuple((*_KINDS.get(image, _ANY), image, "READ_WRITE") for image in images),
            defines=(*_DEFINES, *((switch, "1") for switch in switches)),
            **more,
        )  # fmt: skip
        return program(info, self.counts)

    def run(self, scene: VirtualScene, nodes: Nodes, found: Found, observer, part, shown, ranges, seen: Seen):
        """The vertices in `ranges`, each (first, count), of the chunks `shown` (C,) bool, for a piece (virtual_objects.TablePart).
        Unless they are to be counted, nothing is read back, and those searches are counted that are sure to be done."""
        textures = nodes.tables.textures
        given = {
            "observer": observer, "seed": part.start, "block": part.block, "ball": part.ball, "cone": part.cone,
            "placing_buf": found.placing, "node_tx": textures["node_img"], "node_start_tx": nodes.start,
            "apart_tx": textures.get("apart_img"), **self._images, **textures,
        }  # fmt: skip
        textures["count_img"].clear(format="UINT", value=(0, 0, 0, 0))
        axis, cosine = part.cone[:3], np.clip(part.cone[3], -1, 1)
        of_nodes = given | {
            "cone": (*axis, np.cos(min(np.arccos(cosine) + NODE_MARGIN, np.pi))), "points_buf": textures["nodes_buf"],
            "virtual_img": textures["node_img"], "place_img": textures["node_place_img"], "start_img": nodes.start,
            "where_buf": textures["node_where_buf"],
        }  # fmt: skip
        if self.tolerance:
            self._levels(nodes, of_nodes, shown, seen)
        else:
            around = virtual_asked.runs(nodes.tables.asked.nodes(shown), 0, nodes.tables.nodes)
            _dispatch(self.all, of_nodes, around)
            self.counts.searches += sum(count for _, count in around)
        given |= {"points_buf": scene.vertices_buf, "virtual_img": found.virtual, "place_img": found.place, "start_img": found.start}
        self._listed(self.vertices, given, ranges, 2 * len(nodes.tables.levels))
        if seen.counted:
            self.counts.searches += int(np.asarray(textures["count_img"].read()).sum())
            self.counts.readbacks += 1

    def _levels(self, nodes: Nodes, given, shown, seen: Seen):
        asked, tables = nodes.tables.asked, nodes.tables
        tables.textures["apart_img"].clear(format="FLOAT", value=EMPTY)  # what another piece left behind
        around, wanted = asked.nodes(shown), asked.cells(shown)
        for level, (corners, cells) in enumerate(tables.levels):
            self._listed(self.corners, given, virtual_asked.runs(around, *corners), 2 * level)
            own = virtual_asked.runs(wanted, *cells)
            rule = (seen.width, seen.height, self.tolerance, float(level >= virtual_follow.SURE))
            judged = given | {"frame": seen.frame, "rule": rule}
            self._listed(self.cells, judged, own, 2 * level + 1)
            _dispatch(self.apart, judged, own)

    def _listed(self, shader, given, ranges, place: int):
        """A pass that makes a list, and the search of what is on it; place: of its count."""
        _dispatch(shader, given, ranges, place)
        points = sum(count for _, count in ranges)
        threads = min(points, max(points // LISTED, FEWEST))
        _dispatch(self.listed, given, [(0, threads)] if points else [], place)


def _dispatch(shader, given: dict[str, object], ranges, place: int = 0):
    """All that the program declares, out of what is given, and its ranges, each (first, count); place: of a list's count."""
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
        shader.set("range", (first, count, place, 0))
        shader.dispatch(count)
