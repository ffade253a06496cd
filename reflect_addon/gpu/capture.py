"""Surfaces with known radiance, drawn from any camera: the fast one of the two captures (design, "Capture has two
speeds").

A billboard, a depth map, a cube face or a mirrored view is this picture from another camera: colour, world normal, depth
along the camera's axis. What is drawn are core/surface_asset.py's meshes, which wind counter-clockwise as they are seen.
`AtlasBlock` then turns a picture into a billboard's block of an atlas: levels and borders, on the GPU too.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from ..core.billboard_atlas import Placed
from ..core.camera import Camera
from ..core.surface_asset import SurfaceMesh
from .counts import Counts
from .device import ensure
from .program import ProgramInfo, program
from .upload import check_size, read_texture, triangle_batch
from .view import VIEW_BLOCK, View

CAPTURE = ProgramInfo(
    name="reflect_capture",
    vertex="capture.vert.glsl",
    fragment="capture.frag.glsl",
    attributes=(("VEC3", "position"), ("VEC3", "normal"), ("VEC3", "radiance"), ("FLOAT", "share")),
    varyings=(
        ("smooth", "VEC3", "v_normal"), ("smooth", "VEC3", "v_radiance"), ("smooth", "FLOAT", "v_depth"),
        ("smooth", "FLOAT", "v_share"),
    ),
    blocks=(VIEW_BLOCK,),
    uniforms=(("MAT4", "rel_from_object"), ("VEC2", "relief")),
    outputs=(("VEC4", "color_out"), ("VEC4", "normal_out")),
)
BLOCK = ProgramInfo(
    name="reflect_atlas_block",
    vertex="fullscreen.vert.glsl",
    fragment="atlas_block.frag.glsl",
    attributes=(("FLOAT", "unused"),),
    uniforms=(("VEC4", "block"), ("VEC2", "more")),
    samplers=(("FLOAT_2D", "captured_tx"),),
    outputs=(("VEC4", "texel_out"),),
)


class SurfaceBuffer:
    """One instance's surface on the GPU: three corners a triangle."""

    def __init__(self, mesh: SurfaceMesh, counts: Counts, share: np.ndarray | None = None):
        """share: (V,) which vertices mirror, by which normals are multiplied; None: all."""
        gpu = ensure()
        corners = mesh.triangles.ravel()
        self.bytes = mesh.bytes()
        self.batch = None
        if len(corners):
            format = gpu.types.GPUVertFormat()
            share = np.ones(len(mesh.positions)) if share is None else share
            found = {"position": mesh.positions, "normal": mesh.normals, "radiance": mesh.radiance, "share": share[:, None]}
            for name, values in found.items():
                format.attr_add(id=name, comp_type="F32", len=values.shape[1], fetch_mode="FLOAT")
            buffer = gpu.types.GPUVertBuf(format, len(corners))
            for name, values in found.items():
                buffer.attr_fill(name, np.ascontiguousarray(values[corners], np.float32))
            self.batch = gpu.types.GPUBatch(type="TRIS", buf=buffer)
            counts.uploads += 1
            counts.upload_bytes += self.bytes


@dataclass(frozen=True)
class Captured:
    """A capture read back; row 0 at the bottom, zeros where nothing is seen."""

    color: np.ndarray  # (H, W, 4) float32, premultiplied radiance, alpha
    normal: np.ndarray  # (H, W, 3) float32, world, unit, towards the seen side
    depth: np.ndarray  # (H, W) float32, m along the camera's axis


