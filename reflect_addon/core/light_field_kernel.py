"""Light-field slabs as kernel functions: the slabs, the four views and the texels of a ray [yu-2005 sections 4 to 6].

Every length along a slab's axes b and c, the two after its own. Depths are stored as q = 1 / z, z the distance in m from the
camera plane along the slab's axis, over `depth_scale`; 0 is the sky, below 0 what was not traced.

Seams. A ray belongs to the slab of its largest component; where a second one comes within BAND of it, that slab is asked too
and counts the more the nearer they are, so that nothing jumps from slab to slab. Rays elsewhere pay four look-ups, as the
paper's do.
"""

from . import hdr_code, spaces
from .light_field import FIRST, MARGIN

# Share of the largest component from which on another slab is asked: its views end at slopes of 1 + MARGIN.
BAND = MARGIN / (1 + MARGIN)
# Fixed-point steps from a ray's guessed depth to each view's own.
DEPTH_STEPS = 2
# Difference of depth, over the depth itself, at which a view counts half of one that agrees.
AGREE = 0.02
# How far a view's line to what the ray meets may miss the cell, over the cell's size, when it counts half of one through it: a
# view beside the cell may stand behind a wall.
BESIDE = 0.02


def answer(k, asset, ray):
    """(radiance, position, coverage) of a ray from inside the cell; coverage 0 where its slab was left out.

    asset.options: views, texels, columns (of slabs), depth (views have depths), coded (radiance is hdr_code's). asset.uniforms: Cell.uniforms,
    `focus` (1/m: 1 / z of the focal plane, vec3 by axis for the slabs of + and `focus_back` for those of -), light_scale."""
    u = asset.uniforms
    start = k.name("cell_start", ray.origin - u["cell_center"])
    weighted = k.name("weighted", k.abs(ray.direction) * u["cell_weight"])
    k.cite("yu-2005 5: the slab of the largest absolute component; here others near it, too")
    largest = k.name("largest", k.max(weighted.x, weighted.y, weighted.z, 1e-30))
    first, second, third = _by_size(k, weighted)

    def share_of(axis):
        return k.clamp((_component(k, axis, weighted) / largest - (1.0 - BAND)) * (1.0 / BAND), 0.0, 1.0)

    def of_rank(rank, radiance, distance, total):
        # Rays side by side take their largest component together, whichever it is, and few go on from there.
        axis = k.name("axis", k.select(rank < 0.5, first, k.select(rank < 1.5, second, third)))
        share, following = share_of(axis), k.select(rank < 0.5, share_of(second), k.select(rank < 1.5, share_of(third), 0.0))
        back = _component(k, axis, ray.direction) < 0.0
        place = k.select(back, _component(k, axis, u["slab_place_back"]), _component(k, axis, u["slab_place"]))
        asked = (share > 0.0) & (place > -0.5)

        def look():
            slab = _slab(k, asset, ray, start, axis, back, place)
            seen, q = (_corrected if asset.options["depth"] else _focused)(k, asset, slab)
            along = k.select(q > 0.0, k.min(1.0 / k.max(q, 1e-30), spaces.FAR), spaces.FAR)
            # From the camera plane to the ray's own start, in units of the ray's length.
            found = k.min(k.max((along - slab.depth) * slab.length, 0.0), spaces.FAR)
            # The place is the one that the slab of the largest component sees.
            return radiance + seen * share, k.select(rank < 0.5, found, distance), total + share

        return k.branch(asked, look, lambda: (radiance, distance, total)), following <= 0.0

    radiance, distance, total = k.loop(3, (k.vec3(0.0), 0.0, 0.0), of_rank)
    covered = total > 0.0
    radiance = k.name("slab_radiance", radiance * (1.0 / k.max(total, 1e-6)))
    return radiance, ray.origin + ray.direction * distance, k.select(covered, 1.0, 0.0)


class _Slab:
    """One ray in one slab: see _slab."""

    def __init__(self, **fields):
        self.__dict__.update(fields)


