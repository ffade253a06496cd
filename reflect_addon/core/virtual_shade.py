"""Kernels: what a mirror shows that is itself seen in a mirror, for methods that draw the reflected scene.

Idea. As second_order.py does it: its own light, and its reflectance times what its mirror ray meets; that ray is answered by a gather
method, from the first reflector's asset [popescu-2006 3.1, step 5; estalella-2005 section 8 leaves it open]. In two halves, since own
light is known where a triangle is drawn, and the ray is asked once a pixel.
"""

from .kernel import Ray
from .second_order import WIDEST, mirror_terms

# Of a surface that is met along `direction`, all in world space. normal: unit; base, tint, lobe: core/shading.py's rows of its material
# (lobe: weight, spread); share: of it that mirrors.
KEPT_INPUTS = {"direction": "vec3", "normal": "vec3", "share": "float", "base": "vec4", "tint": "vec4", "lobe": "vec2"}
# And of the ray that meets it at `origin`, m: width and spread of its footprint there.
INPUTS = {"origin": "vec3", "width": "float", "spread": "float", **KEPT_INPUTS}


def kept(k, asset, direction, normal, share, base, tint, lobe):
    """{'kept': float}: what the mirror leaves of the light that the surface below it sends out."""
    cosine = -k.min(k.dot(direction, normal), 0.0)
    return {"kept": mirror_terms(k, asset, cosine, base.xyz, base.w, tint.xyz, tint.w, lobe.x, share)["kept"]}


def arriving(gather):
    """The kernel for a gather method's `trace`: {'radiance': vec3} that the mirror adds."""

    def kernel(k, asset, origin, width, spread, direction, normal, share, base, tint, lobe):
        toward = k.name("toward", k.min(k.dot(direction, normal), 0.0))
        bent = k.name("bent", k.normalize(direction - normal * (2.0 * toward)))
        wide = k.min(k.sqrt(spread * spread + lobe.y * lobe.y), WIDEST)
        met = gather(k, asset, Ray(origin, bent, width, wide)).radiance
        return {"radiance": mirror_terms(k, asset, -toward, base.xyz, base.w, tint.xyz, tint.w, lobe.x, share)["reflectance"] * met}

    return kernel
