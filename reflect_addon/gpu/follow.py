"""Assets follow the scene on the GPU: captures into their atlases, and another table; nothing else is uploaded.

A camera's move changes no snapshot, so nothing comes here; a snapshot in which nothing concerns an asset costs a
comparison of its parts.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from ..core.asset import Asset
from ..core.billboard_atlas import ROW
from ..core.billboard_follow import State, can_follow, follow, start
from ..core.follow_shots import MAPS, Shot
from ..core.snapshot import SceneSnapshot
from ..core.surface_asset import SurfaceMesh, meshes_of
from .capture import BLOCK, CAPTURE, AtlasBlock, Capture, CaptureTarget, SurfaceBuffer
from .counts import Counts
from .map_capture import CORNERS, TEXELS, MapTables, MapTexels
from .program import program
from .state import drawing_state
from .texture_cache import TextureCache
from .upload import read_texture, texture_from


@dataclass(frozen=True)
class Followed:
    """What one look at the scene did to all assets."""

    remade: int = 0  # stand-ins captured
    moved: int = 0  # stand-ins that stand elsewhere than where they were captured
    stale: tuple[str, ...] = ()  # instances whose stand-ins are old: no surface radiance, or other triangles


class Followers:
    """The followers of a renderer's assets."""

    def __init__(self, counts: Counts, textures: TextureCache):
        self.counts, self.textures = counts, textures
        self._states: dict[int, tuple[Asset, State]] = {}  # by id of the asset as it was baked, which is kept
        self._shown: dict[int, np.ndarray] = {}  # the table that is on the GPU
        self._surfaces: tuple[Asset | None, dict[str, SurfaceMesh]] = (None, {})
        self._buffers: dict[str, tuple[SurfaceMesh, SurfaceBuffer]] = {}  # by instance
        self._images: dict[int, _Images] = {}
        self._target: CaptureTarget | None = None
        self._texels: MapTexels | None = None
        self._capture = Capture(counts)

    def update(self, scene: SceneSnapshot, assets: Iterable[Asset], surfaces: Asset | None) -> Followed:
        """Bring every asset that can follow to the scene as it is. surfaces: an asset of core/surface_asset.py or None.

        Not inside another drawing_state. ReflectError when the surfaces' tables are damaged."""
        used = {id(asset): asset for asset in assets if can_follow(asset)}
        for kept in (self._states, self._shown, self._images):
            for key in kept.keys() - used.keys():
                del kept[key]
        remade = moved = 0
        stale: set[str] = set()
        for key, asset in used.items():
            if key not in self._states:
                self._states[key], self._shown[key] = (asset, start(asset, scene)), asset.images["billboard_buf"]
            usable = surfaces is not None and surfaces.light_hash == asset.light_hash
            step = follow(self._states[key][1], scene, self._meshes(surfaces) if usable else {})
            self._states[key] = (asset, step.state)
            if step.shots:
                self._draw(asset, step.shots)
            if not np.array_equal(step.table, self._shown[key]):
                array = asset.images["billboard_buf"]
                self.textures.replace(array, texture_from("billboard_buf", step.table, self.counts))
                self._shown[key] = step.table
            remade, moved = remade + len(step.shots), moved + step.moved
            stale |= step.state.stale
        return Followed(remade, moved, tuple(sorted(stale)))

    def prepare(self, surfaces: Asset | None):
        """Compile what the first capture will need: while something moves there is no time for it."""
        if surfaces is None:
            return
        for asset, state in self._states.values():
            self._of(asset).compile({int(state.asset.images["billboard_buf"][p.row, ROW["place"], 2])
                                     for p in asset.parts if p.kind in MAPS})  # fmt: skip

    def asset(self, asset: Asset) -> Asset:
        """The asset as it is on the GPU, read back: its table, its images, its source ('capture' once one was made)."""
        if id(asset) not in self._states:
            return asset
        images = {"billboard_buf": self._shown[id(asset)]}
        for name in _FILLED & asset.images.keys():
            array = asset.images[name]
            images[name] = read_texture(self.textures.texture(name, array), self.counts).astype(array.dtype)
        return replace(self._states[id(asset)][1].asset, images={**asset.images, **images})

    def placed(self, asset: Asset) -> Asset:
        """The asset with its table as it is on the GPU; nothing is read back."""
        table = self._shown.get(id(asset))
        return asset if table is None else replace(asset, images={**asset.images, "billboard_buf": table})

    def bytes(self) -> int:
        """Memory on the GPU besides the assets' own."""
        return sum(held.bytes for held in (self._target, self._texels, *(b for _, b in self._buffers.values())) if held)

    def free(self):
        """Let go of everything on the GPU."""
        self._states, self._shown, self._buffers, self._images, self._target, self._texels = {}, {}, {}, {}, None, None

    def _meshes(self, surfaces: Asset) -> dict[str, SurfaceMesh]:
        if self._surfaces[0] is not surfaces:
            self._surfaces, self._buffers = (surfaces, meshes_of(surfaces)), {}
        return self._surfaces[1]

    def _draw(self, asset: Asset, shots: tuple[Shot, ...]):
        side = [max(shot.placed.width for shot in shots), max(shot.placed.height for shot in shots)]
        target = self._target
        if target is None or target.width < side[0] or target.height < side[1]:
            before = (target.width, target.height) if target else (0, 0)
            self._target = target = CaptureTarget(max(side[0], before[0]), max(side[1], before[1]), self.counts)
        images = self._of(asset)
        maps = max((shot.placed.width for shot in shots if shot.map), default=0)
        if maps and (self._texels is None or self._texels.side < maps):
            self._texels = MapTexels(maps, self.counts)
        with drawing_state():
            for shot in shots:
                things = [(self._buffer(shot), shot.instance.world_from_object)]
                self._capture.draw(things, shot.camera, target, (1.0, 0.0) if shot.map else shot.relief)
                images.fill(shot, target, self._texels)
                self.counts.captures += 1

    def _of(self, asset: Asset) -> "_Images":
        if id(asset) not in self._images:
            self._images[id(asset)] = _Images(asset, self.textures, self.counts)
        return self._images[id(asset)]

    def _buffer(self, shot: Shot) -> SurfaceBuffer:
        name = shot.instance.name
        if name not in self._buffers or self._buffers[name][0].positions is not shot.surface.positions:
            self._buffers[name] = (shot.surface, SurfaceBuffer(shot.surface, self.counts, shot.share))
        return self._buffers[name][1]


