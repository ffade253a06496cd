"""Kernel of shading at the hit: a glossy stand-in's own light and its highlights, seen by the reflected ray.

view_dependent.py says what it is for, and makes the images: `own_tx` and `seen_tx`, blocks in the places of
`normal_tx`, and the table of lamps. In a scene with glossy stand-ins mirrors have their own light in `own_tx` too, so
that one look-up serves both.
"""

from . import billboard_kernel
from .billboard_kernel import fetch
from .cubemap import blend_levels
from .lobe import lamp_light

# alpha is roughness squared; a row has the spread, 4 alpha (shading.roughness_spread).
ALPHA = 0.25


def shaded(k, asset, ray, row, surface, start, kept):
    """vec3: the light of row `row` of its own and, of a glossy one, what its lobe shows of the lamps.

    surface: mirror_surface.py's, where the ray meets it; start: vec3, that place from the asset's centre; kept: float, what its
    lobe leaves of the light below."""
    detail, place, placed = (fetch(k, asset, name, row) for name in ("detail", "place", "normals"))
    block, level = k.vec4(placed.xy, place.zw), billboard_kernel.level_of(k, ray, surface.distance, detail)

    def look(name):
        image = asset.images[name]
        return blend_levels(k, level, detail.x, lambda i: billboard_kernel.sample(k, image, block, i, surface.u, surface.v))

    own_texel = look("own_tx")
    own = billboard_kernel.colour_of(k, asset, own_texel) * kept
    if not asset.options["lamp_count"]:
        return own

    def lit():
        base, tint = (fetch(k, asset, name, row) for name in ("base", "tint"))
        material = {
            "base_color": base.xyz, "metallic": base.w, "specular_tint": tint.xyz, "ior": tint.w,
            "weight": placed.z * surface.share,
        }  # fmt: skip
        reaching = look("seen_tx") / k.max(own_texel.w, billboard_kernel.LEAST_ALPHA)
        return (own + highlights(k, asset, -ray.direction, start, surface.normal, placed.w * ALPHA, reaching, material),)

    if not asset.options["mirrors"]:
        return lit()[0]
    k.cite("a mirror's tertiary ray meets the lamps themselves")
    return k.branch(row < asset.options["count"] - 0.5, lit, lambda: (own,))[0]


def highlights(k, asset, toward, point, normal, alpha, reaching, material):
    """vec3: what the lobe shows of the lamps. toward: unit, to the eye; point: vec3 from the asset's centre; reaching: vec4,
    the shares of the lamps that reach it; material: shading.reflectance's arguments but the cosine."""
    image = asset.images["lamp_buf"]

    def one(i, light):
        center, u, v, radiance = (k.fetch(image, float(column), i) for column in range(4))
        to, u, v = k.name("to_lamp", center.xyz - point), u.xyz, v.xyz
        if asset.options["ball_lamps"]:
            u, v = _turned(k, center.w > 0.5, to, u, v)
        share = k.select(
            i < 1.5, k.select(i < 0.5, reaching.x, reaching.y), k.select(i < 2.5, reaching.z, reaching.w)
        )
        added = lamp_light(k, asset, toward, normal, alpha, (to, u, v), material) * radiance.xyz * share
        return (light + added,), None

    return k.loop(asset.options["lamp_count"], (k.vec3(0.0),), one)[0]


def _turned(k, is_ball, to, u, v):
    """The half sides of a lamp; a ball's are turned to where it is seen from, as view_dependent.Lamp.seen_from turns them."""
    z = k.normalize(to)
    side = k.select(k.abs(z.z) < 0.9, k.vec3(0.0, 0.0, 1.0), k.vec3(1.0, 0.0, 0.0))
    ball_u = k.normalize(k.cross(side, z)) * k.length(u)
    return k.select(is_ball, ball_u, u), k.select(is_ball, k.cross(ball_u, z), v)
