"""Lamps drawn into the reflection buffer after the virtual objects of a reflector, whose depth says which lamps are before them.

Two draws of one triangle a lamp: first the lamps' light is added to what was drawn, then lamps are drawn where nothing was. Each
fragment asks its pixel's ray, so a lamp is added once however many parts its reflector has.
"""

import numpy as np

from ..core import spaces, virtual_lamps
from .counts import Counts
from .device import ensure
from .fill import RAYS, stored
from .program import Program, ProgramInfo, program
from .targets import ReflectionTarget
from .upload import texture_from

# Depth behind all that is drawn, and what a lamp's own depth is shortened by, to be met before the surface that it lies in.
BEHIND_ALL, CLEAR = 0.99999, 1.0 - 1e-5


class Lamps:
    """The lamps of one scene; rows: virtual_lamps.lamp_rows."""

    def __init__(self, rows: np.ndarray, counts: Counts):
        self.counts, self.rows, self.bytes, self._programs = counts, rows, 0, {}
        if not len(rows):
            return
        self.texture = texture_from("virtual lamps", rows, counts, "RGBA32F")
        gpu = ensure()
        format = gpu.types.GPUVertFormat()
        format.attr_add(id="corner", comp_type="F32", len=3, fetch_mode="FLOAT")
        corners = np.zeros((len(rows), 3, 3), np.float32)
        corners[..., :2], corners[..., 2] = [(-1, -1), (3, -1), (-1, 3)], np.arange(len(rows))[:, None]
        buffer = gpu.types.GPUVertBuf(format, 3 * len(rows))
        buffer.attr_fill("corner", corners.reshape(-1, 3))
        counts.uploads += 1
        counts.upload_bytes += corners.nbytes
        self._batch = gpu.types.GPUBatch(type="TRIS", buf=buffer)
        self.bytes = corners.nbytes + rows.nbytes

    def draw(self, rays, target: ReflectionTarget, reflector: int, sizes_per_metre: float, bounds, alone: bool = True):
        """As virtual_draw.Drawing.draw, of a reflector by its index. alone: also where nothing was drawn; False: there the fill that
        comes after answers with all its lamps."""
        if not len(self.rows):
            return
        gpu = ensure()
        with target.framebuffer.bind():
            target.framebuffer.viewport_set(0, 0, target.width, target.height)
            gpu.state.face_culling_set("NONE")
            gpu.state.depth_test_set("LESS")
            gpu.state.scissor_set(*bounds)
            gpu.state.scissor_test_set(True)
            for without in (False, True) if alone else (False,):
                # A position is stored with a status of 1, which takes the place of what was there.
                gpu.state.blend_set("NONE" if without else "ALPHA_PREMULT" if target.beside == "position" else "ADDITIVE_PREMULT")
                gpu.state.depth_mask_set(without)
                shader = self._program(target.beside, without)
                shader.bind()
                shader.set("reflector", (reflector, sizes_per_metre))
                for name, texture in zip(RAYS[:2], rays.textures, strict=False):
                    shader.image(name, texture)
                shader.image("lamps_buf", self.texture)
                shader.draw(self._batch)
                self.counts.draws += 1
            gpu.state.blend_set("NONE")
            gpu.state.scissor_test_set(False)
            gpu.state.depth_mask_set(False)
            gpu.state.depth_test_set("NONE")

    def prepare(self, beside: str | None):
        """Compile now."""
        for alone in (False, True) if len(self.rows) else ():
            self._program(beside, alone)

    def _program(self, beside: str | None, alone: bool) -> Program:
        if (beside, alone) not in self._programs:
            outputs, text = stored(beside)
            kinds = (("ELLIPSE", virtual_lamps.ELLIPSE), ("BALL", virtual_lamps.BALL), ("STATUS_HIT", spaces.STATUS_HIT))
            self._programs[beside, alone] = program(
                ProgramInfo(
                    name="reflect_virtual_lamps",
                    vertex="virtual_lamps.vert.glsl",
                    fragment="virtual_lamps.frag.glsl",
                    attributes=(("VEC3", "corner"),),
                    varyings=(("flat", "FLOAT", "v_lamp"),),
                    uniforms=(("VEC2", "reflector"),),
                    samplers=tuple(("FLOAT_2D", name) for name in (*RAYS[:2], "lamps_buf")),
                    outputs=(("VEC4", "radiance_out"), *outputs),
                    generated=(("store_answer", text),),
                    defines=(
                        *((name, f"{value:.1f}") for name, value in kinds),
                        ("BEHIND_ALL", f"{BEHIND_ALL:.6f}"), ("CLEAR", f"{CLEAR:.6f}"),
                        *((("ALONE", "1"),) if alone else ()), *((("DISTANCE", "1"),) if beside == "distance" else ()),
                    ),
                    depth="ANY",
                ),
                self.counts,
            )  # fmt: skip
        return self._programs[beside, alone]
