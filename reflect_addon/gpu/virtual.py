"""Virtual objects drawn into the reflection buffer [estalella-2005 section 3]: per part of a reflector its virtual vertices are
searched, and the virtual triangles drawn where the reflector is seen, in the right order and before what is behind them.

The vertex that a reflector shows at R lies behind it on the line of sight, as far as the light's way is long; so order in depth is
order along the reflected rays. With the option `finish` each fragment asks its own ray (glsl/virtual.frag.glsl).
"""

from dataclasses import dataclass
from weakref import WeakKeyDictionary

import numpy as np

from ..core import virtual_status
from ..core.asset import Asset
from ..core.camera import Camera
from ..core.map_space import MapSpace, map_space
from ..core.methods import virtual_objects
from ..core.remake import REFLECTOR
from ..core.snapshot import Instance, SceneSnapshot
from ..core.surface_asset import SurfaceMesh, meshes_of
from ..core.virtual_cull import may_show, runs
from ..core.virtual_lamps import lamp_rows
from ..core.virtual_mesh import virtual_mesh
from .counts import Counts
from .device import ensure
from .targets import ReflectionTarget
from .upload import read_texture, texture_bytes, triangle_batch
from .virtual_draw import Drawing, frame_of
from .virtual_grid import GridSearch, Seen
from .virtual_lamps import Lamps
from .virtual_scene import VirtualScene, image
from .virtual_search import Found, Search, place
from .virtual_second import Hits, Mirrors, Second, hits_of
from .virtual_tables import GridTables, Nodes


@dataclass
class _Part:
    """A piece of one reflector."""

    found: Found
    places: np.ndarray | None = None  # the scene's, for which `space` and the placing in `found` are
    space: MapSpace | None = None
    balls: np.ndarray | None = None  # (C, 4): around the chunks, in that space
    frame: object = None  # uniform buffer
    nodes: Nodes | None = None  # with a grid


