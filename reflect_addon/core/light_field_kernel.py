"""Light-field slabs as kernel functions: the slab, the four views and the texels of a ray [yu-2005 sections 4 to 6].

Every length along a slab's axes b and c, the two after its own. Depths are stored as q = 1 / z, z the distance in m from the
camera plane along the slab's axis, over `depth_scale`; 0 is the sky.
"""

from . import spaces
from .light_field import ATLAS

# Fixed-point steps from a ray's guessed depth to each view's own.
DEPTH_STEPS = 2
# Difference of depth, over the depth itself, at which a view counts half of one that agrees.
AGREE = 0.02


def answer(k, asset, ray):
    """(radiance, position) of a ray from inside the cell.

    asset.options: views, texels, depth (views have depths). asset.uniforms: Cell.uniforms, `focus` (1/m: 1 / z of the focal plane,
    vec3 by axis for the slabs of + and `focus_back` for those of -), light_scale, depth_scale."""
    slab = _slab(k, asset, ray)
    if asset.options["depth"]:
        radiance, q = _corrected(k, asset, slab)
    else:
        k.cite("yu-2005 6: four views, each looked up at eq. (6), blended bilinearly")
        views = [_look(k, asset, slab, corner, slab.focus) for corner in slab.corners]
        radiance, q = _blend(k, slab, [v.xyz for v in views]), slab.focus
    along = k.select(q > 0.0, k.min(1.0 / k.max(q, 1e-30), spaces.FAR), spaces.FAR)
    # From the camera plane to the ray's own start, in units of the ray's length.
    distance = k.min(k.max((along - slab.depth) * slab.length, 0.0), spaces.FAR)
    return radiance * asset.uniforms["light_scale"], ray.origin + ray.direction * distance


class _Slab:
    """One ray in its slab: see _slab."""

    def __init__(self, **fields):
        self.__dict__.update(fields)


def _slab(k, asset, ray):
    u = asset.uniforms
    start = k.name("start", ray.origin - u["center"])
    d, w = ray.direction, u["cell_weight"]
    k.cite("yu-2005 5: the slab of the largest absolute component")
    ax, ay, az = (k.abs(c) * by for c, by in ((d.x, w.x), (d.y, w.y), (d.z, w.z)))
    is_x = k.name("is_x", (ax >= ay) & (ax >= az))
    is_y = k.name("is_y", ay >= az)

    def of(v):
        """(own, b, c) components of a vec3 in the slab's axes."""
        return tuple(
            k.select(is_x, a, k.select(is_y, b, c)) for a, b, c in ((v.x, v.y, v.z), (v.y, v.z, v.x), (v.z, v.x, v.y))
        )

    def by_axis(v):
        return k.select(is_x, v.x, k.select(is_y, v.y, v.z))

    (da, db, dc), (pa, pb, pc), half = of(d), of(start), by_axis(u["cell_half"])
    back = da < 0.0
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
    face = k.select(is_x, 0.0, k.select(is_y, 2.0, 4.0)) + k.select(back, 1.0, 0.0)
    row = k.floor((face + 0.5) * (1.0 / ATLAS[0]))
    width = float(asset.options["views"] * asset.options["texels"])
    return _Slab(
        u=k.name("u", (slope_b / reach_b + 1.0) * (0.5 * m)),
        v=k.name("v", (slope_c / reach_c + 1.0) * (0.5 * m)),
        s=s, t=t, depth=depth, length=per, fs=s - s0, ft=t - t0,
        corners=[(s0 + i, t0 + j) for j in (0.0, 1.0) for i in (0.0, 1.0)],
        # Texels that what lies at 1 / z = 1 moves from one view to the next.
        move_b=k.name("move_b", side_b * (2.0 / n) / reach_b * (0.5 * m)),
        move_c=k.name("move_c", side_c * (2.0 / n) / reach_c * (0.5 * m)),
        x=(face - row * ATLAS[0]) * width, y=row * width,
        focus=k.name("focus", k.select(back, by_axis(u["focus_back"]), by_axis(u["focus"]))),
    )  # fmt: skip


def _place(k, asset, slab, corner, q):
    """vec2: texel coordinates in the atlas of the ray's point at 1 / z = q as a view sees it; eq. (6) with q as disparity."""
    texels = float(asset.options["texels"])
    at_u = k.clamp(slab.u + q * slab.move_b * (slab.s - corner[0]), 0.0, texels - 1.0)
    at_v = k.clamp(slab.v + q * slab.move_c * (slab.t - corner[1]), 0.0, texels - 1.0)
    return k.vec2(slab.x + corner[0] * texels + at_u + 0.5, slab.y + corner[1] * texels + at_v + 0.5)


def _look(k, asset, slab, corner, q):
    at = _place(k, asset, slab, corner, q)
    return k.name("view", k.sample(asset.images["light_field_tx"], at.x, at.y))


def _depth_at(k, asset, slab, corner, q):
    """q that one texel of a view stores where the ray's point at 1 / z = q is seen."""
    at = _place(k, asset, slab, corner, q)
    return k.fetch(asset.images["light_field_tx"], k.floor(at.x), k.floor(at.y)).w * asset.uniforms["depth_scale"]


def _blend(k, slab, four):
    low, high = k.mix(four[0], four[1], slab.fs), k.mix(four[2], four[3], slab.fs)
    return k.mix(low, high, slab.ft)


def _corrected(k, asset, slab):
    """(radiance / scale, q): each view is looked up where it sees what the ray meets by its own depths."""
    k.cite("per-view depth: z = z_i(u_i(z)) by a fixed point, from the focal plane")
    total, radiance, depth = 0.0, k.vec3(0.0), 0.0
    for n, corner in enumerate(slab.corners):
        share = (slab.fs if n % 2 else 1.0 - slab.fs) * (slab.ft if n // 2 else 1.0 - slab.ft)
        q = slab.focus
        for _ in range(DEPTH_STEPS):
            q = k.name("view_q", _depth_at(k, asset, slab, corner, q))
        seen = _depth_at(k, asset, slab, corner, q)
        off = k.abs(seen - q) / k.max(k.max(seen, q), 1e-9)
        weight = k.name("weight", (share + 1e-4) / (1.0 + (off / AGREE) * (off / AGREE)))
        total, radiance = total + weight, radiance + _look(k, asset, slab, corner, q).xyz * weight
        depth = depth + seen * weight
    return radiance * (1.0 / total), depth / total
