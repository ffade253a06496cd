"""Billboards as kernel functions: the nearest quad that a ray meets, and its colour there [popescu-2006 3.1, steps 2, 4].

Every method whose stand-ins include quads records these. The table and the atlas are billboard_atlas's.
"""

from . import moved_rows, spaces
from .billboard_atlas import ROW
from .cubemap import blend_levels
from .row_search import each_row

# Alpha above which a texel is the object: half, so that bilinear contours lie where the object's edge lies.
SOLID = 0.5
# Below it the ratio of premultiplied radiance and alpha is no colour.
LEAST_ALPHA = 1e-3

NOTHING = (spaces.FAR, 0.0, 0.0, 0.0)  # the record of a ray that meets nothing


def nearest(k, asset, ray, start, rows, before=NOTHING):
    """(distance m, row, u, v) of the nearest quad that the ray meets among `rows`, a list of row_search.Span, or `before` where that is nearer;
    distance FAR where it meets none.

    start: vec3, the ray's origin relative to the asset's centre. asset.options: contours (alpha matters).
    """
    return each_row(k, asset, rows, before, lambda of, i, found: _meet(k, of, ray, start, i, found))


def texel(k, asset, ray, distance, row, u, v):
    """vec4: premultiplied radiance / billboard_scale and alpha of row `row` at u, v, from the level that is as coarse as
    the ray's footprint there."""
    place, detail = fetch(k, asset, "place", row), fetch(k, asset, "detail", row)
    level = level_of(k, ray, distance, detail)
    return blend_levels(k, level, detail.x, lambda i: sample(k, asset.images["billboard_tx"], place, i, u, v))


def radiance(k, asset, ray, distance, row, u, v):
    """vec3: what row `row` shows at u, v."""
    return colour_of(k, asset, texel(k, asset, ray, distance, row, u, v))


def colour_of(k, asset, texel):
    """vec3: radiance of a premultiplied texel."""
    return k.name("billboard_radiance", texel.xyz * (asset.uniforms["billboard_scale"] / k.max(texel.w, LEAST_ALPHA)))


def _meet(k, asset, ray, start, i, before):
    """One step of the loop: (distance, row, u, v) of the nearest billboard so far, this one being row i.

    One fetch for a quad that cannot be met, three for one that is met; more only at a contour.
    """
    distance = before[0]
    plane = k.name("plane", fetch(k, asset, "plane", i))
    facing = k.name("facing", k.dot(ray.direction, plane.xyz))
    # One-sided: a ray from behind, or along the plane, does not see it.
    t = k.name("t", (k.dot(start, plane.xyz) - plane.w) / k.max(-facing, 1e-20))

    def in_plane():
        axis_u, axis_v = fetch(k, asset, "u", i), fetch(k, asset, "v", i)
        p = k.name("in_plane", start + ray.direction * t)
        u, v = k.name("u", k.dot(p, axis_u.xyz) + axis_u.w), k.name("v", k.dot(p, axis_v.xyz) + axis_v.w)
        inside = (k.abs(u) <= 1.0) & (k.abs(v) <= 1.0)
        met = (t, i, u, v)
        if not asset.options["contours"]:
            return tuple(k.select(inside, new, old) for new, old in zip(met, before, strict=True))
        return k.branch(inside, lambda: _within_contour(k, asset, ray, i, met, before), lambda: before)

    return k.branch((facing < 0.0) & (t > 0.0) & (t < distance), in_plane, lambda: before)


def _within_contour(k, asset, ray, i, met, before):
    """`met` where the billboard's alpha says that the object is there, else `before`."""
    t, _, u, v = met
    detail = k.name("detail", fetch(k, asset, "detail", i))

    def alpha():
        place = fetch(k, asset, "place", i)
        # The finer of the two levels that its colour is blended from.
        level = k.floor(level_of(k, ray, t, detail))
        return (sample(k, asset.images["billboard_tx"], place, level, u, v).w,)

    solid = k.branch(detail.z > 0.5, lambda: (1.0,), alpha)[0] >= SOLID
    return tuple(k.select(solid, new, old) for new, old in zip(met, before, strict=True))


def fetch(k, asset, field: str, row):
    """vec4: one column (billboard_atlas.ROW) of the table, where what the row stands for is now."""
    return moved_rows.moved(k, asset, field, row, k.fetch(asset.images["billboard_buf"], float(ROW[field]), row))


def level_of(k, ray, distance, detail):
    """Level whose texels are as wide as the ray's footprint."""
    footprint = (ray.width + ray.spread * distance) * detail.y
    return k.name("level", k.min(k.log2(k.max(footprint, 1.0)), detail.x))


def sample(k, image, place, level, u, v):
    """Bilinear texel of one level of one row's block; see billboard_atlas for where levels lie."""
    width, height = place.z, place.w
    across, up = (u * 0.5 + 0.5) * width, (v * 0.5 + 0.5) * height
    above = level >= 1.0
    scale = k.name("level_scale", k.select(above, k.exp2(-level), 1.0))
    x = place.x + k.select(above, width + 2.0, 0.0)
    y = place.y + k.select(above, height * (1.0 - 2.0 * scale) + 2.0 * (level - 1.0), 0.0)
    return k.sample(image, x + across * scale, y + up * scale)