# Images of an asset that captures are drawn into.
_FILLED = {"billboard_tx", "normal_tx", "srdm_tx", "srdm_buf", "depth_tx", "mirror_depth_buf"}


class _Images:
    """Where captures go: an asset's images on the GPU."""

    def __init__(self, asset: Asset, textures: TextureCache, counts: Counts):
        found = {name: textures.texture(name, asset.images[name]) for name in sorted(_FILLED & asset.images.keys())}
        self._counts, self._scale = counts, asset.uniforms["billboard_scale"]
        self._colors = AtlasBlock(found["billboard_tx"], counts)
        self._normals = AtlasBlock(found["normal_tx"], counts) if "normal_tx" in found else None
        rows = found.get("srdm_tx") or found.get("srdm_buf")
        self._tables = None
        if rows is not None:
            turns, points = int(asset.options["turns"]), int(asset.settings["points"])
            self._tables = MapTables(rows, found.get("depth_tx"), found.get("mirror_depth_buf"), turns, points, counts)

    def compile(self, widths: set[int]):
        """The programs of captures, and of depth maps of these widths."""
        programs = [CAPTURE, BLOCK]
        if self._tables is not None and widths:
            programs += [TEXELS, CORNERS]
            for width in sorted(widths):
                self._tables.builder(width)
        for info in programs:
            program(info, self._counts)

    def fill(self, shot: Shot, target: CaptureTarget, texels: MapTexels | None):
        """Everything that a ray looks up of the stand-in that the shot is of, from what was just captured."""
        source = target
        if shot.map is not None:
            source = texels
            texels.fill(target, shot.map, shot.placed.width)
            self._tables.fill(texels, shot.map, shot.placed.width)
        self._colors.fill(source.color_tx, shot.placed, self._scale)
        if shot.normals is not None:
            self._normals.fill(source.normal_tx, shot.normals)
