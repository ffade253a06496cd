"""Kernel: what a mirror shows that is itself seen in a mirror, for methods that draw the reflected scene.

Idea. As second_order.py does it: its own light, and its reflectance times what its mirror ray meets; that ray is answered by a gather
method, from the first reflector's asset [popescu-2006 3.1, step 5; estalella-2005 section 8 leaves it open].
"""

from .kernel import Ray
from .second_order import WIDEST, mirror_terms

INPUTS = {
    "origin": "vec3", "direction": "vec3", "normal": "vec3", "width": "float", "spread": "float",
    "own": "vec3", "share": "float", "base": "vec4", "tint": "vec4", "lobe": "vec2",
}  # fmt: skip


def shown(gather):
    """The kernel for a gather method's `trace`: {'radiance': vec3} at `origin`, world, m, met along `direction`.

    normal: unit, world; width, spread: the footprint there; own: the light that the surface sends out without its mirror; share:
    of it that mirrors; base, tint, lobe: core/shading.py's rows of its material (lobe: weight, spread)."""

    def kernel(k, asset, origin, direction, normal, width, spread, own, share, base, tint, lobe):
        toward = k.name("toward", k.min(k.dot(direction, normal), 0.0))
        bent = k.name("bent", k.normalize(direction - normal * (2.0 * toward)))
        wide = k.min(k.sqrt(spread * spread + lobe.y * lobe.y), WIDEST)
        arriving = gather(k, asset, Ray(origin, bent, width, wide)).radiance
        terms = mirror_terms(k, asset, -toward, base.xyz, base.w, tint.xyz, tint.w, lobe.x, share)
        return {"radiance": own * terms["kept"] + terms["reflectance"] * arriving}

    return kernel
