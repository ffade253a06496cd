"""Resolve, once for all methods: reflectance, tint, attenuation, the view transform, and putting it together.

A plan is what a scene uses; what it does not use is not in the shader: no metal term without metals, no position
buffer without attenuation, no table under the Standard view.
"""

from dataclasses import dataclass

import numpy as np

from ..core.asset import Asset
from ..core.look import Look
from ..core.snapshot import SceneSnapshot
from .background import ANSWERED, BACKGROUND, overlay_info
from .counts import Counts
from .program import Program, ProgramInfo, call_text, program
from .raymap import surface_info
from .resolve_kernels import BOTH_FACES, both_faces, fade_parts, reflectance_kernel
from .resolve_tables import LookTexture, MaterialTable
from .targets import RayMapTarget, ReflectionTarget
from .upload import read_texture, texture_from

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
