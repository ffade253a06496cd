"""The mirror ray of a surface point, as a kernel: what a shader node group asks a method with.

Problem. The overlay's rays come from a ray map (gpu/glsl/raymap.frag.glsl). A material has no ray map: it knows its own place, its normals and
where it is seen from.
Idea. The same rules for one point: both normals face the viewer by the side of the triangle that is seen; a shading normal that turns away
from the viewer is at grazing; a ray that would enter the surface is lifted onto it and the normal tilted to match.
Rough surfaces. Where stand-ins have outlines the overlay sends a pixel's rays over the lobe and takes their weighted mean (lobe_rays.py). A
renderer takes many samples of a pixel, so here each sample sends one of these rays, at random, with its share of the footprint; the mean of the
samples is then the overlay's. A ray's weight is the chance that it is taken: one that is not is drawn again.
Limits. No footprint but that of roughness: a material knows no neighbours. A picture of few samples is noisy where the surface is rough, and one
whose samples all lie on the pixel's centre shows one ray of the lobe.
"""

from . import lobe_rays, spaces
from .kernel import Program, Ray, record_function
from .shading import ROUGHNESS_SPREAD
from .turns import cosine_and_sine

INPUTS = {"position": "vec3", "incoming": "vec3", "normal": "vec3", "smooth_normal": "vec3", "face_normal": "vec3", "roughness": "float"}
# Three numbers in 0..1 that differ from sample to sample: where on the lobe, turned by how much, and whether the ray is taken.
RANDOM = {"random": "vec3"}
LOWEST = 0.01  # of a ray's direction along the face's normal: below it the surface hides what is seen
# Draws after which the last ray is taken all the same. Seen at 75 degrees from the normal at roughness 0.7 the mean weight is 0.7: one ray in a hundred.
DRAWS = 4
# The next draw's numbers are the fractions of so many times this one's: of a chance that was refused nothing is left in them.
ONWARD = 61.0


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


def ray_of_lobe(k, scope, direction, normal, added, random):
    """(direction, spread): one ray of a rough surface, drawn by `random`, and what it grows by per metre; a mirror's is the mirror ray.

    added: growth of the footprint by the surface's whole lobe; normal: the one that the mirror ray was mirrored at."""
    rays = k.name("rays", lobe_rays.count(k, scope, added, float(lobe_rays.MOST))["rays"])

    def draw(_, direction_now, share, turn, chance):
        k.cite("a ray of the lobe, taken with the chance of its weight")
        c, s = cosine_and_sine(k, turn, 1.0)
        around = k.vec2(c * c - s * s, 2.0 * c * s)  # of half a circle: doubled
        found = lobe_rays.direction(k, scope, direction, normal, added * lobe_rays.ALPHA, around, k.clamp(share, 1e-4, 1.0 - 1e-4))
        onward = (k.fract(v * ONWARD) for v in (share, turn, chance))
        return (found["direction"], *onward), chance < found["weight"]

    picked = k.branch(
        rays > 1.5,
        lambda: k.loop(DRAWS, (direction, random.x, random.y, random.z), draw)[:1],
        lambda: (direction,),
    )[0]
    return k.name("picked", picked), added / k.sqrt(rays)


def record_surface(trace, asset, name: str, rough: bool = False) -> Program:
    """A method's kernel asked by a surface point: INPUTS -> radiance vec3, distance float (m; FAR: the sky), coverage, cosine,
    position vec3 (world; of what is shown, which need not lie on the ray).

    normal: (0, 0, 0) stands for the smooth normal. rough: rays over the lobe, where the asset has outlines; then RANDOM is an input, too."""
    drawn = rough and lobe_rays.has_outlines(asset)

    def function(k, scope, position, incoming, normal, smooth_normal, face_normal, roughness, random=None):
        own = k.select(k.dot(normal, normal) > 0.25, k.normalize(normal), smooth_normal)
        direction, cosine = mirror_ray(k, incoming, own, face_normal)
        added = k.name("added", ROUGHNESS_SPREAD * roughness * roughness)
        spread = added
        if drawn:
            # The normal of the mirror ray as it is, lifted or not: half way to the viewer.
            direction, spread = ray_of_lobe(k, scope, direction, k.normalize(direction + incoming), added, random)
        hit = trace(k, scope, Ray(position, direction, k.name("width", 0.0), spread))
        away = k.min(k.length(hit.position - position), spaces.FAR)
        return {"radiance": hit.radiance, "distance": away, "coverage": hit.coverage, "cosine": cosine, "position": hit.position}

    return record_function(function, INPUTS | RANDOM if drawn else INPUTS, asset.images, asset.uniforms, asset.options, name)
