"""The program that draws virtual triangles into a reflection buffer, for one asset, with all that it reads.

With the option `finish` each fragment asks its own ray (glsl/virtual.frag.glsl). Where the scene has mirrors besides, what they show
is answered there by the kernel of core/virtual_shade.py, which is left out elsewhere.
"""

import numpy as np

from ..core import mirrors, spaces, virtual_shade, virtual_status
from ..core.asset import Asset
from ..core.camera import Camera
from ..core.kernel import GlslKernel, emit_glsl, record_function
from ..core.map_space import MapSpace
from ..core.methods import layered_distance
from ..core.shading import material_rows
from ..core.snapshot import SceneSnapshot
from .counts import Counts
from .device import ensure
from .fill import RAYS, stored
from .program import ProgramInfo, call_text, program
from .targets import ReflectionTarget
from .upload import texture_from
from .virtual_scene import COLUMNS, VirtualScene

FRAME_STRUCT = "struct ReflectVirtual { mat4 clip_from_map; mat4 map_from_world; vec4 center; vec4 options; vec4 picture; };"
# Clip space begins so far before the eye, in sizes of the reflector.
NEAREST = 1e-4
# Footprints that a pixel's ray may miss a triangle by where no ray meets one: what rounding leaves open between neighbours.
SLACK = 0.05
# Pixels that a triangle is drawn wider by, besides this share of its longest edge, and at most: reflector maps are rounder than a mesh's
# own normals, and straight edges should bend. Of kitchen's kettle 109 of 358 pixels that were not drawn right are left. SLIVER: height over
# the longest edge below which corners are sharp.
WIDER = (("WIDER", "1.5"), ("BENT", "0.1"), ("WIDEST", "8.0"), ("SLIVER", "0.4"))
TABLES = (("COLUMNS", str(COLUMNS)),)
STATUSES = (("HIDDEN", f"{virtual_status.HIDDEN:.1f}"), ("FAILED", f"{virtual_status.FAILED:.1f}"))
_SHOWN = {
    "origin": "hit_position", "direction": "direction.xyz", "normal": "normal", "width": "width", "spread": "direction.w",
    "own": "hit_radiance", "share": "seen.a", "base": "texelFetch(mirrors_buf, ivec2(0, row), 0)",
    "tint": "texelFetch(mirrors_buf, ivec2(1, row), 0)", "lobe": "texelFetch(mirrors_buf, ivec2(2, row), 0).xy",
}  # fmt: skip


class Mirrors:
    """The materials of the scene's instances that are mirrors to others, a row each; None where there is none."""

    def __init__(self, scene: SceneSnapshot, names: tuple[str, ...], counts: Counts):
        named = scene.named()
        found = [mirrors.mirror_of(scene, named[name]) if name in named else None for name in names]
        self.any = any(found)
        self.has_metal = any(m.material.metallic > 0 for m in found if m)
        self.has_dielectric = any(m.material.metallic < 1 for m in found if m)
        rows = np.zeros((max(len(names), 1), 3, 4), np.float32)
        for row, mirror in zip(rows, found, strict=False):
            if mirror:
                row[:] = material_rows(mirror.material)
        self.texture = texture_from("virtual mirrors", rows, counts, "RGBA32F") if self.any else None


