"""The background's passes: the camera's own rays into the ray map, and what was answered to them into the viewport.

Which asset answers is core/background.py's business; the answer itself is a fill like any other (fill.py).
"""

from .counts import Counts
from .program import ProgramInfo, program
from .targets import RAY_MAP_OUTPUTS, RayMapTarget
from .view import VIEW_BLOCK, View

# The index that stands for the background in a ray map: of pixels that hold the camera's own ray.
BACKGROUND = -2

FULLSCREEN = {"vertex": "fullscreen.vert.glsl", "attributes": (("FLOAT", "unused"),)}
CAMERA_RAYS = ProgramInfo(
    name="reflect_background_rays",
    fragment="background_rays.frag.glsl",
    blocks=(VIEW_BLOCK,),
    uniforms=(("MAT4", "rel_from_clip"), ("VEC3", "pixel")),
    outputs=RAY_MAP_OUTPUTS,
    **FULLSCREEN,
)
# GLSL of a picture's background at a pixel.
ANSWERED = f"(texelFetch(origin_tx, pixel, 0).w < {BACKGROUND + 0.5}) ? texelFetch(radiance_tx, pixel, 0).rgb : vec3(0.0)"


def draw_camera_rays(gpu, batch, view: View, target: RayMapTarget, counts: Counts):
    """Every pixel's own ray into the ray map's framebuffer, which is bound; its depth stays."""
    gpu.state.depth_test_set("NONE")
    gpu.state.depth_mask_set(False)
    shader = program(CAMERA_RAYS, counts)
    shader.bind()
    shader.block("view", view.buffer)
    shader.set("rel_from_clip", view.rel_from_clip)
    shader.set("pixel", (BACKGROUND, 2.0 / target.width, 2.0 / target.height))
    shader.draw(batch)
    counts.draws += 1


def overlay_info(look: str, uniforms, samplers) -> ProgramInfo:
    """The program that lays the answers over a viewport's picture. look: GLSL of display_linear, with what it declares."""
    return ProgramInfo(
        name="reflect_overlay_background",
        fragment="overlay_background.frag.glsl",
        uniforms=(("FLOAT", "background_index"), *uniforms),
        samplers=(("FLOAT_2D", "origin_tx"), ("FLOAT_2D", "radiance_tx"), *samplers),
        outputs=(("VEC4", "overlay_out"),),
        generated=(("look", look),),
        **FULLSCREEN,
    )