def _by_size(k, v):
    """The axes of a vec3's largest, middle and smallest component, three different ones also where components are equal."""
    first = k.select((v.x >= v.y) & (v.x >= v.z), 0.0, k.select(v.y >= v.z, 1.0, 2.0))
    third = k.select((v.z <= v.x) & (v.z <= v.y), 2.0, k.select(v.y <= v.x, 1.0, 0.0))
    return first, 3.0 - first - third, third


def _component(k, axis, v):
    """A vec3's component of an axis 0, 1 or 2."""
    return k.select(axis < 0.5, v.x, k.select(axis < 1.5, v.y, v.z))


def _slab(k, asset, ray, start, axis, back, place):
    u = asset.uniforms

    def of(v):
        """(own, b, c) components of a vec3 in the slab's axes."""
        x, y = axis < 0.5, axis < 1.5
        return tuple(k.select(x, i, k.select(y, j, l)) for i, j, l in ((v.x, v.y, v.z), (v.y, v.z, v.x), (v.z, v.x, v.y)))

    def by_axis(v):
        return _component(k, axis, v)

    (da, db, dc), (pa, pb, pc), (half, half_b, half_c) = of(ray.direction), of(start), of(u["cell_half"])
    per = k.name("per_axis", 1.0 / k.max(k.abs(da), 1e-20))
    k.cite("yu-2005 eq. 4: where the ray's line meets the camera plane, here the far side of the cell")
    depth = k.name("depth", half + k.select(back, -pa, pa))
    slope_b, slope_c = k.name("slope_b", db * per), k.name("slope_c", dc * per)
    n, m = float(asset.options["views"] - 1), float(asset.options["texels"] - 1)
    k.cite("yu-2005 eq. 1: view and texel")
    side_b, side_c = by_axis(u["slab_side_b"]), by_axis(u["slab_side_c"])
    s = k.name("s", k.clamp(((pb - slope_b * depth) / side_b + 1.0) * (0.5 * n), 0.0, n))
    t = k.name("t", k.clamp(((pc - slope_c * depth) / side_c + 1.0) * (0.5 * n), 0.0, n))
    s0, t0 = k.name("s0", k.min(k.floor(s), n - 1.0)), k.name("t0", k.min(k.floor(t), n - 1.0))
    reach_b, reach_c = by_axis(u["slab_slope_b"]), by_axis(u["slab_slope_c"])
    columns = float(asset.options["columns"])
    row = k.floor((place + 0.5) * (1.0 / columns))
    width = float(asset.options["views"] * asset.options["texels"])
    return _Slab(
        u=k.name("u", (slope_b / reach_b + 1.0) * (0.5 * m)),
        v=k.name("v", (slope_c / reach_c + 1.0) * (0.5 * m)),
        s=s, t=t, depth=depth, length=per, fs=s - s0, ft=t - t0,
        along=((side_b * (2.0 / n), s, slope_b, half_b), (side_c * (2.0 / n), t, slope_c, half_c)), half=half, middle=0.5 * n,
        corners=[(s0 + i, t0 + j) for j in (0.0, 1.0) for i in (0.0, 1.0)],
        # Texels that what lies at 1 / z = 1 moves from one view to the next.
        move_b=k.name("move_b", side_b * (2.0 / n) / reach_b * (0.5 * m)),
        move_c=k.name("move_c", side_c * (2.0 / n) / reach_c * (0.5 * m)),
        x=(place - row * columns) * width, y=row * width, place=place,
        focus=k.name("focus", k.select(back, by_axis(u["focus_back"]), by_axis(u["focus"]))),
    )  # fmt: skip


def _place(k, asset, slab, corner, q):
    """vec2: texel coordinates in the atlas of the ray's point at 1 / z = q as a view sees it; eq. (6) with q as disparity."""
    texels = float(asset.options["texels"])
    at_u = k.clamp(slab.u + q * slab.move_b * (slab.s - corner[0]), 0.0, texels - 1.0)
    at_v = k.clamp(slab.v + q * slab.move_c * (slab.t - corner[1]), 0.0, texels - 1.0)
    return k.vec2(slab.x + corner[0] * texels + at_u + 0.5, slab.y + corner[1] * texels + at_v + 0.5)