class Projector:
    """The virtual objects of a renderer's reflectors."""

    def __init__(self, counts: Counts, textures):
        self.counts, self._textures = counts, textures
        self._scene: VirtualScene | None = None
        self.tally: dict[str, int] | None = None  # status -> vertices, while somebody counts
        self._made_of: tuple = ()
        self._mirrors: Mirrors | None = None
        self._lamps: Lamps | None = None
        self._shining: dict[str, SurfaceMesh] = {}  # the lamps' surfaces
        self._searches: dict[int, tuple[Asset, Search, tuple]] = {}  # with the asset's pieces
        self._drawings: dict[tuple[int, str | None], tuple[Asset, Drawing]] = {}
        self._seconds: dict[int, tuple[Asset, Second]] = {}
        self._hits: WeakKeyDictionary[ReflectionTarget, Hits] = WeakKeyDictionary()  # the window's target and each level's of mirrored views
        self._batch = triangle_batch()
        self._grids: dict[float, GridTables] = {}  # by share of the vertices; 0: in levels
        self._parts: dict[tuple[str, int], _Part] = {}

    def update(self, snapshot: SceneSnapshot, assets, surfaces: Asset | None):
        """Take another snapshot. Meshes are made again when one has another shape; what only moved is placed elsewhere."""
        self._snapshot, self._places = snapshot, None
        wanted = [a for a in assets if a.kind == virtual_objects.NAME]
        self._searches = {id(a): self._searches[id(a)] for a in wanted if id(a) in self._searches}
        self._drawings, self._seconds = (
            {key: held for key, held in programs.items() if any(held[0] is a for a in wanted)} for programs in (self._drawings, self._seconds)
        )
        self._grids = {share: tables for share, tables in self._grids.items() if share in map(_grid_of, wanted)}
        named = snapshot.named()
        shapes = tuple((p.instance, snapshot.meshes[named[p.instance].mesh].key) for p in surfaces.parts if p.instance in named) if surfaces else ()
        made_of = (id(surfaces), shapes) if wanted and surfaces is not None else ()
        if made_of != self._made_of:
            self._scene, self._parts, self._grids, self._made_of, self._surfaces = None, {}, {}, made_of, surfaces
            self._mirrors, self._lamps, self._drawings, self._seconds = None, None, {}, {}

    @property
    def draws(self) -> bool:
        """Whether there is anything to be drawn, and for some asset."""
        return bool(self._made_of)

    @staticmethod
    def has(asset: Asset) -> bool:
        """Whether the asset is of a reflector that shows virtual objects."""
        return asset.kind == virtual_objects.NAME

    @property
    def scene(self) -> VirtualScene | None:
        """The reflected scene, uploaded when it is first asked for; None where no surface radiance was baked."""
        if self._scene is None and self._made_of:
            now, named, known = {}, self._snapshot.named(), meshes_of(self._surfaces)
            self._shining = {lamp.name: known.pop(lamp.name) for lamp in self._snapshot.lamps if lamp.name in known}
            for name, mesh in known.items():
                if name in named and (moved := mesh.on(self._snapshot.meshes[named[name].mesh])) is not None:
                    now[name] = moved
            self._scene = VirtualScene(virtual_mesh(self._snapshot, now), self.counts)
        if self._places is None and self._scene is not None:
            self._places = self._scene.places(self._snapshot)
            rows = lamp_rows(self._snapshot, self._shining)
            if self._lamps is None or not np.array_equal(self._lamps.rows, rows):
                self._lamps = Lamps(rows, self.counts)
            if self._mirrors is None or self._lit != self._snapshot.light_hash:
                self._mirrors = Mirrors(self._snapshot, self._scene.mesh.names, self.counts)
                self._drawings, self._seconds = {}, {}
                self._lit = self._snapshot.light_hash
        return self._scene

    def draw(self, camera: Camera, rays, target: ReflectionTarget, asset: Asset, chosen: list[int], bounds):
        """The virtual objects that the chosen reflectors show, into a target with depth, inside bounds (x, y, width, height)."""
        scene = self.scene
        if scene is None or scene.batch is None:
            return
        reflectors = self._snapshot.reflectors()
        hits = self._hits_in(target) if self._has_second(asset) else None
        sizes = {}  # by reflector: 1 / m
        for index in chosen:
            own = "" if asset.options["sees_itself"] else reflectors[index].name
            search, pieces = self._search(asset)
            if not pieces:
                continue
            sizes[index] = sizes_per_metre = 1.0 / pieces[0].size
            for number, part in enumerate(pieces):
                held = self._part(reflectors[index], number)
                if held.places is not self._places:
                    held.places = self._places
                    held.space = map_space(part.center, part.size, _baked(asset), reflectors[index].world_from_object)
                    place(held.found, held.space.from_objects(self._places), self.counts)
                    held.balls = scene.balls(held.space, self._places)
                observer = held.space.observer(camera)
                shown = may_show(part.ball, part.cone, part.block[3], observer, held.balls) & scene.others(own)
                vertices, triangles = runs(shown, scene.mesh.chunks)
                if triangles:
                    self._set_frame(held, camera, index, sizes_per_metre)
                    if isinstance(search, GridSearch):
                        nodes = self._nodes(held, asset)
                        seen = Seen(held.frame, camera.width, camera.height, self.tally is not None)
                        search.run(scene, nodes, held.found, observer, part, shown, vertices, seen)
                    else:
                        search.run(scene, held.found, observer, part, vertices)
                    if self.tally is not None:
                        self._count(vertices)
                    drawing = self._drawing(asset, target.beside)
                    drawing.draw(scene, held.found, held.frame, rays, target, hits, bounds, triangles)
        if hits is not None and sizes:
            self._second(asset).draw(self._batch, rays, hits, min(sizes), max(sizes), bounds)
        for index, sizes_per_metre in sizes.items():
            self._lamps.draw(rays, target, index, sizes_per_metre, bounds)

    @staticmethod
    def _set_frame(held: _Part, camera: Camera, index: int, sizes_per_metre: float):
        data = frame_of(held.space, camera, index, sizes_per_metre)
        if held.frame is None:
            held.frame = ensure().types.GPUUniformBuf(data)
        else:
            held.frame.update(data)

    def prepare(self, asset: Asset, beside: str | None):
        """Upload and compile now."""
        if self.scene is not None and self.scene.batch is not None:
            if isinstance(self._search(asset)[0], GridSearch):
                self._grid(asset)
            self._drawing(asset, beside)
            if self._has_second(asset):
                self._second(asset)
            self._lamps.prepare(beside)

    def _count(self, ranges):
        """Adds what was just found of the vertices in `ranges` to the tally."""
        said = np.floor(read_texture(self.scene.virtual_img, self.counts)[..., 3].ravel())
        said = np.concatenate([said[first : first + count] for first, count in ranges])
        for status, name in virtual_status.NAMES.items():
            self.tally[name] = self.tally.get(name, 0) + int((said == status).sum())

    def bytes(self) -> int:
        """Memory on the GPU besides the assets' own."""
        starts = [start for part in self._parts.values() for start in (part.found.start, part.nodes and part.nodes.start) if start]
        held = sum(map(texture_bytes, starts)) + sum(tables.bytes for tables in self._grids.values())
        return held + sum(item.bytes for item in (self._scene, self._lamps, *self._hits.values()) if item)

    def free(self):
        self._scene, self._mirrors, self._lamps, self._made_of = None, None, None, ()
        self._searches, self._drawings, self._parts, self._grids = {}, {}, {}, {}
        self._seconds = {}
        self._hits.clear()

    def _search(self, asset: Asset) -> tuple[Search | GridSearch, tuple]:
        if id(asset) not in self._searches:
            kind = Search if _grid_of(asset) is None else GridSearch
            self._searches[id(asset)] = (asset, kind(asset, self._textures, self.counts), virtual_objects.parts_in(asset))
        return self._searches[id(asset)][1:]

    def _grid(self, asset: Asset) -> GridTables:
        """Made when the first asset asks for it."""
        share = _grid_of(asset)
        if share not in self._grids:
            self._grids[share] = GridTables(self.scene.mesh, share, self.counts)
        return self._grids[share]

    def _nodes(self, held: _Part, asset: Asset) -> Nodes:
        tables = self._grid(asset)
        if held.nodes is None or held.nodes.tables is not tables:
            held.nodes = Nodes(tables, tables.starts(self.counts))
        return held.nodes

    def _drawing(self, asset: Asset, beside: str | None) -> Drawing:
        key = (id(asset), beside)
        if key not in self._drawings:
            self._drawings[key] = (asset, Drawing(asset, beside, self._has_second(asset), self._mirrors, self.counts))
        return self._drawings[key][1]

    def _has_second(self, asset: Asset) -> bool:
        """Whether what mirrors show is drawn."""
        return self._mirrors.any and bool(asset.options["second_order"])

    def _second(self, asset: Asset) -> Second:
        if id(asset) not in self._seconds:
            self._seconds[id(asset)] = (asset, Second(asset, self._mirrors, self._textures, self.counts))
        return self._seconds[id(asset)][1]

    def _hits_in(self, target: ReflectionTarget) -> Hits:
        if target not in self._hits:
            self._hits[target] = hits_of(target, self.counts)
        return self._hits[target]

    def _part(self, reflector: Instance, number: int) -> _Part:
        key = (reflector.name, number)
        if key not in self._parts:
            start = image(len(self.scene.mesh.positions), "RGBA16F", self.counts)
            self._parts[key] = _Part(Found(self.scene.virtual_img, self.scene.place_img, start))
        return self._parts[key]


def _grid_of(asset: Asset) -> float | None:
    """The share of the vertices that an asset's grid has nodes for, 0 in levels; None without one, as assets from before there were any."""
    share, tolerance = (float(asset.options.get(name, 0.0)) for name in ("grid_share", "grid_tolerance"))
    return 0.0 if tolerance > 0 else share or None


def _baked(asset: Asset) -> np.ndarray:
    """(4, 4) float64: where the asset's reflector stood when it was baked."""
    return next(part.matrix() for part in asset.parts if part.kind == REFLECTOR)
