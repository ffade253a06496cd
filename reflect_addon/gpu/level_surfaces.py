"""What mirrored views show: the scene's surfaces with what they send out, and the sky behind them; and its lamps."""

import numpy as np

from ..core.asset import Asset
from ..core.camera import Camera
from ..core.coarse_surface import Coarse, chosen, coarser
from ..core.snapshot import SceneSnapshot, corners_of
from ..core.surface_asset import SurfaceMesh, meshes_of
from ..core.view_cull import may_be_seen
from ..core.virtual_lamps import lamp_rows
from .counts import Counts
from .device import ensure
from .level_programs import SURFACE, Sky
from .program import program
from .targets import LevelTarget
from .texture_cache import TextureCache
from .view import View
from .virtual_lamps import Lamps


class SurfaceBatch:
    """One instance's surface on the GPU, and coarser ones for views from afar: three corners a triangle."""

    def __init__(self, mesh: SurfaceMesh, counts: Counts, coarse: tuple[Coarse, ...] = ()):
        self.mesh, self.cells, self.bytes = mesh, [one.cell for one in coarse], 0
        self._batches = [self._batch(one, counts) for one in (mesh, *coarse)]
        self.triangles = [len(one.triangles) for one in (mesh, *coarse)]

    def _batch(self, mesh: SurfaceMesh | Coarse, counts: Counts):
        gpu, corners = ensure(), mesh.triangles.ravel()
        format = gpu.types.GPUVertFormat()
        for name in ("position", "radiance"):
            format.attr_add(id=name, comp_type="F32", len=3, fetch_mode="FLOAT")
        buffer = gpu.types.GPUVertBuf(format, len(corners))
        buffer.attr_fill("position", np.ascontiguousarray(mesh.positions[corners], np.float32))
        buffer.attr_fill("radiance", np.ascontiguousarray(mesh.radiance[corners], np.float32))
        counts.uploads += 1
        counts.upload_bytes += 24 * len(corners)
        self.bytes += 24 * len(corners)
        return gpu.types.GPUBatch(type="TRIS", buf=buffer)

    def shown(self, world_from_object: np.ndarray, pixel: float):
        """(batch, triangles) where a pixel is so many m at the nearest place; 0: the mesh itself."""
        scale = float(np.linalg.norm(np.asarray(world_from_object)[:3, :3], 2))
        index = 1 + chosen(self.cells, scale, pixel) if self.cells else 0
        return self._batches[index], self.triangles[index]


class LevelSurfaces:
    """Of one snapshot; what only moved is uploaded once."""

    def __init__(self, counts: Counts, textures: TextureCache, batch):
        self._textures, self._batch = textures, batch
        self._sky: tuple[np.ndarray, Sky] | None = None
        self.counts, self.lamps = counts, Lamps(np.zeros((0, 0, 4), np.float32), counts)
        self._baked: tuple[Asset | None, dict[str, SurfaceMesh]] = (None, {})
        self._batches: dict[str, SurfaceBatch] = {}  # by instance
        self._things: list[tuple[str, SurfaceBatch, np.ndarray, np.ndarray]] = []  # instance, ..., world_from_object, corners of its box

    def update(self, scene: SceneSnapshot, surfaces: Asset | None, sky: Asset | None, deep: bool = False):
        """Take another snapshot; surfaces: the scene's surface radiance, sky: an asset of `environment`; None: nothing is drawn; deep: whether views
        of views may be drawn, which show coarser meshes.
        ReflectError where it is damaged."""
        if sky is None:
            self._sky = None
        elif self._sky is None or self._sky[0] is not sky.images["radiance_tx"]:
            self._sky = (sky.images["radiance_tx"], Sky(sky, self._textures, self.counts))
        if self._baked[0] is not surfaces:
            self._baked, self._batches = (surfaces, meshes_of(surfaces) if surfaces is not None else {}), {}
        lamps, kept = {lamp.name for lamp in scene.lamps}, {}
        self._things = []
        for name, baked in self._baked[1].items():
            instance = scene.named().get(name)
            if instance is None or name in lamps or not instance.visible_glossy:
                continue
            mesh = baked.on(scene.meshes[instance.mesh])
            if mesh is None or not len(mesh.triangles):
                continue
            held = self._batches.get(name)
            if held is None or held.mesh.mesh != mesh.mesh:
                still = held is None and deep and not instance.is_reflector  # what deforms has no coarser meshes: they take longer to make
                held = SurfaceBatch(mesh, self.counts, coarser(mesh) if still else ())
            kept[name] = held
            self._things.append((name, held, instance.world_from_object, corners_of(scene.bounds([instance]))))
        self._batches = kept
        rows = lamp_rows(scene, self._baked[1])
        if not np.array_equal(self.lamps.rows, rows):
            self.lamps = Lamps(rows, self.counts)

    def prepare(self):
        """Compile now."""
        program(SURFACE, self.counts)

    def draw(
        self, view: View, camera: Camera, target: LevelTarget, window, hidden: str = "", near: float = 0.0, cull: bool = True
    ) -> int:
        """Everything but an instance that is `hidden` that window (x, y, width, height) of the camera's picture may show, or all else where
        nothing is culled. view: the camera's; near: m, where meshes may be coarser: how far what is seen is at least. Returns the triangles."""
        gpu, triangles = ensure(), 0
        with target.framebuffer.bind():
            target.framebuffer.viewport_set(0, 0, target.width, target.height)
            gpu.state.scissor_set(*window)
            gpu.state.scissor_test_set(True)
            gpu.state.blend_set("NONE")
            # A camera that mirrors turns what winds counter-clockwise round.
            gpu.state.face_culling_set("BACK" if np.linalg.det(camera.clip_from_camera) < 0 else "FRONT")
            gpu.state.depth_test_set("LESS")
            gpu.state.depth_mask_set(True)
            shader = program(SURFACE, self.counts)
            shader.bind()
            shader.block("view", view.buffer)
            for name, held, world_from_object, corners in self._things:
                if name != hidden and not (cull and not may_be_seen(camera, corners, window)):
                    shader.set("rel_from_object", view.rel_from_object(world_from_object))
                    batch, count = held.shown(world_from_object, _pixel(camera, view, corners, near) if near > 0 else 0.0)
                    shader.draw(batch)
                    triangles += count
                    self.counts.draws += 1
                    self.counts.triangles += count
            gpu.state.face_culling_set("NONE")
            gpu.state.depth_test_set("LESS_EQUAL")
            self._sky[1].draw(self._batch, view, target.width, target.height)
            gpu.state.scissor_test_set(False)
            gpu.state.depth_mask_set(False)
            gpu.state.depth_test_set("NONE")
        return triangles

    def bytes(self) -> int:
        """Memory on the GPU."""
        return self.lamps.bytes + sum(held.bytes for held in self._batches.values())

    def free(self):
        self._baked, self._batches, self._things, self._sky = (None, {}), {}, [], None


def _pixel(camera: Camera, view: View, corners: np.ndarray, near: float) -> float:
    """m of a pixel at the nearest place of a box that may be seen, `near` m away at least."""
    if camera.is_orthographic:
        return view.footprint
    eye = camera.world_from_camera[:3, 3]
    away = np.linalg.norm(np.maximum(np.maximum(corners.min(0) - eye, eye - corners.max(0)), 0.0))
    return view.footprint * max(near, float(away))