class CaptureTarget:
    """color_tx (RGBA32F) and normal_tx (RGBA32F, w = depth), for captures of up to this size."""

    def __init__(self, width: int, height: int, counts: Counts):
        gpu = ensure()
        check_size("capture", width, height)
        self.width, self.height = width, height
        self.color_tx, self.normal_tx = (gpu.types.GPUTexture((width, height), format="RGBA32F") for _ in range(2))
        self._depth_tx = gpu.types.GPUTexture((width, height), format="DEPTH_COMPONENT32F")
        for texture in (self.color_tx, self.normal_tx):
            texture.filter_mode(False)
        self.framebuffer = gpu.types.GPUFrameBuffer(
            depth_slot=self._depth_tx, color_slots=(self.color_tx, self.normal_tx)
        )
        self.bytes = width * height * 36
        counts.allocations += 1

    def read(self, camera: Camera, counts: Counts) -> Captured:
        """The part that the camera's picture takes."""
        part = np.s_[: camera.height, : camera.width]
        color, normal = (read_texture(t, counts)[part] for t in (self.color_tx, self.normal_tx))
        return Captured(color.copy(), normal[..., :3].copy(), normal[..., 3].copy())


class Capture:
    """Draws surfaces into a CaptureTarget. To be used inside state.drawing_state."""

    def __init__(self, counts: Counts):
        self.counts = counts
        self._view = View()

    def draw(
        self, things: Iterable[tuple[SurfaceBuffer, np.ndarray]], camera: Camera, target: CaptureTarget, relief=(1.0, 0.0)
    ):
        """things: surfaces with their world_from_object (4, 4). The picture fills the target's lower left camera.width x
        camera.height texels; what else is in the target is lost. normal_tx's w is relief[0] * depth + relief[1]."""
        gpu = ensure()
        if camera.width > target.width or camera.height > target.height:
            raise ValueError(f"a capture of {camera.width} x {camera.height} in a target of {target.width} x {target.height}")
        self._view.set(camera)
        with target.framebuffer.bind():
            for texture in (target.color_tx, target.normal_tx):
                texture.clear(format="FLOAT", value=(0.0, 0.0, 0.0, 0.0))
            target.framebuffer.clear(depth=1.0)
            target.framebuffer.viewport_set(0, 0, camera.width, camera.height)
            gpu.state.blend_set("NONE")
            gpu.state.face_culling_set("BACK")
            gpu.state.depth_test_set("LESS")
            gpu.state.depth_mask_set(True)
            shader = program(CAPTURE, self.counts)
            shader.bind()
            shader.block("view", self._view.buffer)
            for surface, world_from_object in things:
                if surface.batch is not None:
                    shader.set("rel_from_object", self._view.rel_from_object(world_from_object))
                    shader.set("relief", relief)
                    shader.draw(surface.batch)
                    self.counts.draws += 1
            gpu.state.face_culling_set("NONE")
            gpu.state.depth_mask_set(False)
            gpu.state.depth_test_set("NONE")


class AtlasBlock:
    """Fills blocks of one atlas texture from captures."""

    def __init__(self, atlas_tx, counts: Counts):
        self._framebuffer = ensure().types.GPUFrameBuffer(color_slots=[atlas_tx])
        self._size = atlas_tx.width, atlas_tx.height
        self._batch = triangle_batch()
        self.counts = counts

    def fill(self, captured_tx, placed: Placed, scale: float = 1.0):
        """The block of a stand-in whose level 0 is the lower left placed.width x placed.height texels of captured_tx; radiance
        is stored divided by scale."""
        gpu = ensure()
        with self._framebuffer.bind():
            self._framebuffer.viewport_set(0, 0, *self._size)
            gpu.state.blend_set("NONE")
            gpu.state.depth_test_set("NONE")
            gpu.state.scissor_set(placed.x - 1, placed.y - 1, *placed.block())
            gpu.state.scissor_test_set(True)
            shader = program(BLOCK, self.counts)
            shader.bind()
            shader.set("block", (placed.x - 1, placed.y - 1, placed.width, placed.height))
            shader.set("more", (placed.levels, 1 / scale))
            shader.image("captured_tx", captured_tx)
            shader.draw(self._batch)
            gpu.state.scissor_test_set(False)
        self.counts.passes += 1
