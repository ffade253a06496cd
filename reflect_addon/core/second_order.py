"""Second-order reflections and further ones, for any stand-in with normals [popescu-2006 section 3 and 3.1, steps 2 to 5].

Problem. A mirror that is seen in a mirror is not a picture: what it shows depends on where it is looked at from.
Idea. The stand-ins of other reflectors carry normals. A reflected ray that meets one of them first goes on as a tertiary
ray, which looks among the diffuse stand-ins only and else into the environment map. With D diffuse and R reflective
stand-ins in the scene that costs 2 D + R - 1 intersections: the reflector itself is not among those that it looks at.
Where we depart. What the reflective one shows has two parts: its own light, from its texel, and the tertiary ray's,
times the reflectance of its material at that angle (shading.py). The tertiary ray carries its footprint on: as wide as
it was where it hit, growing by twice the change of the normal across it and by the lobe of a rough surface.
It starts on the surface that stands at a reflective quad, not on the quad (mirror_surface.py).
Orders of three and more are what the paper leaves open. settings["order"]: up to that order the tertiary ray looks among
the reflective rows as well, and goes on from there in a loop; only the last one passes through mirrors.
A reflector that is flat all over has rows of itself, as lit: its own rays never meet them, a mirror's do. (The paper: no ray meets it.)
Limits. Mirrors do not show mirrors past that order. Where another reflector has no rows of itself a mirror's ray passes through it.

Rows of `billboard_buf`: the `count` = D diffuse ones, then the `mirrors` = R - 1 reflective ones. The position that is
reported is the first hit: the place in the mirror that the eye looks at.
"""

from . import billboard_kernel, moved_rows, spaces
from .billboard_kernel import fetch
from .hit_shading import shaded
from .kernel import Hit, Ray
from .mirror_surface import surface_at
from .row_search import ALL, Among
from .shading import REFLECTANCE_INPUTS, reflectance

# Reflections that 3.1 computes: a mirror's rays go on once. settings["order"], where it is not given.
PAPERS_ORDER = 2
# Radians per metre: above it a footprint covers the half space.
WIDEST = 2.0

MIRROR_INPUTS = {**REFLECTANCE_INPUTS, "share": "float"}


def answer(k, asset, ray, nearest, backdrop) -> Hit:
    """What the ray sees of the asset's stand-ins and their mirrors.

    nearest(k, asset, ray, start, among) -> (distance m, row, u, v): the nearest row among those (row_search.Among) that the ray meets;
    distance FAR where it meets none; start: vec3, its origin relative to the asset's centre.
    backdrop(k, asset, ray, start) -> (radiance, position, status): what it sees where it meets none.
    asset.options: count, mirrors, glossy (how many of the last diffuse rows are shaded at the hit: view_dependent.py), lamps (how many before
    these are lamps), and where there are such or mirrors order, partly (some mirror only in part), relief (nearest says where a flat
    stand-in is met, and the surface lies at the heights of normal_tx above it), has_metal, has_dielectric.
    """
    diffuse, mirrors, glossy = (asset.options[name] for name in ("count", "mirrors", "glossy"))
    asset = moved_rows.in_motion(k, asset)
    start = k.name("start", ray.origin - asset.uniforms["center"])
    if not diffuse + mirrors:  # a scene without other objects has no loop
        radiance, position, status = backdrop(k, asset, ray, start)
        return Hit(radiance, position, 1.0, status)
    k.cite("popescu-2006 3.1 step 2: intersect r with all billboards")
    first = nearest(k, asset, ray, start, ALL)
    last_ray, last_start, last = ray, start, first
    if mirrors + glossy:
        in_mirror = k.name("in_mirror", _goes_on(asset, *first[:2]))
        own, share, place, off, last_ray, last_start, last = _beyond_the_mirrors(k, asset, ray, start, first, in_mirror, nearest)

    def texel():
        k.cite("popescu-2006 3.1 step 4: return the intersection texel")
        radiance = billboard_kernel.radiance(k, asset, last_ray, *last)
        return radiance, last_ray.origin + last_ray.direction * last[0], spaces.STATUS_HIT

    def miss():
        k.cite("popescu-2006 3.1 step 3: if no intersection return EM(r)")
        return backdrop(k, asset, last_ray, last_start)

    radiance, position, status = k.branch(last[0] < spaces.FAR, texel, miss)
    if _caps_sky(asset):
        came_off_gloss = (off >= diffuse - glossy - 0.5) & (off < diffuse - 0.5)
        radiance = k.select(came_off_gloss, k.min(radiance, asset.uniforms["sky_brightest"]), radiance)
    if mirrors + glossy:
        radiance = own + share * radiance
        position = k.select(in_mirror, place, position)
        status = k.select(in_mirror, spaces.STATUS_HIT, status)
    return Hit(radiance, position, 1.0, status)


def _goes_on(asset, distance, row):
    """Whether what was met mirrors or is glossy."""
    return (distance < spaces.FAR) & (row >= asset.options["count"] - asset.options["glossy"] - 0.5)


def _caps_sky(asset) -> bool:
    """Whether a glossy surface has the sun's light from its lobe already and must not see it in the sky once more."""
    return bool(asset.options["glossy"] and asset.options["suns"])


