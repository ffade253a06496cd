"""A depth map made again on the GPU: from its capture to all the images that a ray looks it up in; nothing is read back.

Problem. An object that deforms has another shape, and its map's colours, depths and simplified rows are of the old one.
Idea. The capture (gpu/capture.py) has colour, normal and depth. A pass continues the colours and normals beyond the outline
and turns the depth into q; the compute builder (srdm_build.py) writes the rows, a second pass the depths around corners,
each into the place in the asset's own images where the bake put them, so that the shader that draws stays the same.
Limits. Greedy rows, also where the bake chose optimal ones. Colours are continued for eight texels, no further.
"""

from ..core.follow_shots import MapPlace
from .counts import Counts
from .device import ensure
from .program import ProgramInfo, program
from .srdm_build import BACKGROUND, Builder
from .upload import check_size, triangle_batch

# Levels of eight texels: the look-ups of hits reach two beyond the outline.
CONTINUED = 3

TEXELS = ProgramInfo(
    name="reflect_map_texels",
    vertex="fullscreen.vert.glsl",
    fragment="map_texels.frag.glsl",
    attributes=(("FLOAT", "unused"),),
    uniforms=(("VEC2", "range"),),
    samplers=(("FLOAT_2D", "captured_tx"), ("FLOAT_2D", "relief_tx")),
    outputs=(("VEC4", "color_out"), ("VEC4", "normal_out"), ("FLOAT", "depth_out")),
    defines=(("CONTINUED", str(CONTINUED)), ("BACKGROUND", str(BACKGROUND))),
)
CORNERS = ProgramInfo(
    name="reflect_map_corners",
    vertex="fullscreen.vert.glsl",
    fragment="map_corners.frag.glsl",
    attributes=(("FLOAT", "unused"),),
    uniforms=(("VEC3", "block"),),
    samplers=(("FLOAT_2D", "map_depth_tx"),),
    outputs=(("VEC4", "corners_out"),),
    defines=(("BACKGROUND", str(BACKGROUND)),),
)


class MapTexels:
    """color_tx, normal_tx (RGBA32F) and depth_tx (R32F, q) of maps of up to `side` texels."""

    def __init__(self, side: int, counts: Counts):
        gpu = ensure()
        check_size("depth map", side, side)
        self.side, self.counts = side, counts
        formats = ("RGBA32F", "RGBA32F", "R32F")
        self.color_tx, self.normal_tx, self.depth_tx = (gpu.types.GPUTexture((side, side), format=f) for f in formats)
        for texture in (self.color_tx, self.normal_tx, self.depth_tx):
            texture.filter_mode(False)
        self._framebuffer = gpu.types.GPUFrameBuffer(color_slots=(self.color_tx, self.normal_tx, self.depth_tx))
        self._batch = triangle_batch()
        self.bytes = 36 * side * side
        counts.allocations += 1

    def fill(self, target, where: MapPlace, width: int):
        """From a capture (gpu/capture.py, CaptureTarget) of width x width texels."""
        gpu = ensure()
        with self._framebuffer.bind():
            self._framebuffer.viewport_set(0, 0, width, width)
            gpu.state.blend_set("NONE")
            gpu.state.depth_test_set("NONE")
            shader = program(TEXELS, self.counts)
            shader.bind()
            shader.set("range", (where.camera.hither, where.camera.yon))
            shader.image("captured_tx", target.color_tx)
            shader.image("relief_tx", target.normal_tx)
            shader.draw(self._batch)
        self.counts.passes += 1


class MapTables:
    """The depths and the simplified rows of one asset's maps, in the textures that its kernel reads. depths_tx,
    mirror_depths_tx: of what is only lit and of mirrors; None where there is none."""

    def __init__(self, rows_tx, depths_tx, mirror_depths_tx, turns: int, points: int, counts: Counts):
        self._rows_tx, self._turns, self._points = rows_tx, turns, points
        made = ensure().types.GPUFrameBuffer
        self._depths = {
            mirrors: (texture, made(color_slots=[texture]))
            for mirrors, texture in ((False, depths_tx), (True, mirror_depths_tx))
            if texture is not None
        }
        self._batch = triangle_batch()
        self._builders: dict[int, Builder] = {}
        self.counts = counts

    def builder(self, width: int) -> Builder:
        """The builder of maps of this many texels a side."""
        if width not in self._builders:
            half = self._rows_tx.format == "RGBA16F"
            self._builders[width] = Builder(width, self._turns, self._points, self.counts, half)
        return self._builders[width]

    def fill(self, texels: MapTexels, where: MapPlace, width: int):
        """The tables of the width x width map that `texels` holds."""
        gpu = ensure()
        self.builder(width).build(texels.depth_tx, self._rows_tx, table_at=where.rows)
        depths_tx, framebuffer = self._depths[where.mirrors]
        with framebuffer.bind():
            framebuffer.viewport_set(0, 0, depths_tx.width, depths_tx.height)
            gpu.state.scissor_set(*where.depths, width + 1, width + 1)
            gpu.state.scissor_test_set(True)
            shader = program(CORNERS, self.counts)
            shader.bind()
            shader.set("block", (*where.depths, width))
            shader.image("map_depth_tx", texels.depth_tx)
            shader.draw(self._batch)
            gpu.state.scissor_test_set(False)
        self.counts.passes += 1
