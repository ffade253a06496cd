"""Resolve, once for all methods: reflectance, tint, attenuation, the view transform, and putting it together.

A plan is what a scene uses; what it does not use is not in the shader: no metal term without metals, no position
buffer without attenuation, no table under the Standard view.
"""

from dataclasses import dataclass

import numpy as np

from ..core import glass_optics, shading
from ..core.asset import Asset
from ..core.kernel import GlslKernel, emit_glsl, record_function
from ..core.look import LINEAR, TABLE_SIDE, TOP, Look
from ..core.snapshot import SceneSnapshot
from .background import ANSWERED, BACKGROUND, overlay_info
from .counts import Counts
from .program import Program, ProgramInfo, call_text, program
from .raymap import surface_info
from .targets import RayMapTarget, ReflectionTarget
from .upload import read_texture, texture_from, volume_from

BOTH_FACES = {"mirrored": "reflectance", "tint": "base.rgb"}  # both_faces' inputs as resolve_lib.glsl calls them
SPACES = ("linear", "display")  # scene-linear; developed and display-encoded, for a PNG


@dataclass(frozen=True)
class ResolvePlan:
    """What the resolve shader has in it."""

    has_metal: bool
    has_dielectric: bool
    attenuation: bool
    table: bool
    glass: bool = False  # something is seen through

    @staticmethod
    def of(snapshot: SceneSnapshot, materials_in_use, attenuation: float | None, look: Look, glass: bool = False) -> "ResolvePlan":
        used = [snapshot.materials[m] for m in materials_in_use]
        return ResolvePlan(
            has_metal=any(m.metallic > 0 for m in used),
            has_dielectric=any(m.metallic < 1 for m in used) or not used,
            attenuation=attenuation is not None,
            table=look.table is not None,
            glass=glass,
        )


def reflectance_kernel(has_metal: bool, has_dielectric: bool) -> tuple[str, str]:
    """(GLSL functions, GLSL that sets `reflectance` and `opacity` from cosine, base, tint, weight)."""
    options = {"has_metal": has_metal, "has_dielectric": has_dielectric}
    recorded = record_function(shading.reflectance, shading.REFLECTANCE_INPUTS, options=options)
    # Asked for in both cases; the composite drops opacity when the driver sees that nobody reads it.
    kernel = emit_glsl(recorded, ("reflectance", "opacity"), "surface_reflectance")
    arguments = {
        "cosine": "cosine",
        "base_color": "base.rgb",
        "metallic": "base.a",
        "specular_tint": "tint.rgb",
        "ior": "tint.a",
        "weight": "weight",
    }
    return kernel.source, call_text(kernel, arguments)


def both_faces(wanted: tuple[str, ...]) -> GlslKernel:
    """What both faces of a pane make of one face's `reflectance`: through, mirrored."""
    return emit_glsl(record_function(glass_optics.pane, glass_optics.PANE_INPUTS), wanted, "both_faces")


class LookTexture:
    """A look on the GPU; a new exposure is a new uniform, only a new table is an upload."""

    def __init__(self, look: Look, counts: Counts):
        self.table_tx = None
        self._table = None
        self.counts = counts
        self.set(look)

    def set(self, look: Look):
        self.look = look
        if look.table is not self._table:
            self._table = look.table
            self.table_tx = None
            if look.table is not None:
                padded = np.concatenate([look.table, np.ones_like(look.table[..., :1])], -1)
                self.table_tx = volume_from("look", padded, self.counts)

    def bind(self, shader: Program):
        shader.set("look", (self.look.gain(), 1.0 / LINEAR, 1.0 / np.log2(TOP / LINEAR + 1.0), TABLE_SIDE))
        if self.table_tx is not None:
            shader.image("look_tx", self.table_tx)


class MaterialTable:
    """The scene's materials as one small texture, a row each."""

    def __init__(self, rows: np.ndarray, counts: Counts):
        self.rows = rows
        self.texture = texture_from("materials_buf", rows, counts)

    @staticmethod
    def rows_of(snapshot: SceneSnapshot) -> np.ndarray:
        """(materials, MATERIAL_TEXELS, 4) float32; one row of zeros when there are none."""
        rows = [shading.material_rows(m) for m in snapshot.materials] or [[[0.0] * 4] * shading.MATERIAL_TEXELS]
        return np.asarray(rows, np.float32)


