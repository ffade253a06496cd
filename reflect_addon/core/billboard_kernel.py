"""Billboards as kernel functions: the nearest quad that a ray meets, and its colour there [popescu-2006 3.1, steps 2, 4].

Every method whose stand-ins include quads records these. The table and the atlas are billboard_atlas's.
"""

from functools import partial

from . import moved_rows, spaces
from .billboard_atlas import ROW
from .cubemap import blend_levels

# Alpha above which a texel is the object: half, so that bilinear contours lie where the object's edge lies.
SOLID = 0.5
# Below it the ratio of premultiplied radiance and alpha is no colour.
LEAST_ALPHA = 1e-3
# Rows that are chosen from at once, as bits of a number: the logarithms of 2**AT_ONCE - 0.5 and + 0.5 differ by 1e-3, and graphics
# cards' are good to 1e-5.
AT_ONCE = 10

NOTHING = (spaces.FAR, 0.0, 0.0, 0.0)  # the record of a ray that meets nothing


def nearest(k, asset, ray, start, first: int, last: int, before=NOTHING):
    """(distance m, row, u, v) of the nearest of the quads `first` to before `last` that the ray meets, or `before` where
    that is nearer; distance FAR where it meets none.

    start: vec3, the ray's origin relative to the asset's centre. asset.options: contours (alpha matters).
    """
    if first == last:
        return before
    return each_row(k, asset, first, last, before, lambda of, i, found: _meet(k, of, ray, start, i, found))


def each_row(k, asset, first: int, last: int, before, meet, may=None):
    """The record after meet(asset, row, record) of the rows `first` to before `last`, in their order.

    may(asset, row, distance) -> bool: whether a row can be met before that distance; cheap, and looked at for all rows first, so that `meet`
    is not a step of the loop where it cannot be. For a `meet` that is not cheap itself."""
    for of, low, high in moved_rows.runs(asset, first, last):
        visit = _alike if may is None or high - low == 1 else partial(_chosen, may=may)
        before = visit(k, of, low, high, before, meet)
    return before


def _alike(k, asset, first: int, last: int, before, meet):
    """each_row of rows that move alike."""
    return k.loop(last - first, before, lambda i, distance, row, u, v: (meet(asset, i + float(first), (distance, row, u, v)), None))


def _chosen(k, asset, first: int, last: int, before, meet, may):
    """_alike of the rows that may be met: AT_ONCE rows are bits of a number, the first one its highest."""
    highest = 2.0 ** (AT_ONCE - 1)

    def some(batch, distance, row, u, v):
        low = k.name("low", batch * float(AT_ONCE) + float(first))

        def look(i, chosen, many, bit):
            met = may(asset, low + i, distance)
            return (chosen + k.select(met, bit, 0.0), many + k.select(met, 1.0, 0.0), bit * 0.5), None

        rows = min(AT_ONCE, last - first)
        chosen, many, _ = k.loop(float(rows) if rows == last - first else k.min(float(last) - low, float(rows)), (0.0, 0.0, highest), look)

        def visit(_, left, distance, row, u, v):
            # Half a bit more: a logarithm of a power of two may be a little too small.
            bit = k.name("bit", k.floor(k.log2(left + 0.5)))
            met = meet(asset, low + (AT_ONCE - 1.0 - bit), (distance, row, u, v))
            return (left - k.floor(k.exp2(bit) + 0.5), *met), None

        return tuple(k.loop(k.min(many, float(rows)), (chosen, distance, row, u, v), visit)[1:]), None

    batches = -(-(last - first) // AT_ONCE)
    return some(0.0, *before)[0] if batches == 1 else k.loop(batches, before, some)


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
