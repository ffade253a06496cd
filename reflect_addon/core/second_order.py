"""Second-order reflections, for any stand-in with normals [popescu-2006 section 3 and 3.1, steps 2 to 5].

Problem. A mirror that is seen in a mirror is not a picture: what it shows depends on where it is looked at from.
Idea. The stand-ins of other reflectors carry normals. A reflected ray that meets one of them first goes on as a tertiary
ray, which looks among the diffuse stand-ins only and else into the environment map. With D diffuse and R reflective
stand-ins in the scene that costs 2 D + R - 1 intersections: the reflector itself is not among those that it looks at.
Where we depart. What the reflective one shows has two parts: its own light, from its texel, and the tertiary ray's,
times the reflectance of its material at that angle (shading.py). The tertiary ray carries its footprint on: as wide as
it was where it hit, growing by twice the change of the normal across it and by the lobe of a rough surface.
Limits. Mirrors do not show mirrors in mirrors: the tertiary ray passes through other reflectors, and through the one
that it started on. The tertiary ray starts on the stand-in, a flat one for a volume seen as a quad, not on the surface.

Rows of `billboard_buf`: the `count` = D diffuse ones, then the `mirrors` = R - 1 reflective ones. The position that is
reported is the first hit: the place in the mirror that the eye looks at.
"""

from . import billboard_kernel, spaces
from .billboard_kernel import fetch
from .cubemap import blend_levels
from .kernel import Hit, Ray
from .shading import REFLECTANCE_INPUTS, reflectance

# Radians per metre: above it a footprint covers the half space.
WIDEST = 2.0

MIRROR_INPUTS = {**REFLECTANCE_INPUTS, "share": "float"}


def answer(k, asset, ray, nearest, backdrop) -> Hit:
    """What the ray sees of the asset's stand-ins and their mirrors.

    nearest(k, asset, ray, start, first, last) -> (distance m, row, u, v): the first of the rows `first` to before `last`
    that the ray meets, distance FAR where it meets none; start: vec3, its origin relative to the asset's centre.
    backdrop(k, asset, ray, start) -> (radiance, position): what it sees where it meets none.
    asset.options: count, mirrors, and for mirrors > 0 partly (some mirror only in part), has_metal, has_dielectric.
    """
    diffuse, mirrors = asset.options["count"], asset.options["mirrors"]
    start = k.name("start", ray.origin - asset.uniforms["center"])
    if not diffuse + mirrors:  # a scene without other objects has no loop
        radiance, position = backdrop(k, asset, ray, start)
        return Hit(radiance, position, 1.0, spaces.STATUS_FELL_BACK)
    k.cite("popescu-2006 3.1 step 2: intersect r with all billboards")
    first = nearest(k, asset, ray, start, 0, diffuse + mirrors)
    last_ray, last_start, last = ray, start, first
    if mirrors:
        in_mirror = k.name("in_mirror", (first[0] < spaces.FAR) & (first[1] >= diffuse - 0.5))
        own, share, last_ray, last_start, last = _beyond_the_mirror(k, asset, ray, start, first, in_mirror, nearest)

    def texel():
        k.cite("popescu-2006 3.1 step 4: return the intersection texel")
        radiance = billboard_kernel.radiance(k, asset, last_ray, *last)
        return radiance, last_ray.origin + last_ray.direction * last[0], spaces.STATUS_HIT

    def miss():
        k.cite("popescu-2006 3.1 step 3: if no intersection return EM(r)")
        return *backdrop(k, asset, last_ray, last_start), spaces.STATUS_FELL_BACK

    radiance, position, status = k.branch(last[0] < spaces.FAR, texel, miss)
    if mirrors:
        radiance = own + share * radiance
        position = k.select(in_mirror, ray.origin + ray.direction * first[0], position)
        status = k.select(in_mirror, spaces.STATUS_HIT, status)
    return Hit(radiance, position, 1.0, status)