class Resolve:
    """The last pass, for pictures (`composite`) and for the viewport (`overlay`)."""

    def __init__(self, plan: ResolvePlan, half_distance: float | None, counts: Counts):
        self.plan = plan
        self.half_distance = half_distance
        self.counts = counts
        self._programs: dict[object, Program] = {}  # what was drawn before: recording and emitting take milliseconds

    def composite(self, gpu, batch, rays: RayMapTarget, answer: ReflectionTarget, materials, look, space, background, bounds):
        """(H, W, 4) float32: reflections over `background` ((H, W, 3) scene-linear; an asset: what it answered where the ray
        map holds the camera's own rays; None: empty, alpha 0).

        space: 'linear' | 'display'. bounds: (x, y, width, height) px that holds all reflectors, None: there are none.
        Raises ValueError on a background of another size.
        """
        target = self.draw_composite(gpu, batch, rays, answer, materials, look, space, background, bounds)
        return read_texture(target, self.counts)

    def draw_composite(self, gpu, batch, rays, answer, materials, look, space, background, bounds, target=None):
        """As composite, without reading back: returns the RGBA32F texture it drew into."""
        if space not in SPACES:
            raise ValueError(f"a picture is 'linear' or 'display', not '{space}'")
        backdrop = None
        kind = "" if background is None else "answer" if isinstance(background, Asset) else "picture"
        if kind == "picture":
            if np.shape(background) != (rays.height, rays.width, 3):
                raise ValueError(f"background has shape {np.shape(background)}, not {(rays.height, rays.width, 3)}")
            padded = np.concatenate([background, np.ones((rays.height, rays.width, 1))], -1)
            backdrop = texture_from("background_buf", padded, self.counts)
        if target is None:
            target = gpu.types.GPUTexture((rays.width, rays.height), format="RGBA32F")
        target.clear(format="FLOAT", value=(0.0, 0.0, 0.0, 0.0))
        framebuffer = gpu.types.GPUFrameBuffer(color_slots=[target])
        shader = self._program((space, kind), self._composite_info)
        with framebuffer.bind():
            framebuffer.viewport_set(0, 0, rays.width, rays.height)
            gpu.state.blend_set("NONE")
            gpu.state.depth_test_set("NONE")
            shader.bind()
            self._bind(shader, rays, answer, materials)
            shader.set("empty_alpha", 1.0 if kind else 0.0)
            if backdrop is not None:
                shader.image("background_tx", backdrop)
            if space == "display":
                look.bind(shader)
            region = (0, 0, rays.width, rays.height) if kind else bounds
            if region is not None:
                gpu.state.scissor_set(*region)
                gpu.state.scissor_test_set(True)
                shader.draw(batch)
                gpu.state.scissor_test_set(False)
        self.counts.passes += 1
        return target

    def overlay_program(self) -> Program:
        return self._program((), self._overlay_info)

    def _program(self, variant: tuple, info_of) -> Program:
        key = (info_of.__name__, *variant)
        if key not in self._programs:
            self._programs[key] = program(info_of(*variant), self.counts)
        return self._programs[key]

    def draw_background(self, batch, rays: RayMapTarget, answer: ReflectionTarget, look: LookTexture):
        """What an asset answered to the camera's own rays, into the framebuffer that is bound."""
        shader = self._program((), self._background_info)
        shader.bind()
        shader.image("origin_tx", rays.origin_tx)
        shader.image("radiance_tx", answer.radiance_tx)
        shader.set("background_index", BACKGROUND)
        look.bind(shader)
        shader.draw(batch)
        self.counts.passes += 1

    def bind_overlay(self, shader: Program, rays, answer, materials, look: LookTexture):
        self._bind(shader, rays, answer, materials)
        look.bind(shader)

    def level_program(self) -> Program:
        """What reflectors add to a mirrored view (levels.py)."""
        return self._program((), self._level_info)

    def bind_level(self, shader: Program, rays, answer, materials):
        self._bind(shader, rays, answer, materials)

    def _bind(self, shader: Program, rays: RayMapTarget, answer: ReflectionTarget, materials: MaterialTable):
        for name in ("origin_tx", "material_tx"):
            shader.image(name, getattr(rays, name))
        shader.image("radiance_tx", answer.radiance_tx)
        shader.image("materials_tx", materials.texture)
        if self.plan.attenuation:
            shader.image("distance_tx", answer.distance_tx)
            shader.set("half_distance", self.half_distance)
        if self.plan.glass:
            shader.image("through_tx", answer.through.texture)

    def reflectance_parts(self) -> tuple[str, str]:
        """See reflectance_kernel."""
        return reflectance_kernel(self.plan.has_metal, self.plan.has_dielectric)

    def _shared(self):
        """(generated includes, uniforms, samplers) that every resolve shader has."""
        source, reflectance_call = self.reflectance_parts()
        sources, attenuation_call = [source], ""
        samplers = [("FLOAT_2D", n) for n in ("origin_tx", "material_tx")]
        samplers += [("FLOAT_2D", "radiance_tx"), ("FLOAT_2D", "materials_tx")]
        uniforms = []
        if self.plan.attenuation:
            fade, attenuation_call = fade_parts("texelFetch(distance_tx, pixel, 0).r", "resolved.radiance")
            sources.append(fade)
            samplers.append(("FLOAT_2D", "distance_tx"))
            uniforms.append(("FLOAT", "half_distance"))
        glass_call = glass_light = ""
        if self.plan.glass:
            faces = both_faces(("mirrored",))
            sources.append(faces.source)
            samplers.append(("FLOAT_2D", "through_tx"))
            called = call_text(faces, BOTH_FACES, "pane_")
            glass_call = f"  vec4 through = texelFetch(through_tx, pixel, 0);\n{called}  reflectance = (through.a > 1.5) ? pane_mirrored : reflectance;\n"
            glass_light = (
                "  resolved.radiance += through.rgb;\n  resolved.covered = min(through.a, 1.0);\n"
                "  resolved.opacity = max(resolved.opacity, resolved.covered);\n"
            )
        generated = (
            ("shading", "\n".join(sources)),
            ("reflectance_call", reflectance_call + glass_call),
            ("attenuation_call", attenuation_call + glass_light),
        )
        return generated, tuple(uniforms), tuple(samplers)

    def _look_parts(self):
        name = "look_lut_lib.glsl" if self.plan.table else "look_standard_lib.glsl"
        samplers = (("FLOAT_3D", "look_tx"),) if self.plan.table else ()
        return f'#include "{name}"\n', (("VEC4", "look"),), samplers

    def _composite_info(self, space: str, background: str) -> ProgramInfo:
        """background: "picture", "answer" (an asset's, to the camera's own rays) or "": none."""
        generated, uniforms, samplers = self._shared()
        uniforms += (("FLOAT", "empty_alpha"),)
        value = {"": "vec3(0.0)", "picture": "texelFetch(background_tx, pixel, 0).rgb", "answer": ANSWERED}[background]
        generated += (("background", f"vec3 background(ivec2 pixel)\n{{\n  return {value};\n}}\n"),)
        if background == "picture":
            samplers += (("FLOAT_2D", "background_tx"),)
        if space == "display":
            include, look_uniforms, look_samplers = self._look_parts()
            uniforms, samplers = uniforms + look_uniforms, samplers + look_samplers
            body, value = include, "vec4(srgb_encoded(display_linear(scene)), alpha)"
        else:
            body, value = "", "vec4(scene, alpha)"
        body += f"vec4 developed(vec3 scene, float alpha)\n{{\n  return {value};\n}}\n"
        return ProgramInfo(
            name=f"reflect_composite_{space}",
            vertex="fullscreen.vert.glsl",
            fragment="composite.frag.glsl",
            attributes=(("FLOAT", "unused"),),
            uniforms=uniforms,
            samplers=samplers,
            outputs=(("VEC4", "picture_out"),),
            generated=generated + (("develop", body),),
        )

    def _level_info(self) -> ProgramInfo:
        generated, uniforms, samplers = self._shared()
        return ProgramInfo(
            name="reflect_level_light",
            vertex="fullscreen.vert.glsl",
            fragment="level_light.frag.glsl",
            attributes=(("FLOAT", "unused"),),
            uniforms=uniforms,
            samplers=samplers,
            outputs=(("VEC4", "light_out"),),
            generated=generated,
        )

    def _background_info(self) -> ProgramInfo:
        return overlay_info(*self._look_parts())

    def _overlay_info(self) -> ProgramInfo:
        generated, uniforms, samplers = self._shared()
        include, look_uniforms, look_samplers = self._look_parts()
        return surface_info(
            "reflect_overlay",
            "overlay.frag.glsl",
            uniforms=(("MAT4", "rel_from_object"), ("VEC4", "surface")) + look_uniforms + uniforms,
            samplers=samplers + look_samplers,
            outputs=(("VEC4", "overlay_out"),),
            generated=generated + (("look", include),),
        )


def fade_parts(distance: str, faded: str) -> tuple[str, str]:
    """(GLSL function, GLSL that fades a radiance by its distance and the uniform half_distance)."""
    fade = emit_glsl(record_function(shading.attenuation, shading.ATTENUATION_INPUTS), ("attenuation",), "attenuation_at")
    return fade.source, call_text(fade, {"distance": distance, "half_distance": "half_distance"}) + f"  {faded} *= attenuation;\n"
