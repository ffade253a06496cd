"""The mirror ray of a surface point, as a kernel: what a shader node group asks a method with.

Problem. The overlay's rays come from a ray map (gpu/glsl/raymap.frag.glsl). A material has no ray map: it knows its own place, its normals and
where it is seen from.
Idea. The same rules for one point: both normals face the viewer by the side of the triangle that is seen; a shading normal that turns away
from the viewer is at grazing; a ray that would enter the surface is lifted onto it and the normal tilted to match.
Limits. No footprint but that of roughness: a material knows no neighbours. EEVEE takes many samples of a pixel, as Cycles does.
"""

from . import spaces
from .kernel import Program, Ray, record_function
from .shading import ROUGHNESS_SPREAD

INPUTS = {"position": "vec3", "incoming": "vec3", "normal": "vec3", "smooth_normal": "vec3", "face_normal": "vec3", "roughness": "float"}
LOWEST = 0.01  # of a ray's direction along the face's normal: below it the surface hides what is seen


def mirror_ray(k, incoming, normal, face_normal):
    """(direction, cosine): unit vec3, world, of the mirror ray, and the cosine between it and the normal that it was mirrored at.

    incoming: unit, towards the viewer; normals: unit, on either side."""
    side = k.select(k.dot(face_normal, incoming) < 0.0, -1.0, 1.0)
    face, n = face_normal * side, normal * side
    mirrored = k.normalize(2.0 * k.max(k.dot(incoming, n), 0.0) * n - incoming)
    k.cite("no ray into the surface: lift it onto the triangle, and tilt the normal to match")
    lowest = k.min(0.5 * k.max(k.dot(face, incoming), 0.0), LOWEST)
    height = k.dot(mirrored, face)
    low = height < lowest
    lifted = k.normalize(mirrored + face * k.max(lowest - height, 0.0))
    direction = k.name("direction", k.select(low, lifted, mirrored))
    tilted = k.select(low, k.normalize(direction + incoming), n)
    return direction, k.name("cosine", k.dot(tilted, direction))


def record_surface(trace, asset, name: str) -> Program:
    """A method's kernel asked by a surface point: INPUTS -> radiance vec3, distance float (m; FAR: the sky), coverage, cosine,
    position vec3 (world; of what is shown, which need not lie on the ray).

    normal: (0, 0, 0) stands for the smooth normal."""

    def function(k, scope, position, incoming, normal, smooth_normal, face_normal, roughness):
        own = k.select(k.dot(normal, normal) > 0.25, k.normalize(normal), smooth_normal)
        direction, cosine = mirror_ray(k, incoming, own, face_normal)
        hit = trace(k, scope, Ray(position, direction, k.vec2(0.0, 0.0).x, ROUGHNESS_SPREAD * roughness * roughness))
        away = k.min(k.length(hit.position - position), spaces.FAR)
        return {"radiance": hit.radiance, "distance": away, "coverage": hit.coverage, "cosine": cosine, "position": hit.position}

    return record_function(function, INPUTS, asset.images, asset.uniforms, asset.options, name)