def _beyond_the_mirrors(k, asset, ray, start, first, in_mirror, nearest):
    """(the stand-ins' own light, share of what comes last, place of the first mirror's surface, row that the last ray came
    off, the ray to look along, its start, what that meets). For a ray that meets no mirror: nothing, all, -1, the ray
    itself and what it meets. The row is None where nobody asks.

    The second order is written out: loops of one step are not free where loops are unrolled.
    """
    order = asset.options["order"]

    asks = _caps_sky(asset)

    def go_on(again, is_first, own, share, place, *state):
        (origin, direction, width, spread, last_start, *last) = state[asks:]
        arrived = Ray(origin, direction, width, spread)
        glow, kept, *onward = _mirrored(k, asset, arrived, last_start, last, nearest, again)
        place = onward[0] if is_first is True else k.select(is_first, onward[0], place)
        return k.name("own", own + share * glow), k.name("share", share * kept), place, *last[1:2][:asks], *onward

    here = (ray.origin, ray.direction, ray.width, ray.spread, start, *first)
    unmirrored = (k.vec3(0.0), k.vec3(1.0), ray.origin, *(-1.0,) * asks, *here)
    if order == 2:
        state = k.branch(
            in_mirror, lambda: go_on(False, True, *unmirrored), lambda: unmirrored
        )
    else:
        k.cite("popescu-2006 3.1 step 5 again for each further order; the last tertiary ray looks among what is only lit")

        def step(i, *before):
            mirror = _goes_on(asset, *before[-4:-2])
            went = k.branch(mirror, lambda: go_on(i < order - 2.5, i < 0.5, *before), lambda: before)
            return went, ~mirror

        state = k.loop(order - 1, unmirrored, step)
    own, share, place, *state = state
    off = state.pop(0) if asks else None
    origin, direction, width, spread, last_start, *last = state
    return own, share, place, off, Ray(origin, direction, width, spread), last_start, last


def _mirrored(k, asset, ray, start, met, nearest, again):
    """(the stand-in's own light, share of what comes next, the tertiary ray's origin, direction, width, spread and start,
    what it meets) of a ray that has met a mirror. again: whether it looks among mirrors, True, False or a bool of the kernel.
    """
    distance, row, u, v = met
    options = asset.options
    k.cite("popescu-2006 3.1 step 5a: compute the tertiary ray rr")
    surface = surface_at(k, asset, ray, met)
    base, tint, placed = (fetch(k, asset, name, row) for name in ("base", "tint", "normals"))
    toward = k.name("toward", k.dot(ray.direction, surface.normal))
    # A quad may be met at an angle at which the surface there would turn its back: it is at grazing.
    bent = k.normalize(ray.direction - surface.normal * (2.0 * k.min(toward, 0.0)))
    spread = k.sqrt(ray.spread * ray.spread + 4.0 * surface.turn * surface.turn + placed.w * placed.w)
    step = k.name("step", ray.direction * surface.distance)
    tertiary = Ray(
        k.name("tertiary_origin", ray.origin + step),
        k.name("tertiary_direction", bent),
        k.name("tertiary_width", ray.width + ray.spread * surface.distance),
        k.name("tertiary_spread", k.min(spread, WIDEST)),
    )
    terms = mirror_terms(k, asset, -toward, base.xyz, base.w, tint.xyz, tint.w, placed.z, surface.share)
    if options["glossy"]:
        own = shaded(k, asset, ray, row, surface, start + step, terms["kept"])
    else:
        own = billboard_kernel.radiance(k, asset, ray, distance, row, surface.u, surface.v) * terms["kept"]
    k.cite("popescu-2006 3.1 step 5b: intersect rr with the D diffuse billboards")
    tertiary_start = k.name("tertiary_start", start + step)
    found = nearest(k, asset, tertiary, tertiary_start, _tertiary_among(asset, row, again))
    return (
        own, terms["reflectance"], tertiary.origin, tertiary.direction, tertiary.width, tertiary.spread, tertiary_start, *found
    )  # fmt: skip


def _tertiary_among(asset, row, again) -> Among:
    """A mirror's ray looks at all diffuse stand-ins, and at mirrors if it goes on again; a glossy one's neither at the lamps, whose
    light it has, nor at mirrors, and of what is glossy only at the quads, as they were captured: it starts on a depth map, whose hit it
    would be, and never meets a quad that it starts on."""
    count, mirrors, glossy = (asset.options[name] for name in ("count", "mirrors", "glossy"))
    if not glossy:
        return Among(True, True, True, again)
    if not mirrors:
        return Among(False, True, False, False)
    off_mirror = row > count - 0.5
    return Among(off_mirror, True, off_mirror, again is not False and off_mirror & again)


def mirror_terms(k, scope, cosine, base_color, metallic, specular_tint, ior, weight, share):
    """{'reflectance': vec3, 'kept': float} of a surface that mirrors in `share` of it: what its mirror adds of the ray's
    radiance, and what the mirror leaves of the light of the surface below it, which a metal does not have."""
    terms = reflectance(k, scope, cosine, base_color, metallic, specular_tint, ior, weight)
    covered = k.max(terms["opacity"] - metallic * weight, 0.0)
    return {"reflectance": terms["reflectance"] * share, "kept": 1.0 - covered * share}