def _beyond_the_mirror(k, asset, ray, start, first, in_mirror, nearest):
    """(the stand-in's own light, share of what comes next, the ray to look along, its start, what that meets).

    For a ray that meets no mirror: nothing, all, the ray itself and what it meets.
    """
    distance, row, u, v = first

    def mirrored():
        k.cite("popescu-2006 3.1 step 5a: compute the tertiary ray rr")
        normal, turn, mirroring = _normal(k, asset, ray, distance, row, u, v)
        base, tint, placed = (fetch(k, asset, name, row) for name in ("base", "tint", "normals"))
        toward = k.name("toward", k.dot(ray.direction, normal))
        # A quad may be met at an angle at which the surface there would turn its back: it is at grazing.
        bent = k.normalize(ray.direction - normal * (2.0 * k.min(toward, 0.0)))
        spread = k.sqrt(ray.spread * ray.spread + 4.0 * turn * turn + placed.w * placed.w)
        step = k.name("step", ray.direction * distance)
        tertiary = Ray(
            k.name("tertiary_origin", ray.origin + step),
            k.name("tertiary_direction", bent),
            k.name("tertiary_width", ray.width + ray.spread * distance),
            k.name("tertiary_spread", k.min(spread, WIDEST)),
        )
        tertiary_start = k.name("tertiary_start", start + step)
        texel = billboard_kernel.texel(k, asset, ray, *first)
        share = 1.0
        if asset.options["partly"]:
            share = k.clamp(mirroring / k.max(texel.w, billboard_kernel.LEAST_ALPHA), 0.0, 1.0)
        terms = mirror_terms(k, asset, -toward, base.xyz, base.w, tint.xyz, tint.w, placed.z, share)
        own = billboard_kernel.colour_of(k, asset, texel) * terms["kept"]
        k.cite("popescu-2006 3.1 step 5b: intersect rr with the D diffuse billboards")
        met = nearest(k, asset, tertiary, tertiary_start, 0, asset.options["count"])
        return (
            k.name("own", own), k.name("share", terms["reflectance"]), tertiary.origin, tertiary.direction,
            tertiary.width, tertiary.spread, tertiary_start, *(met),
        )  # fmt: skip

    def unmirrored():
        return k.vec3(0.0), k.vec3(1.0), ray.origin, ray.direction, ray.width, ray.spread, start, *first

    own, share, origin, direction, width, spread, last_start, *last = k.branch(in_mirror, mirrored, unmirrored)
    return own, share, Ray(origin, direction, width, spread), last_start, last


def _normal(k, asset, ray, distance, row, u, v):
    """(unit normal, its change across the ray's footprint in radians, alpha times the share that mirrors)."""
    image, placed, detail = asset.images["normal_tx"], fetch(k, asset, "normals", row), fetch(k, asset, "detail", row)
    size = fetch(k, asset, "place", row)
    place = k.vec4(placed.xy, size.zw)
    level = billboard_kernel.level_of(k, ray, distance, detail)
    texel = blend_levels(k, level, detail.x, lambda i: billboard_kernel.sample(k, image, place, i, u, v))
    normal = k.name("mirror_normal", k.normalize(texel.xyz))
    # Differences over one texel of the nearest level, towards the middle, where the quad goes on. Not the level's floor:
    # logarithms round differently on graphics cards, and footprints of whole texels are the usual ones.
    whole = k.floor(level + 0.5)
    texels = k.exp2(-whole)
    step = k.vec2(2.0, 2.0) / (size.zw * texels)
    across = u + k.select(u > 0.0, -step.x, step.x)
    along = v + k.select(v > 0.0, -step.y, step.y)

    def turned(at_u, at_v):
        other = billboard_kernel.sample(k, image, place, whole, at_u, at_v)
        here = billboard_kernel.sample(k, image, place, whole, u, v)
        change = k.normalize(other.xyz) - k.normalize(here.xyz)
        # Past the contour there is no normal.
        return k.select(k.dot(other.xyz, other.xyz) > billboard_kernel.LEAST_ALPHA, k.dot(change, change), 0.0)

    change = k.sqrt(0.5 * (turned(across, v) + turned(u, along)))
    footprint = (ray.width + ray.spread * distance) * detail.y * texels
    return normal, k.name("turn", change * footprint), texel.w


def mirror_terms(k, scope, cosine, base_color, metallic, specular_tint, ior, weight, share):
    """{'reflectance': vec3, 'kept': float} of a surface that mirrors in `share` of it: what its mirror adds of the ray's
    radiance, and what the mirror leaves of the light of the surface below it, which a metal does not have."""
    terms = reflectance(k, scope, cosine, base_color, metallic, specular_tint, ior, weight)
    covered = k.max(terms["opacity"] - metallic * weight, 0.0)
    return {"reflectance": terms["reflectance"] * share, "kept": 1.0 - covered * share}