def _look(k, asset, slab, corner, q):
    """vec3: radiance."""
    at = _place(k, asset, slab, corner, q)
    if asset.options["coded"]:
        first = asset.images["light_field_bc1"]
        if "light_rest_bc1" in asset.images:
            rest, high = asset.images["light_rest_bc1"], FIRST // asset.options["columns"] * float(asset.options["views"] * asset.options["texels"])
            code = k.branch(slab.place < FIRST - 0.5, lambda: (k.sample(first, at.x, at.y),), lambda: (k.sample(rest, at.x, at.y - high),))[0]
        else:
            code = k.sample(first, at.x, at.y)
        return hdr_code.decode(k, asset.uniforms, code.xyz) * asset.uniforms["light_scale"]
    return k.name("view", k.sample(asset.images["light_field_tx"], at.x, at.y)).xyz * asset.uniforms["light_scale"]


def _depth_at(k, asset, slab, corner, q):
    """q that one texel of a view stores where the ray's point at 1 / z = q is seen."""
    at = _place(k, asset, slab, corner, q)
    x, y = k.floor(at.x), k.floor(at.y)
    if asset.options["coded"]:
        k.cite("four depths of one row in each texel")
        column = k.floor(x * 0.25)
        four, i = k.fetch(asset.images["light_depth_tx"], column, y), x - 4.0 * column
        stored = k.select(i < 0.5, four.x, k.select(i < 1.5, four.y, k.select(i < 2.5, four.z, four.w)))
    else:
        stored = k.fetch(asset.images["light_field_tx"], x, y).w
    return k.max(stored, 0.0) * asset.uniforms["depth_scale"]


def _share(k, asset, slab, number, q):
    """How much a view counts: bilinearly, and less where its line to the ray's point at 1 / z = q passes the cell."""
    share = (slab.fs if number % 2 else 1.0 - slab.fs) * (slab.ft if number // 2 else 1.0 - slab.ft)
    enter, leave = 0.0, 2.0 * slab.half
    for (step, at, slope, half), corner in zip(slab.along, slab.corners[number], strict=True):
        start = (corner - slab.middle) * step
        per = 1.0 / k.away_from_zero(slope + (at - corner) * step * q, 1e-6)
        middle, reach = -start * per, half * k.abs(per)
        enter, leave = k.max(enter, middle - reach), k.min(leave, middle + reach)
    missed = k.max(enter - leave, 0.0) * asset.uniforms["depth_scale"] * (1.0 / BESIDE)
    return share / (1.0 + k.min(missed * missed, 1e8))


def _focused(k, asset, slab):
    """(radiance, q): four views with one focal plane."""
    k.cite("yu-2005 6: four views, each looked up at eq. (6), blended bilinearly")
    total, radiance = 1e-12, k.vec3(0.0)
    for number, corner in enumerate(slab.corners):
        weight = k.name("weight", _share(k, asset, slab, number, slab.focus))
        total, radiance = total + weight, radiance + _look(k, asset, slab, corner, slab.focus) * weight
    return radiance * (1.0 / total), slab.focus


def _corrected(k, asset, slab):
    """(radiance, q): each view is looked up where it sees what the ray meets by its own depths."""
    k.cite("per-view depth: z = z_i(u_i(z)) by a fixed point, from the focal plane")
    total, radiance, depth, solid = 0.0, k.vec3(0.0), 0.0, 0.0
    for number, corner in enumerate(slab.corners):
        q = slab.focus
        for _ in range(DEPTH_STEPS):
            q = k.name("view_q", _depth_at(k, asset, slab, corner, q))
        seen = _depth_at(k, asset, slab, corner, q)
        off = k.abs(seen - q) / k.max(k.max(seen, q), 1e-9)
        share = _share(k, asset, slab, number, q)
        weight = k.name("weight", (share + 1e-4) / (1.0 + (off / AGREE) * (off / AGREE)))
        total, radiance = total + weight, radiance + _look(k, asset, slab, corner, q) * weight
        depth, solid = depth + seen * weight, solid + k.select(seen > 0.0, weight, 0.0)
    # The sky has no distance to be blended with.
    return radiance * (1.0 / total), k.select(solid > 0.5 * total, depth / k.max(solid, 1e-6), 0.0)
