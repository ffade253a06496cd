"""Where cube maps are drawn: a face's own targets, a row of six faces for all mirrors, and a map's image with its coarser levels.

The row is what makes maps double-buffered (core/reflection_passes.py): an image changes at once, when its six faces are there. What it
stores is as core/cubemap.py says, so kernels of baked maps read it.
"""

from ..core import cubemap, spaces
from ..core.kernel import emit_glsl, record_function
from ..core.live_maps import Reach
from .background import BACKGROUND, FULLSCREEN, draw_camera_rays
from .counts import Counts
from .device import ensure
from .fill import stored
from .program import ProgramInfo, call_text, program
from .targets import LevelTarget, RayMapTarget, ReflectionTarget
from .view import VIEW_BLOCK, View
from .virtual_lamps import Lamps

_ACROSS = emit_glsl(record_function(cubemap.across, cubemap.ACROSS_INPUTS), ("face", "s", "t"), "across")
_OUTPUTS, _STORE = stored("distance")
SHOWN = ProgramInfo(
    name="reflect_cube_shown",
    fragment="cube_shown.frag.glsl",
    blocks=(VIEW_BLOCK,),
    uniforms=(("FLOAT", "sizes_per_metre"),),
    samplers=tuple(("FLOAT_2D", name) for name in ("picture_tx", "place_tx", "seen_depth_tx", "beyond_tx")),
    outputs=(("VEC4", "radiance_out"), *_OUTPUTS),
    generated=(("store_answer", _STORE),),
    depth="ANY",
    **FULLSCREEN,
)
ROW = ProgramInfo(
    name="reflect_cube_row",
    fragment="cube_row.frag.glsl",
    uniforms=(("VEC2", "corner"), ("FLOAT", "scale")),
    samplers=(("FLOAT_2D", "radiance_tx"), ("FLOAT_2D", "distance_tx")),
    outputs=(("VEC4", "texel_out"),),
    defines=(("FAR", f"{spaces.FAR:.1f}"),),
    **FULLSCREEN,
)
PYRAMID = ProgramInfo(
    name="reflect_cube_pyramid",
    fragment="cube_pyramid.frag.glsl",
    uniforms=(("VEC4", "place"),),
    samplers=(("FLOAT_2D", "row_tx"),),
    outputs=(("VEC4", "texel_out"),),
    generated=(
        ("across", _ACROSS.source),
        ("across_call", call_text(_ACROSS, {"face": "face", "s": "s.x", "t": "s.y"}, "seen_")),
    ),
    **FULLSCREEN,
)


def prepare_programs(counts: Counts):
    """Compile now."""
    for info in (SHOWN, ROW, PYRAMID):
        program(info, counts)


class CubeTargets:
    """For maps of one size. side: texels along a face's edge."""

    def __init__(self, side: int, counts: Counts):
        gpu, whole = ensure(), side + 2
        self.side, self.counts, self.size = side, counts, (whole, whole)
        self.picture = LevelTarget(whole, whole, counts)
        self.rays = RayMapTarget(whole, whole, counts)
        self.answers = ReflectionTarget(whole, whole, "distance", counts, depth=True)
        self._lit = ReflectionTarget(whole, whole, "distance", counts, depth=True)
        self._row_tx = gpu.types.GPUTexture((6 * whole, whole), format="RGBA16F")
        self._row_tx.filter_mode(False)
        self._row = gpu.types.GPUFrameBuffer(color_slots=[self._row_tx])
        counts.allocations += 1

    @property
    def bytes(self) -> int:
        return self.picture.bytes + self.rays.bytes + self.answers.bytes + self._lit.bytes + 6 * self.size[0] ** 2 * 8

    def new_image(self):
        """A map's image: RGBA16F, as TextureCache makes those of baked maps."""
        height, width = cubemap.image_size(self.side)
        image = ensure().types.GPUTexture((width, height), format="RGBA16F")
        image.filter_mode(False)
        image.extend_mode("EXTEND")
        image.clear(format="FLOAT", value=(0.0, 0.0, 0.0, 0.0))
        self.counts.allocations += 1
        return image

    def take(self, face: int, view: View, reach: Reach, lamps: Lamps, sizes_per_metre: float, batch):
        """The picture, with lamps, as a face of the row. view: the face's camera's."""
        gpu, target, whole = ensure(), self._lit, self.size[0]
        with target.framebuffer.bind():
            target.framebuffer.clear(depth=1.0)
            self._start(target.framebuffer, (0, 0, *self.size))
            gpu.state.depth_test_set("ALWAYS")
            gpu.state.depth_mask_set(True)
            shader = program(SHOWN, self.counts)
            shader.bind()
            shader.block("view", view.buffer)
            shader.set("sizes_per_metre", sizes_per_metre)
            shader.image("picture_tx", self.picture.color_tx)
            shader.image("place_tx", self.picture.place_tx)
            shader.image("seen_depth_tx", self.answers.depth_tx)
            shader.image("beyond_tx", self.answers.distance_tx)
            shader.draw(batch)
            gpu.state.depth_mask_set(False)
            gpu.state.depth_test_set("NONE")
        if len(lamps.rows):
            with self.rays.framebuffer.bind():
                self._start(self.rays.framebuffer, (0, 0, *self.size))
                draw_camera_rays(gpu, batch, view, self.rays, self.counts)
            lamps.draw(self.rays, target, BACKGROUND, sizes_per_metre, (0, 0, *self.size))
        with self._row.bind():
            self._start(self._row, (face * whole, 0, *self.size))
            shader = program(ROW, self.counts)
            shader.bind()
            shader.set("corner", (face * whole, 0.0))
            shader.set("scale", reach.scale)
            shader.image("radiance_tx", target.radiance_tx)
            shader.image("distance_tx", target.distance_tx)
            shader.draw(batch)
        self.counts.passes += 2

    def complete(self, image, batch):
        """The row, whose six faces are there, as a map's image."""
        gpu = ensure()
        framebuffer = gpu.types.GPUFrameBuffer(color_slots=[image])
        with framebuffer.bind():
            shader = program(PYRAMID, self.counts)
            shader.bind()
            shader.image("row_tx", self._row_tx)
            for level in range(cubemap.level_count(self.side)):
                (x, y), side = cubemap.level_origin(self.side, level), self.side >> level
                self._start(framebuffer, (x, y, 6 * (side + 2), side + 2))
                shader.set("place", (x, y, side, self.side))
                shader.draw(batch)
                self.counts.passes += 1

    @staticmethod
    def _start(framebuffer, window):
        """A full-screen pass over window (x, y, width, height)."""
        state = ensure().state
        framebuffer.viewport_set(*window)
        state.blend_set("NONE")
        state.face_culling_set("NONE")
        state.depth_test_set("NONE")
