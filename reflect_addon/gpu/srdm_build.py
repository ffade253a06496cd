"""Simplified rotated depth maps built on the device: the tables of core/srdm.py and srdm_greedy.py, bit by bit.

Problem. An object that moves or deforms needs its rows again at frame rate; NumPy takes an eighth of a second or more.
Idea. Rows do not know of each other (popescu-2006 4.2 builds them on the CPU and leaves the GPU open): an invocation each
walks, splits and writes one row. A work group per row would look at every sample in every step, m times the work, and
wait for itself several times a step; a single invocation looks at the split segment only, which keeps m = 64 cheap. A map
has n w = 15,360 rows, enough to fill a graphics card, and neighbours in a group read neighbouring rows of one turn.
Equality. All choices are whole numbers on both sides, and depths are carried, not computed.
Limits. Greedy poly-lines only. A row's segments (8 m bytes) are private to its invocation; its samples are read again
each time.
"""

import numpy as np

from ..core import srdm
from .compute import ComputeInfo
from .counts import Counts
from .device import ensure
from .program import program
from .upload import check_size, plane_from, read_texture, texture_from

# Invocations of a group: a warp, and half of what other cards run at once.
GROUP = 32
# q of background in a texture: what is not a number need not survive a texture on every driver.
BACKGROUND = -1.0


class Builder:
    """Builds tables of one size into textures that stay on the device."""

    def __init__(self, w: int, n: int, m: int, counts: Counts, half: bool = False):
        """Maps of w x w texels, n turns, m points a row; `half`: into RGBA16F textures, rounded by the driver.

        Raises ReflectError for sizes that core/srdm.py does not take.
        """
        srdm.check(w, n, m)
        self.w, self.n, self.m = w, n, m
        self.counts = counts
        self.format = "RGBA16F" if half else "RGBA32F"
        self.size = (n * -(-m // 2), w)  # texels of a table
        turns = np.zeros((1, n, 4))
        turns[0, :, :2] = srdm.turns(n)
        self._turns = texture_from("turns_buf", turns, counts)
        # A power of two, so that a few programs serve all m.
        defines = {"SLOTS": 1 << (max(m - 1, 8) - 1).bit_length()}
        defines |= {"TURN_BITS": srdm.TURN_BITS, "STEPS": srdm.STEPS, "PARTS": srdm.PARTS, "FILL": srdm.FILL}
        self.program = program(
            ComputeInfo(
                name="reflect_srdm",
                compute="srdm.comp.glsl",
                group=(GROUP, 1, 1),
                uniforms=(("VEC4", "map"), ("VEC4", "places")),
                samplers=(("FLOAT_2D", "turns_buf"),),
                images=((self.format, "FLOAT_2D", "table_img", "WRITE"), ("R32F", "FLOAT_2D", "depth_img", "READ")),
                defines=tuple((name, str(value)) for name, value in defines.items()),
            ),
            counts,
        )

    def texture(self):
        """A texture that holds one table; ReflectError when the device has none so large."""
        check_size("simplified depth maps", *self.size)
        texture = ensure().types.GPUTexture(self.size, format=self.format)
        texture.filter_mode(False)
        self.counts.allocations += 1
        return texture

    def build(self, depth_img, table_img, depth_at=(0, 0), table_at=(0, 0)):
        """Fills `size` texels of table_img from `table_at` on as srdm.packed() lays them out; nothing is read back.

        depth_img: an R32F texture of q, negative for background; the map is the w x w texels from `depth_at` on.
        """
        shader = self.program
        shader.bind()
        shader.set("map", (self.w, self.n, self.m, 0))
        shader.set("places", (*depth_at, *table_at))
        shader.store("depth_img", depth_img)
        shader.image("turns_buf", self._turns)
        shader.store("table_img", table_img)
        shader.dispatch(self.w, self.n)
        ensure().shader.unbind()
        self.counts.passes += 1


def upload(depth: np.ndarray, counts: Counts):
    """The texture that Builder.build() reads, from a depth map (w, w) float32 with NaN for background."""
    return plane_from("depth map", np.where(np.isnan(depth), np.float32(BACKGROUND), depth), counts)


def build(depth: np.ndarray, n: int, m: int, counts: Counts | None = None) -> np.ndarray:
    """(n, w, m, 2) float32: the table of a depth map (w, w), equal to the reference's."""
    counts = counts or Counts()
    builder = Builder(len(depth), n, m, counts)
    texture = builder.texture()
    builder.build(upload(depth, counts), texture)
    return srdm.unpacked(read_texture(texture, counts), n, m)
