"""Rough planar mirrors, and curved ones: rays are looked up in the picture of the mirror's view, by a march a ray (core/mirror_march.py).

Rays of core/lobe_rays.py; what the view does not show of them the kernel of the mirror's asset answers, as it does for mirrors without a view.
Sharp planar mirrors have no part in this: levels.py hands over rough ones only, and no texture is made for either.
Of a curved mirror's rays few start in its picture (core/curved_march.py); a pixel of which nothing is seen there is left to the fill that
comes after.
"""

from ..core import curved_march, lobe_rays, mirror_march, spaces
from ..core.asset import Asset
from ..core.kernel import emit_glsl, emitted, record_function
from ..core.methods import recursive
from .asset_inputs import AssetInputs
from .background import FULLSCREEN
from .fill import LOBE_RAY, RAYS, lobe_parts, stored
from .level_programs import MIRROR_UNIFORMS
from .program import Program, ProgramInfo, call_text, program
from .texture_cache import TextureCache
from .view import VIEW_BLOCK

# What the pass reads of a ray map, the materials, and of a view's picture.
SEEN = (*RAYS, "material_tx", "materials_tx", *mirror_march.IMAGES)
# px of the view that one ray of a lobe stands for.
FINE = 0.25
_MARCH = {
    "start": "start", "direction": "ray_direction", "eye": "view.eye.xyz", "forward": "view.forward.xyz",
    "row_x": "half_size.x * (rows[0] + rows[3])", "row_y": "half_size.y * (rows[1] + rows[3])", "row_w": "rows[3]",
    "window": "window", "footprint": "view.frame.y", "reach": "reach",
}  # fmt: skip


class GlossyMirror:
    """The program of one asset's rough mirrors, or of its curved ones, and what its kernel reads."""

    def __init__(self, asset: Asset, beside: str | None, textures: TextureCache, curved: bool):
        kernel = emitted(recursive.trace, asset, ("radiance", "coverage", "position"))
        by, arguments = (curved_march, {**_MARCH, "nearest": "nearest"}) if curved else (mirror_march, _MARCH)
        march = emit_glsl(record_function(by.march, by.INPUTS, by.IMAGES), ("radiance", "distance", "found"), "march_mirror", prefix="")
        outputs, store = stored(beside)
        self.asset, self._counts, self._inputs = asset, textures.counts, AssetInputs(kernel, asset, textures)
        self._info = ProgramInfo(
            name="reflect_glossy_mirror",
            fragment="glossy_mirror.frag.glsl",
            blocks=(VIEW_BLOCK, *self._inputs.blocks),
            uniforms=(
                *MIRROR_UNIFORMS, ("VEC4", "window"), ("VEC3", "rays_for"), ("FLOAT", "reach"), *((("FLOAT", "nearest"),) if curved else ()),
            ),
            samplers=tuple(("FLOAT_2D", name) for name in (*SEEN, *self._inputs.samplers)),
            outputs=(("VEC4", "radiance_out"), *outputs),
            generated=(
                ("kernel", kernel.source), ("march", march.source), *lobe_parts(), ("march_call", call_text(march, arguments, "march_")),
                ("call", call_text(kernel, LOBE_RAY, "hit_")), ("store_answer", store),
            ),
            defines=(("STATUS_HIT", f"{spaces.STATUS_HIT:.1f}"), ("CURVED", "true" if curved else "false")),
            depth="ANY",
            **FULLSCREEN,
        )  # fmt: skip
        self.prepare()

    def prepare(self) -> Program:
        """Compile now."""
        self._inputs.upload()
        return program(self._info, self._counts)

    def bind(self, view, rays, picture, materials, window, most_rays: int, footprint: float, reach: float, finer: int) -> Program:
        """The program, with all but MIRROR_UNIFORMS set. view: of the picture's camera; window: px of it; footprint: of its pixels at 1 m; reach: m
        from anywhere to beyond everything; finer: px of the view along one of the ray map's."""
        shader = self.prepare()
        shader.bind()
        shader.block("view", view.buffer)
        self._inputs.bind(shader)
        for name, texture in zip(SEEN, (*rays.textures, materials.texture, picture.color_tx, picture.place_tx), strict=True):
            shader.image(name, texture)
        x, y, width, height = window
        shader.set("window", (x, y, x + width, y + height))
        shader.set("rays_for", (most_rays, lobe_rays.FINE / (FINE * footprint), finer))
        shader.set("reach", reach)
        return shader
