"""Glass, drawn: panes take over the view through them, solid bodies send a ray on for each pixel; both as light that resolve adds.

What goes through is kept beside a reflection buffer (targets.ReflectionTarget.through): radiance that already is what leaves towards the eye, and in
alpha 1 for a body, 2 for a pane, whose other face mirrors as well (resolve_lib.glsl). Where there is none, the surface shows what it did.
The ray that leaves a body is answered by the kernel that answers the body's mirrored rays: its baked maps, or its live one.
Scenes without glass compile nothing of this and make no texture.
"""

from functools import cache

from ..core import glass_optics, glass_shapes
from ..core.asset import Asset
from ..core.kernel import emit_glsl, emitted, record_function
from .asset_inputs import AssetInputs
from .background import FULLSCREEN
from .device import ensure
from .fill import RAYS
from .level_programs import MIRROR_UNIFORMS
from .program import Program, ProgramInfo, call_text, program
from .resolve_kernels import BOTH_FACES, both_faces, reflectance_kernel
from .texture_cache import TextureCache

SEEN = (*RAYS, "material_tx", "materials_tx")
_BODY = {
    "origin": "origin.xyz", "view": "view", "normal": "normal.xyz", "ior": "surface.a", "tint": "base.rgb", "center": "center.xyz", "shape": "shape",
}  # fmt: skip
_RAY = {"origin": "way_origin", "direction": "way_direction", "width": "normal.w", "spread": "spread"}


@cache
def shown_through() -> ProgramInfo:
    """A view's picture as what is seen through its pane."""
    (source, reflectance_call), kernel = reflectance_kernel(False, True), both_faces(("through",))
    return ProgramInfo(
        name="reflect_shown_through",
        fragment="shown_through.frag.glsl",
        uniforms=MIRROR_UNIFORMS,
        samplers=tuple(("FLOAT_2D", name) for name in (*SEEN, "picture_tx")),
        outputs=(("VEC4", "through_out"),),
        generated=(
            ("shading", source + kernel.source), ("reflectance_call", reflectance_call), ("both_faces_call", call_text(kernel, BOTH_FACES, "pane_")),
        ),
        **FULLSCREEN,
    )  # fmt: skip


class Body:
    """The program of one solid body, and what its kernels read. answers: the asset whose kernel `trace` answers rays that leave."""

    def __init__(self, body: Asset, answers: Asset, trace, textures: TextureCache):
        kernel = emitted(trace, answers, ("radiance", "coverage"))
        way = emit_glsl(
            record_function(glass_optics.body, glass_optics.BODY_INPUTS, glass_optics.IMAGES), ("origin", "direction", "through", "found"), "through_body",
            prefix="",
        )  # fmt: skip
        self.body, self.answers, self._counts = body, answers, textures.counts
        self._inputs = AssetInputs(kernel, answers, textures, {name: body.images[name] for name in glass_optics.IMAGES})
        self._info = ProgramInfo(
            name="reflect_through_body",
            fragment="through_body.frag.glsl",
            uniforms=(("VEC2", "reflectors"), ("VEC4", "center"), ("VEC2", "shape")),
            blocks=self._inputs.blocks,
            samplers=tuple(("FLOAT_2D", name) for name in (*SEEN, *self._inputs.samplers)),
            outputs=(("VEC4", "through_out"),),
            generated=(
                ("kernel", kernel.source), ("body", way.source), ("body_call", call_text(way, _BODY, "way_")),
                ("call", call_text(kernel, _RAY, "hit_")),
            ),
            **FULLSCREEN,
        )  # fmt: skip
        self.prepare()

    def prepare(self) -> Program:
        """Compile now."""
        self._inputs.upload()
        return program(self._info, self._counts)

    def draw(self, batch, seen, materials, first: int, last: int, bounds):
        """What is seen through it, in bounds (x, y, width, height) px of seen.target. materials: the scene's MaterialTable."""
        gpu, through = ensure(), seen.target.through
        with through.framebuffer.bind():
            through.framebuffer.viewport_set(0, 0, seen.target.width, seen.target.height)
            gpu.state.blend_set("NONE")
            gpu.state.depth_test_set("NONE")
            gpu.state.scissor_set(*bounds)
            gpu.state.scissor_test_set(True)
            shader = self.prepare()
            shader.bind()
            self._inputs.bind(shader)
            for name, texture in zip(SEEN, (*seen.rays.textures, materials.texture), strict=True):
                shader.image(name, texture)
            shader.set("reflectors", (first, last))
            shader.set("center", (*self.body.uniforms["glass_center"], 0.0))
            shader.set("shape", self.body.uniforms["glass_shape"])
            shader.draw(batch)
            gpu.state.scissor_test_set(False)
        self._counts.passes += 1


class Bodies:
    """The solid bodies of a renderer."""

    def __init__(self, textures: TextureCache):
        self._textures = textures
        self._made: dict[tuple[int, int], Body] = {}  # by the ids of body and answers

    def body(self, asset: Asset, answers: Asset, trace) -> Body:
        key = id(asset), id(answers)
        if key not in self._made:
            self._made[key] = Body(asset, answers, trace, self._textures)
        return self._made[key]

    def keep_only(self, assets):
        """Let go of what was made of other assets; live maps are made again."""
        used = {id(asset) for asset in assets}
        self._made = {key: made for key, made in self._made.items() if set(key) <= used}

    def drop(self, gone: set[int]):
        """Let go of what assets of these ids answered."""
        self._made = {key: made for key, made in self._made.items() if key[1] not in gone}

    def free(self):
        self._made = {}


def is_body(asset: Asset) -> bool:
    """Whether rays go through the asset's reflector."""
    return asset.options.get("glass") == glass_shapes.SOLID
