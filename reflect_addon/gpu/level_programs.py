"""The programs of mirrored views (levels.py): surfaces that carry their light, and a view's picture as its mirror's answer."""

from ..core import spaces
from .fill import RAYS, stored
from .program import ProgramInfo
from .view import VIEW_BLOCK

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


def shown_in(beside: str | None) -> ProgramInfo:
    """A view's picture into a reflection buffer of this kind (targets.ReflectionTarget)."""
    outputs, text = stored(beside)
    return ProgramInfo(
        name="reflect_shown_in_mirror",
        vertex="fullscreen.vert.glsl",
        fragment="shown_in_mirror.frag.glsl",
        attributes=(("FLOAT", "unused"),),
        uniforms=(("VEC4", "plane_origin"), ("VEC4", "plane_normal"), ("FLOAT", "sizes_per_metre")),
        samplers=tuple(("FLOAT_2D", name) for name in (*RAYS, "picture_tx", "place_tx")),
        outputs=(("VEC4", "radiance_out"), *outputs),
        generated=(("store_answer", text),),
        defines=(("STATUS_HIT", f"{spaces.STATUS_HIT:.1f}"),),
        depth="ANY",
    )