class Drawing:
    """One asset's program for one kind of reflection buffer."""

    def __init__(self, asset: Asset, beside: str | None, shiny: Mirrors, textures, counts: Counts):
        self.counts, self._mirrors = counts, shiny
        outputs, text = stored(beside)
        kernel = _shown(asset, shiny) if shiny.any and asset.options["second_order"] else None
        self._images, self._block, self._block_name = {}, None, ""
        if kernel is not None:
            self._images = {sampler: textures.texture(name, asset.images[name]) for name, sampler in kernel.images.items()}
            if kernel.block_name:
                self._block, self._block_name = ensure().types.GPUUniformBuf(kernel.pack_uniforms(asset)), kernel.block_name
        blocks = ((kernel.typedef, kernel.block_type, kernel.block_name),) if self._block_name else ()
        tables = ("vertices_buf", "normals_buf", "placing_buf", "mirrors_buf") if kernel else ()
        self._second = kernel is not None
        self.program = program(
            ProgramInfo(
                name="reflect_virtual",
                vertex="virtual.vert.glsl",
                fragment="virtual.frag.glsl",
                attributes=(("VEC4", "corner"),),
                varyings=(
                    ("flat", "VEC3", "v_origin"), ("flat", "VEC3", "v_edge_b"), ("flat", "VEC3", "v_edge_c"),
                    ("flat", "VEC3", "v_vertices"), ("smooth", "VEC3", "v_weights"),
                ),
                blocks=((FRAME_STRUCT, "ReflectVirtual", "frame"), *blocks),
                samplers=tuple(
                    ("FLOAT_2D", name) for name in ("virtual_tx", "place_tx", "radiance_buf", *RAYS, *tables, *self._images)
                ),
                outputs=(("VEC4", "radiance_out"), *outputs),
                generated=(
                    ("store_answer", text), ("kernel", kernel.source if kernel else ""),
                    ("shown", call_text(kernel, _SHOWN, "shown_") if kernel else ""),
                ),
                defines=(
                    *TABLES, *STATUSES, ("SLACK", f"{SLACK:.3f}"), *WIDER, ("STATUS_HIT", f"{spaces.STATUS_HIT:.1f}"),
                    *((("FINISH", "1"),) if asset.options["finish"] else ()), *((("MIRRORS", "1"),) if kernel else ()),
                ),
                depth="ANY",
            ),
            counts,
        )  # fmt: skip

    def draw(self, scene: VirtualScene, found, frame, rays, target: ReflectionTarget, bounds, ranges):
        """The triangles in `ranges`, each (first, count); found: virtual_search.Found; frame: frame_of's buffer; rays: RayMapTarget."""
        gpu = ensure()
        with target.framebuffer.bind():
            target.framebuffer.viewport_set(0, 0, target.width, target.height)
            gpu.state.blend_set("NONE")
            gpu.state.face_culling_set("NONE")
            gpu.state.depth_test_set("LESS")
            gpu.state.depth_mask_set(True)
            if bounds is not None:
                gpu.state.scissor_set(*bounds)
                gpu.state.scissor_test_set(True)
            shader = self.program
            shader.bind()
            shader.block("frame", frame)
            images = {"virtual_tx": found.virtual, "place_tx": found.place, "radiance_buf": scene.radiance_buf}
            images |= dict(zip(RAYS, rays.textures, strict=False)) | self._images
            if self._second:
                images |= {
                    "vertices_buf": scene.vertices_buf, "normals_buf": scene.normals_buf, "placing_buf": found.placing,
                    "mirrors_buf": self._mirrors.texture,
                }  # fmt: skip
                if self._block is not None:
                    shader.block(self._block_name, self._block)
            for name, texture in images.items():
                shader.image(name, texture)
            for first, count in ranges:
                shader.draw(scene.batch, 3 * first, 3 * count)
                self.counts.draws += 1
            gpu.state.scissor_test_set(False)
            gpu.state.depth_mask_set(False)
            gpu.state.depth_test_set("NONE")


def frame_of(space: MapSpace, camera: Camera, reflector: int, sizes_per_metre: float) -> np.ndarray:
    """(44,) float32: FRAME_STRUCT. center: w the reflector's index; options: map units per m, sizes per m; picture: pixels, where
    clip space begins.

    Depth is in sizes of the reflector, whose parts have units of their own."""
    data = np.zeros(44, np.float32)
    data[:16] = space.clip_from_map(camera).T.ravel()
    turn = np.eye(4)
    turn[:3, :3] = space.map_from_world
    data[16:32] = turn.T.ravel()
    data[32:35], data[35] = space.center, reflector
    data[36:38] = space.units_per_metre, sizes_per_metre
    # An orthographic camera's clip space has no metres.
    data[40:43] = camera.width, camera.height, NEAREST if camera.is_orthographic else NEAREST / sizes_per_metre
    return data


def _shown(asset: Asset, shiny: Mirrors) -> GlslKernel:
    options = {**asset.options, "has_metal": shiny.has_metal, "has_dielectric": shiny.has_dielectric}
    kernel = virtual_shade.shown(layered_distance.trace)
    program = record_function(kernel, virtual_shade.INPUTS, asset.images, asset.uniforms, options, "shown_in_mirror")
    return emit_glsl(program, ("radiance",), "shown_in_mirror", push_bytes=0)
