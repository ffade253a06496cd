"""What mirrors show that are seen in a reflector, added where virtual objects were drawn [estalella-2005 section 8 leaves it open].

Several virtual triangles may be drawn in a pixel before the nearest is, and a look into distance maps takes many times as long as a
triangle does. So the drawing leaves the hit behind (`mirror_tx`: xyz the normal times the distance, m; w: 0 or 1 + the instance's row + half the
share that mirrors), and one pass answers what is left, once a pixel, by the kernel of core/virtual_shade.py.
"""

from dataclasses import dataclass

import numpy as np

from ..core import mirrors, virtual_shade
from ..core.asset import Asset
from ..core.kernel import GlslKernel, emit_glsl, record_function
from ..core.methods import layered_distance
from ..core.shading import material_rows
from ..core.snapshot import SceneSnapshot
from .asset_inputs import AssetInputs
from .counts import Counts
from .device import ensure
from .fill import RAYS
from .program import ProgramInfo, call_text, program
from .targets import ReflectionTarget
from .upload import texture_from

MATERIAL = {
    "base": "texelFetch(mirrors_buf, ivec2(0, row), 0)", "tint": "texelFetch(mirrors_buf, ivec2(1, row), 0)",
    "lobe": "texelFetch(mirrors_buf, ivec2(2, row), 0).xy", "share": "share", "direction": "direction.xyz", "normal": "normal",
}  # fmt: skip
_SHOWN = {"origin": "hit_position", "width": "width", "spread": "direction.w", **MATERIAL}


class Mirrors:
    """The materials of the scene's instances that are mirrors to others, a row each; `any`: whether there is one."""

    def __init__(self, scene: SceneSnapshot, names: tuple[str, ...], counts: Counts):
        named = scene.named()
        found = [mirrors.mirror_of(scene, named[name]) if name in named else None for name in names]
        self.any = any(found)
        self.options = {
            "has_metal": any(m.material.metallic > 0 for m in found if m), "has_dielectric": any(m.material.metallic < 1 for m in found if m),
        }  # fmt: skip
        rows = np.zeros((max(len(names), 1), 3, 4), np.float32)
        for row, mirror in zip(rows, found, strict=False):
            if mirror:
                row[:] = material_rows(mirror.material)
        self.texture = texture_from("virtual mirrors", rows, counts, "RGBA32F") if self.any else None

    def kept(self) -> GlslKernel:
        """What a mirror leaves of the light of the surface below it."""
        recorded = record_function(virtual_shade.kept, virtual_shade.KEPT_INPUTS, options=self.options, name="kept_below")
        return emit_glsl(recorded, ("kept",), "kept_below", push_bytes=0)


@dataclass(frozen=True)
class Hits:
    """Where virtual objects are drawn with their hits beside, for one reflection buffer."""

    width: int  # px
    height: int  # px
    mirror_tx: object
    framebuffer: object  # the target's, with mirror_tx
    light: object  # its radiance alone, behind its depth

    @property
    def bytes(self) -> int:
        return 16 * self.width * self.height


def hits_of(target: ReflectionTarget, counts: Counts) -> Hits:
    """Made for a target with depth."""
    gpu = ensure()
    mirror = gpu.types.GPUTexture((target.width, target.height), format="RGBA32F")
    mirror.filter_mode(False)
    beside = [texture for texture in (target.position_tx, target.distance_tx) if texture is not None]
    counts.allocations += 1
    return Hits(
        target.width, target.height, mirror,
        gpu.types.GPUFrameBuffer(depth_slot=target.depth_tx, color_slots=[target.radiance_tx, *beside, mirror]),
        gpu.types.GPUFrameBuffer(depth_slot=target.depth_tx, color_slots=[target.radiance_tx]),
    )  # fmt: skip


class Second:
    """One asset's pass."""

    def __init__(self, asset: Asset, shiny: Mirrors, textures, counts: Counts):
        self.counts, self._mirrors = counts, shiny
        kernel = _arriving(asset, shiny)
        self._inputs = AssetInputs(kernel, asset, textures)
        self._inputs.upload()
        self.program = program(
            ProgramInfo(
                name="reflect_virtual_second",
                vertex="fullscreen.vert.glsl",
                fragment="virtual_second.frag.glsl",
                attributes=(("FLOAT", "unused"),),
                uniforms=(("VEC2", "reflectors"),),
                blocks=self._inputs.blocks,
                samplers=tuple(("FLOAT_2D", name) for name in (*RAYS, "mirror_tx", "mirrors_buf", *self._inputs.samplers)),
                outputs=(("VEC4", "radiance_out"),),
                generated=(("kernel", kernel.source), ("shown", call_text(kernel, _SHOWN, "shown_"))),
            ),
            counts,
        )  # fmt: skip

    def draw(self, batch, rays, hits: Hits, first: int, last: int, bounds):
        """Adds the light of reflectors first..last inside bounds, where something was drawn."""
        gpu = ensure()
        with hits.light.bind():
            hits.light.viewport_set(0, 0, hits.width, hits.height)
            gpu.state.blend_set("ADDITIVE_PREMULT")
            gpu.state.face_culling_set("NONE")
            gpu.state.depth_mask_set(False)
            gpu.state.depth_test_set("GREATER")
            gpu.state.scissor_set(*bounds)
            gpu.state.scissor_test_set(True)
            shader = self.program
            shader.bind()
            shader.set("reflectors", (first, last))
            images = {"mirror_tx": hits.mirror_tx, "mirrors_buf": self._mirrors.texture}
            for name, texture in (dict(zip(RAYS, rays.textures, strict=False)) | images).items():
                shader.image(name, texture)
            self._inputs.bind(shader)
            shader.draw(batch)
            gpu.state.blend_set("NONE")
            gpu.state.scissor_test_set(False)
            gpu.state.depth_test_set("NONE")
        self.counts.passes += 1


def _arriving(asset: Asset, shiny: Mirrors) -> GlslKernel:
    kernel = virtual_shade.arriving(layered_distance.trace)
    program = record_function(kernel, virtual_shade.INPUTS, asset.images, asset.uniforms, {**asset.options, **shiny.options}, "shown_in_mirror")
    return emit_glsl(program, ("radiance",), "shown_in_mirror", push_bytes=0)
