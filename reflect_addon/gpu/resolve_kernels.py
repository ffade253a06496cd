"""The kernels of resolve as GLSL, with the lines that call them: reflectance, both faces of a pane, attenuation (core/shading.py, glass_optics.py).

Their callers have read `base`, `tint` and `weight` of the surface's material, and `cosine` of its ray (glsl/surface_lib.glsl).
"""

from ..core import glass_optics, shading
from ..core.kernel import GlslKernel, emit_glsl, record_function
from .program import call_text

BOTH_FACES = {"mirrored": "reflectance", "tint": "base.rgb"}  # both_faces' inputs as shaders call them


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


def fade_parts(distance: str, faded: str) -> tuple[str, str]:
    """(GLSL function, GLSL that fades a radiance by its distance and the uniform half_distance)."""
    fade = emit_glsl(record_function(shading.attenuation, shading.ATTENUATION_INPUTS), ("attenuation",), "attenuation_at")
    return fade.source, call_text(fade, {"distance": distance, "half_distance": "half_distance"}) + f"  {faded} *= attenuation;\n"
