"""The program that draws virtual triangles into a reflection buffer, for one asset, with all that it reads.

With the option `finish` each fragment asks its own ray (glsl/virtual.frag.glsl). Where the scene has mirrors besides, hits are left
behind for virtual_second.py, which adds what they show.
"""

import numpy as np

from ..core import spaces, virtual_status
from ..core.asset import Asset
from ..core.camera import Camera
from ..core.map_space import MapSpace
from .counts import Counts
from .device import ensure
from .fill import RAYS, stored
from .program import ProgramInfo, call_text, program
from .targets import ReflectionTarget
from .virtual_scene import COLUMNS, VirtualScene
from .virtual_second import MATERIAL, Hits, Mirrors

FRAME_STRUCT = "struct ReflectVirtual { mat4 clip_from_map; mat4 map_from_world; vec4 center; vec4 options; vec4 picture; };"
# Clip space begins so far before the eye, in sizes of the reflector.
NEAREST = 1e-4
# Footprints that a pixel's ray may miss a triangle by where no ray meets one: what rounding leaves open between neighbours.
SLACK = 0.05
# Sizes of a part (and as many footprints as SLACK) that rays start with: the other side of the triangle that a ray comes from is no farther.
START = 1e-5
# Pixels that a triangle is drawn wider by, besides this share of its longest edge, and at most: reflector maps are rounder than a mesh's
# own normals, and straight edges should bend. Of kitchen's kettle 109 of 358 pixels that were not drawn right are left. SLIVER: height over
# the longest edge below which corners are sharp.
WIDER = (("WIDER", "1.5"), ("BENT", "0.1"), ("WIDEST", "8.0"), ("SLIVER", "0.4"))
TABLES = (("COLUMNS", str(COLUMNS)),)
STATUSES = (("HIDDEN", f"{virtual_status.HIDDEN:.1f}"), ("FAILED", f"{virtual_status.FAILED:.1f}"))


class Drawing:
    """One asset's program for one kind of reflection buffer; second: with hits beside."""

    def __init__(self, asset: Asset, beside: str | None, second: bool, shiny: Mirrors, counts: Counts):
        self.counts, self._mirrors = counts, shiny
        outputs, text = stored(beside)
        kernel = shiny.kept() if second else None
        tables = ("vertices_buf", "normals_buf", "placing_buf", "mirrors_buf") if second else ()
        self._second = second
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
                blocks=((FRAME_STRUCT, "ReflectVirtual", "frame"),),
                samplers=tuple(("FLOAT_2D", name) for name in ("virtual_tx", "place_tx", "radiance_buf", *RAYS, *tables)),
                outputs=(("VEC4", "radiance_out"), *outputs, *((("VEC4", "mirror_out"),) if second else ())),
                generated=(
                    ("store_answer", text), ("kernel", kernel.source if kernel else ""),
                    ("kept", call_text(kernel, MATERIAL, "kept_") if kernel else ""),
                ),
                defines=(
                    *TABLES, *STATUSES, ("SLACK", f"{SLACK:.3f}"), ("START", f"{START:.1e}"), *WIDER, ("STATUS_HIT", f"{spaces.STATUS_HIT:.1f}"),
                    *((("FINISH", "1"),) if asset.options["finish"] else ()), *((("MIRRORS", "1"),) if kernel else ()),
                ),
                depth="ANY",
            ),
            counts,
        )  # fmt: skip

    def draw(self, scene: VirtualScene, found, frame, rays, target: ReflectionTarget, hits: Hits | None, bounds, ranges):
        """The triangles in `ranges`, each (first, count); found: virtual_search.Found; frame: frame_of's buffer; rays: RayMapTarget;
        hits: of the target, where the drawing leaves them."""
        gpu = ensure()
        framebuffer = hits.framebuffer if hits else target.framebuffer
        with framebuffer.bind():
            framebuffer.viewport_set(0, 0, target.width, target.height)
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
            images |= dict(zip(RAYS, rays.textures, strict=False))
            if self._second:
                images |= {
                    "vertices_buf": scene.vertices_buf, "normals_buf": scene.normals_buf, "placing_buf": found.placing,
                    "mirrors_buf": self._mirrors.texture,
                }  # fmt: skip
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
