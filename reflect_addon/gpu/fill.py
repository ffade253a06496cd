"""The reflection buffer: an emitted kernel answers the rays of the ray map, whoever made them.

The same shader fills a frame and answers any bundle of rays (`trace_rays`), so what is compared with NumPy is what is
drawn; a picture's pixels send several rays where they need them. An output that nobody wants is neither computed nor stored.
"""

from collections.abc import Callable

import numpy as np

from ..core import lobe_rays, pixel_rays
from ..core.asset import Asset
from ..core.kernel import emit_glsl, emitted, record_function
from ..core.rays import Answer, Rays
from .asset_inputs import AssetInputs
from .counts import Counts
from .device import ensure, max_texture_side
from .program import ProgramInfo, call_text, program
from .state import drawing_state
from .targets import ReflectionTarget
from .texture_cache import TextureCache
from .timing import Work
from .upload import read_texture, texture_from, triangle_batch

_RAY = {"origin": "origin.xyz", "direction": "direction.xyz", "width": "width", "spread": "direction.w"}
LOBE_RAY = {"origin": "origin.xyz", "direction": "ray_direction", "width": "width", "spread": "spread"}
# What every fill reads of the ray map.
RAYS = ("origin_tx", "direction_tx", "normal_tx")
# Half floats end here; a brighter sun stays a sun instead of becoming infinite.
_STORE_RADIANCE = "  radiance_out = vec4(clamp(hit_radiance, -65504.0, 65504.0), hit_coverage);\n"
# What may be stored beside it (targets.ReflectionTarget): (the kernel's outputs, the shader's, GLSL of one ray, GLSL of
# each ray of several and of their mean: of distances the harmonic one, since the sky is infinitely far).
_BESIDE = {
    None: ((), (), "", ("", "")),
    "position": (
        ("position", "status"), (("VEC4", "position_out"),), "  position_out = vec4(hit_position, hit_status);\n",
        ("  beside += weight * vec4(hit_position, hit_status);\n",
         "  position_out = vec4(beside.xyz / total, floor(beside.w / total + 0.5));\n"),
    ),
    "distance": (
        ("position",), (("FLOAT", "distance_out"),), "  distance_out = distance(origin.xyz, hit_position);\n",
        ("  beside.x += weight / max(distance(origin.xyz, hit_position), 1e-20);\n", "  distance_out = total / max(beside.x, 1e-20);\n"),
    ),
}  # fmt: skip


def stored(beside: str | None) -> tuple[tuple[tuple[str, str], ...], str]:
    """(a program's further outputs, GLSL that stores `origin` and `hit_...`) for a reflection buffer of this kind."""
    _, outputs, text, _ = _BESIDE[beside]
    return outputs, _STORE_RADIANCE + text


class Fill:
    """One asset's kernel, compiled for radiance and what is stored beside it, with its textures and uniform block.

    pixels: the rays are a picture's, whose pixels may send several (core/pixel_rays.py, core/lobe_rays.py); it then reads the
    materials. Else each ray is answered as it is."""

    def __init__(self, asset: Asset, trace: Callable, beside: str | None, textures: TextureCache, pixels: bool = False):
        more, outputs, store, _ = _BESIDE[beside]
        wanted = ("radiance", "coverage", *more)
        self.counts = textures.counts
        kernel = emitted(trace, asset, wanted)
        self.source = kernel.source
        self._inputs, self._pixels = AssetInputs(kernel, asset, textures), pixels
        self._inputs.upload()
        self._rays = RAYS + (("material_tx", "materials_tx") if pixels else ())
        samplers = [("FLOAT_2D", name) for name in (*self._rays, *self._inputs.samplers)]
        calls = _pixel_calls(kernel, beside) if pixels else (("call", call_text(kernel, _RAY, "hit_") + _STORE_RADIANCE + store),)
        self.program = program(
            ProgramInfo(
                name=f"reflect_fill_{asset.kind}",
                vertex="fullscreen.vert.glsl",
                fragment="fill_pixel.frag.glsl" if pixels else "fill.frag.glsl",
                attributes=(("FLOAT", "unused"),),
                uniforms=(("VEC2", "reflectors"), *((("VEC4", "bounds"), ("VEC2", "most_rays")) if pixels else ())),
                blocks=self._inputs.blocks,
                samplers=tuple(samplers),
                outputs=(("VEC4", "radiance_out"), *outputs),
                generated=(("kernel", kernel.source), *calls),
                defines=(("PIXEL_FINE", f"{pixel_rays.FINE:.6f}"),) if pixels else (),
            ),
            self.counts,
        )

    def draw(self, gpu, batch, ray_textures, target: ReflectionTarget, first: int, last: int, bounds=None, most_rays: tuple[int, int] = (1, 1)):
        """Answer the rays of reflectors first..last inside bounds (x, y, width, height; None: everywhere), where the target has
        depth only those for which nothing was drawn.

        ray_textures: RAYS, and for pixels the ray map's materials and the table of materials; most_rays: of a rough
        one's lobe, and along the line that a curved one stretches."""
        with target.framebuffer.bind():
            target.framebuffer.viewport_set(0, 0, target.width, target.height)
            gpu.state.blend_set("NONE")
            gpu.state.depth_test_set("LESS_EQUAL" if target.depth_tx else "NONE")
            if bounds is not None:
                gpu.state.scissor_set(*bounds)
                gpu.state.scissor_test_set(True)
            shader = self.program
            shader.bind()
            shader.set("reflectors", (first, last))
            if self._pixels:
                x, y, width, height = bounds or (0, 0, target.width, target.height)
                shader.set("bounds", (x, y, x + width, y + height))
                shader.set("most_rays", most_rays)
            for name, texture in zip(self._rays, ray_textures, strict=True):
                shader.image(name, texture)
            self._inputs.bind(shader)
            shader.draw(batch)
            gpu.state.scissor_test_set(False)
            gpu.state.depth_test_set("NONE")
        self.counts.passes += 1


