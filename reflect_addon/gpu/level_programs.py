"""The programs of mirrored views (levels.py): surfaces that carry their light, the sky behind them, what reflectors among them add, and a
view's picture as its mirror's answer."""

from ..core import spaces
from ..core.asset import Asset
from ..core.kernel import emit_glsl, record
from ..core.methods import environment
from .asset_inputs import AssetInputs
from .background import FULLSCREEN
from .counts import Counts
from .device import ensure
from .fill import RAYS, stored
from .program import ProgramInfo, call_text, program
from .texture_cache import TextureCache
from .view import VIEW_BLOCK, View

SURFACE = ProgramInfo(
    name="reflect_level_surface",
    vertex="level_surface.vert.glsl",
    fragment="level_surface.frag.glsl",
    attributes=(("VEC3", "position"), ("VEC3", "radiance")),
    varyings=(("smooth", "VEC3", "v_rel_P"), ("smooth", "VEC3", "v_radiance")),
    blocks=(VIEW_BLOCK,),
    uniforms=(("MAT4", "rel_from_object"),),
    outputs=(("VEC4", "color_out"), ("VEC4", "place_out")),
)
# Which pixels of a ray map show a planar mirror, and where its view has them.
MIRROR_UNIFORMS = (("VEC4", "plane_origin"), ("VEC4", "plane_normal"), ("FLOAT", "sizes_per_metre"), ("VEC2", "offset"))


def shown_in(beside: str | None) -> ProgramInfo:
    """A view's picture into a reflection buffer of this kind (targets.ReflectionTarget)."""
    outputs, text = stored(beside)
    return ProgramInfo(
        name="reflect_shown_in_mirror",
        fragment="shown_in_mirror.frag.glsl",
        uniforms=MIRROR_UNIFORMS,
        samplers=tuple(("FLOAT_2D", name) for name in (*RAYS, "picture_tx", "place_tx")),
        outputs=(("VEC4", "radiance_out"), *outputs),
        generated=(("store_answer", text),),
        defines=(("STATUS_HIT", f"{spaces.STATUS_HIT:.1f}"),),
        depth="ANY",
        **FULLSCREEN,
    )


def add_light(level, window, resolve, materials, batch, counts: Counts):
    """What the reflectors of a view make of their answers, onto its picture within window. level: its targets (level_targets.Level);
    resolve, materials: what makes light of answers (resolve.py), and of whose rows."""
    gpu, target = ensure(), level.picture.lit
    with target.bind():
        target.viewport_set(0, 0, level.rays.width, level.rays.height)
        gpu.state.blend_set("ALPHA_PREMULT")
        gpu.state.depth_test_set("NONE")
        gpu.state.scissor_set(*window)
        gpu.state.scissor_test_set(True)
        shader = resolve.level_program()
        shader.bind()
        resolve.bind_level(shader, level.rays, level.answers, materials)
        shader.draw(batch)
        gpu.state.scissor_test_set(False)
        gpu.state.blend_set("NONE")
    counts.passes += 1


class Sky:
    """What an asset of `environment` shows by direction, drawn where a view has no surface."""

    def __init__(self, asset: Asset, textures: TextureCache, counts: Counts):
        self.counts = counts
        kernel = emit_glsl(record(environment.trace, asset), ("radiance",), "sky", push_bytes=0)
        self._inputs = AssetInputs(kernel, asset, textures)
        self._inputs.upload()
        ray = {"origin": "vec3(0.0)", "direction": "direction", "width": "0.0", "spread": "view.frame.y"}
        self._program = program(
            ProgramInfo(
                name="reflect_level_sky",
                fragment="level_sky.frag.glsl",
                blocks=(VIEW_BLOCK, *self._inputs.blocks),
                uniforms=(("MAT4", "rel_from_clip"), ("VEC2", "pixel")),
                samplers=tuple(("FLOAT_2D", sampler) for sampler in self._inputs.samplers),
                outputs=SURFACE.outputs,
                generated=(("kernel", kernel.source), ("call", call_text(kernel, ray, "sky_"))),
                defines=(("FAR", f"{spaces.FAR:.1f}"),),
                **FULLSCREEN,
            ),
            counts,
        )

    def draw(self, batch, view: View, width: int, height: int):
        """Into the level's framebuffer, which is bound, at the depth that it is cleared to."""
        shader = self._program
        shader.bind()
        shader.block("view", view.buffer)
        self._inputs.bind(shader)
        shader.set("rel_from_clip", view.rel_from_clip)
        shader.set("pixel", (2.0 / width, 2.0 / height))
        shader.draw(batch)
        self.counts.passes += 1