def lobe_parts() -> tuple[tuple[str, str], tuple[str, str]]:
    """Sources that shaders include: the rays of a lobe, and the call for one of them, around `ray_direction`."""
    rays = emit_glsl(record_function(lobe_rays.count, lobe_rays.COUNT_INPUTS), ("rays",), "rays_of_lobe")
    one = emit_glsl(record_function(lobe_rays.direction, lobe_rays.DIRECTION_INPUTS), ("direction", "weight"), "ray_of_lobe")
    arguments = {
        "mirrored": "ray_direction", "normal": "normal.xyz", "alpha": f"added * {lobe_rays.ALPHA}", "turn": "turn", "share": "share",
    }  # fmt: skip
    table = ", ".join(f"vec2({c:.7f}, {s:.7f})" for c, s in lobe_rays.turns())
    return (
        ("lobe", f"{rays.source}{one.source}const vec2 lobe_turns[{lobe_rays.MOST}] = vec2[{lobe_rays.MOST}]({table});\n"),
        ("lobe_call", call_text(one, arguments, "lobe_") + "  ray_direction = lobe_direction;\n  weight = lobe_weight;\n"),
    )


def _pixel_calls(kernel, beside: str | None):
    """What fill_pixel.frag.glsl includes."""
    each, mean = _BESIDE[beside][-1]
    wanted = ("rays", "line", "width", "spread")
    pixel = emit_glsl(record_function(pixel_rays.rays, pixel_rays.INPUTS), wanted, "rays_of_pixel")
    arguments = {"along_x": "turned_x", "along_y": "turned_y", "width": "normal.w", "spread": "own_spread", "most": "most_rays.y"}
    return (
        *lobe_parts(), ("pixel", pixel.source), ("pixel_call", call_text(pixel, arguments, "pixel_")),
        ("call", call_text(kernel, {**LOBE_RAY, "origin": "ray_origin"}, "hit_")), ("add_beside", each), ("store_beside", mean),
    )  # fmt: skip


class RayBundle:
    """Any rays, uploaded once, to be answered by kernels through the fill shader. width, spread: (N,) or numbers.

    Radiance is kept in float32 unless `half` asks for the viewport's RGBA16F, whose rounding alone is 5e-4.
    """

    def __init__(self, rays: Rays, width=0.0, spread=0.0, counts: Counts | None = None, half: bool = False):
        self.counts, self.count = counts or Counts(), len(rays)
        self._gpu = ensure()
        side = min(1024, max_texture_side())
        rows = max(-(-self.count // side), 1)

        def image(vectors, last):
            out = np.zeros((rows * side, 4), np.float32)
            out[:, 3] = last if np.ndim(last) == 0 else 0
            out[: self.count, :3] = vectors
            out[: self.count, 3] = last
            return out.reshape(rows, side, 4)

        # The pixels after the last ray belong to reflector 0 too; their rays are null and their answers are dropped.
        self._textures = [
            texture_from(name, pixels, self.counts, "RGBA32F")
            for name, pixels in (
                ("rays origin", image(rays.origin, 0.0)),
                ("rays direction", image(rays.direction, spread)),
                ("rays normal", image(np.zeros((self.count, 3)), width)),
            )
        ]
        self._target = ReflectionTarget(side, rows, "position", self.counts, "RGBA16F" if half else "RGBA32F")
        self._batch = triangle_batch()

    def answer(self, asset: Asset, kernel: Callable) -> Answer:
        """The kernel's answer; fields are (N, ...)."""
        with drawing_state():
            self._target.clear()
            self._fill(asset, kernel).draw(self._gpu, self._batch, self._textures, self._target, 0, 0)
            radiance = self._read(self._target.radiance_tx)
            position = self._read(self._target.position_tx)
        return Answer(radiance[:, :3].copy(), radiance[:, 3].copy(), position[:, :3].copy(), position[:, 3].copy())

    def work(self, asset: Asset, kernel: Callable) -> Work:
        """One pass over all rays, for timing.py: the search itself, without ray map and resolve."""
        fill = self._fill(asset, kernel)

        def submit():
            with drawing_state():
                fill.draw(self._gpu, self._batch, self._textures, self._target, 0, 0)

        def finish():
            with self._target.framebuffer.bind():
                self._target.framebuffer.read_color(0, 0, 1, 1, 4, 0, "FLOAT")

        return Work(submit, finish)

    def _fill(self, asset: Asset, kernel: Callable) -> Fill:
        return Fill(asset, kernel, "position", TextureCache(self.counts))

    def _read(self, texture) -> np.ndarray:
        return read_texture(texture, self.counts).reshape(-1, 4)[: self.count]


def trace_rays(
    asset: Asset, kernel: Callable, rays: Rays, width, spread, counts: Counts | None = None, half: bool = False
) -> Answer:
    """The kernel's answer to any rays, through the fill shader; see RayBundle."""
    return RayBundle(rays, width, spread, counts, half).answer(asset, kernel)
