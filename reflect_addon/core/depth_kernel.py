"""Rays against depth maps: clip, project, choose the row, walk its poly-line [popescu-2006 4.3].

Each depth map is a row of `billboard_buf` whose columns z, x, y hold its camera; its simplified rows (srdm.py) lie in
`srdm_buf`, or in `srdm_tx` at half the size. A ray meets the nearest of all maps' poly-lines.

In (u, q), u along a turned row and q the normalised 1/z, the ray's projection is straight, and so are the poly-line's
segments: with s in 0..1 from the ray's first point to its last, the difference of depths is linear in s on a segment, and
the hit is where it changes sign. The distance along the ray follows from s by the usual perspective rule.

Degenerate rays need no case of their own. Through the camera's eye: the projection is a point, its length is raised to
SHORTEST and the ray meets the segment above that point. Parallel to the image plane: q is constant. From behind the
camera, or beside it: clipped. In the surface: hit where it enters.

Where we depart. A bounding sphere comes before the six planes, and the spheres of all maps before any map, so that a ray that passes an
object costs one fetch and no step of the search: what one ray searches, all that run with it wait for. The walk starts at the
ray's end of the row and ends at the first hit; with more than LINEAR points it starts by bisection. The hit on the poly-line is
then moved onto the map itself (depth_refine.py; settings["refine"]: also of what is only lit).
"""

import math

from . import srdm
from .billboard_kernel import fetch
from .depth_refine import refined
from .row_search import each_row
from .turns import cosine_and_sine, half_turns

# Projections shorter than this, in texels, count as this long: below it u cannot be told apart in float32.
SHORTEST = 1e-3
# Points a row up to which a walk is cheaper than a bisection before it.
LINEAR = 16


def nearest(k, asset, ray, start, before, rows, search=None):
    """(distance, row, u, v) of the nearest hit with the maps in `rows`, a list of row_search.Span, or `before` where that is nearer.

    search: how one map is searched, `along_row` by default (evaluation/epipolar.py has the march it is compared with)."""
    if all(span.first == span.last for span in rows):
        return before
    k.cite("popescu-2006 4.3: intersect r with every depth map")

    def meet(of, i, found):
        may, along, radius = _ball(k, of, ray, start, i, found[0])
        return k.branch(may, lambda: _within(k, of, ray, start, i, found, search or along_row, along, radius), lambda: found)

    return each_row(k, asset, rows, before, meet, may=lambda of, i, distance: _ball(k, of, ray, start, i, distance)[0])


def _ball(k, asset, ray, start, i, distance):
    """(whether the ray meets the map's bounding sphere before `distance`, the way along it to the sphere's middle, its radius)."""
    ball = k.name("ball", fetch(k, asset, "ball", i))
    to = ball.xyz - start
    along = k.name("along", k.dot(to, ray.direction))
    beside = k.name("beside", to - ray.direction * along)
    met = (k.dot(beside, beside) < ball.w * ball.w) & (along + ball.w > 0.0) & (along - ball.w < distance)
    return met, along, ball.w


def _within(k, asset, ray, start, i, before, search, along, radius):
    """The ray has met the map's bounding sphere."""
    z_row, x_row, y_row = (fetch(k, asset, name, i) for name in ("plane", "u", "v"))
    limits, place = k.name("limits", fetch(k, asset, "limits", i)), fetch(k, asset, "place", i)
    z0, x0, y0 = (k.dot(start, r.xyz) + r.w for r in (z_row, x_row, y_row))
    zd, xd, yd = (k.dot(ray.direction, r.xyz) for r in (z_row, x_row, y_row))
    k.cite("popescu-2006 4.3 step 2: clip r with the six planes of the frustum, in homogeneous coordinates")
    t0, t1 = k.max(along - radius, limits.z), k.min(along + radius, before[0])
    for inside, loss in (
        (z0 - x0, xd - zd),
        (z0 + x0, -xd - zd),
        (z0 - y0, yd - zd),
        (z0 + y0, -yd - zd),
        (z0 - limits.x, -zd),
        (limits.y - z0, zd),
    ):
        t0, t1 = _clip(k, inside, loss, t0, t1)
    t0, t1 = k.name("t0", t0), k.name("t1", t1)

    def project_and_search():
        k.cite("popescu-2006 4.3 step 3: project the clipped ray onto the image plane")
        first, last = (_projected(k, (x0, y0, z0), (xd, yd, zd), t, place.z, limits) for t in (t0, t1))
        found, s = search(k, asset, i, place, limits.w, first, last)
        k.cite("perspective: a share s of the image segment is the share s z0 / (s z0 + (1 - s) z1) of the ray's")
        za, zb = k.name("za", z0 + zd * t0), k.name("zb", z0 + zd * t1)
        near = s * za
        t = k.name("t_hit", t0 + (t1 - t0) * (near / k.max(near + (1.0 - s) * zb, 1e-30)))
        z = 1.0 / k.max(z0 + zd * t, 1e-30)
        met = (t, i, (x0 + xd * t) * z, (y0 + yd * t) * z)
        return tuple(k.select(found, new, old) for new, old in zip(met, before, strict=True))

    return k.branch(t0 < t1, project_and_search, lambda: before)


def _clip(k, inside, loss, t0, t1):
    """The part of t0..t1 where inside - loss t >= 0; empty (t0 > t1) where there is none."""
    t = inside / k.away_from_zero(loss, 1e-20)
    entering = loss < 0.0
    return k.select(entering, k.max(t0, t), t0), k.select(entering, t1, k.min(t1, t))


def _projected(k, at, along, t, w, limits):
    """(x, y texels from the map's middle, q) of the ray's point at t."""
    x, y, z = (a + d * t for a, d in zip(at, along, strict=True))
    inverse = 1.0 / k.max(z, 1e-30)
    q = (limits.y - z) * inverse * (limits.x / (limits.y - limits.x))
    return k.vec3(x * inverse * (0.5 * w), y * inverse * (0.5 * w), q)


def along_row(k, asset, i, place, steep, first, last):
    """(bool, s): whether and where the projection from `first` to `last` (texels from the middle, q) meets map i."""
    found, s, fall = _best_row(k, asset, i, place.z, steep, first, last)
    if not asset.options["refine"]:
        return found, s
    step = last - first
    corner = fetch(k, asset, "table", i).zw
    return found, refined(k, asset, corner, place.z, steep, first, step, s, fall)


def _best_row(k, asset, i, w, steep, first, last):
    """(bool, s, fall) by the poly-lines alone; fall: how fast the ray comes nearer to the segment it meets, q per s."""
    n, count = float(asset.options["turns"]), asset.options["row_texels"]
    step = last - first
    table = k.name("table", fetch(k, asset, "table", i))
    turns = k.name("turns", half_turns(k, step.x, step.y) * n)
    best = k.name("best", k.floor(turns + 0.5))

    def look(turn, share):
        turn = k.select(turn < 0.0, turn + n, k.select(turn >= n, turn - n, turn))  # pi is 0, the other way round
        c, s = cosine_and_sine(k, turn, n)
        k.cite("popescu-2006 4.3 step 4: the row that contains the projection, at the share of it that is asked for")
        at = first + step * share
        row = k.name("srdm_row", k.clamp(k.floor(w * 0.5 + at.y * c - at.x * s), 0.0, w - 1.0))
        along = k.name("u_along", step.x * c + step.y * s)
        u0 = k.name("u0", w * 0.5 + first.x * c + first.y * s)
        line = (u0, k.name("du", k.away_from_zero(along, SHORTEST)), first.z, step.z)
        return walk(k, asset, table.x + turn * float(count), table.y + row, along >= 0.0, line, steep)

    found, s, fall = look(best, 0.5)
    if asset.options["rows"] == 1:
        return found, s, fall
    k.cite("popescu-2006 5.2: look up the two best rows; they say where the projection's own row is to be looked up")
    second = k.name("second_best", best + k.select(turns > best, 1.0, -1.0))
    there = k.branch(found, lambda: (found, s, fall), lambda: look(second, 0.5))
    exact = k.branch(there[0], lambda: look(best, there[1]), lambda: there)
    # What the best turn loses there, at the edge of a row, the second may still have.
    return k.branch(there[0] & ~exact[0], lambda: look(second, there[1]), lambda: exact)


def walk(k, asset, x, y, forward, line, steep):
    """(bool, s, fall) of the first meeting of the ray with the poly-line whose texels start at (x, y).

    line: (u0, du, q0, dq), the ray is (u0 + s du, q0 + s dq) with s in 0..1; forward: du > 0. Points come two a texel; the
    walk goes with the ray, so the first meeting found is the first there is.
    """
    image = asset.images["srdm_tx" if asset.options["half"] else "srdm_buf"]
    count = asset.options["row_texels"]
    u0, du = line[:2]
    line = (u0, k.name("per_u", 1.0 / du), *line[2:])
    u_end = k.name("u_end", u0 + du)

    def pair(c):
        """Two points, the one that the ray comes to first in front."""
        texel = k.fetch(image, x + k.select(forward, c, (count - 1.0) - c), y)
        return k.name("pair", k.select(forward, texel, k.vec4(texel.z, texel.w, texel.x, texel.y)))

    begin, pu, pq = 0.0, -srdm.FILL, 0.0
    if 2 * count > LINEAR:
        begin, pu, pq = _bisect(k, count, forward, u0, pair)
    k.cite("popescu-2006 4.3 step 5: iterate over the segments of the poly-line")

    def step(i, found, s, fall, pu, pq):
        a = pair(begin + i)
        one, s_one, fall_one = _segment(k, pu, pq, a.x, a.y, forward, line, steep)
        two, s_two, fall_two = _segment(k, a.x, a.y, a.z, a.w, forward, line, steep)
        past = k.select(forward, k.abs(a.z) - u_end, u_end - k.abs(a.z)) > 0.0
        s, fall = k.select(one, s_one, s_two), k.select(one, fall_one, fall_two)
        return (one | two, s, fall, a.z, a.w), one | two | past

    return k.loop(count - begin, (False, 0.0, 0.0, pu, pq), step)[:3]


def _bisect(k, count: int, forward, u0, pair):
    """(texel at which the walk begins, the point before it): the first whose last point the ray has not passed yet."""

    def step(_, low, high):
        middle = k.floor((low + high) * 0.5)
        u = k.abs(pair(middle).z)
        passed = k.select(forward, u0 - u, u - u0) > 0.0
        return (k.select(passed, middle + 1.0, low), k.select(passed, high, middle)), None

    low, _ = k.loop(math.ceil(math.log2(count + 1)), (0.0, float(count)), step)
    low = k.name("begin", k.clamp(low, 0.0, count - 1.0))
    before = pair(k.max(low - 1.0, 0.0))
    return low, k.select(low > 0.0, before.z, -srdm.FILL), before.w


def _segment(k, au, aq, bu, bq, forward, line, steep):
    """(bool, s, fall): the meeting from the front with the segment between two points, a before b on the ray's way.

    A negative u begins a span: nothing joins it to the point at its left (srdm.py). Nor is a rise of more than `steep` a
    surface: the camera did not see it well, or it is the jump from a near part of the object to a far one.
    """
    u0, per_u, q0, dq = line
    joined = k.select(forward, bu, au) >= 0.0
    au, bu = k.abs(au), k.abs(bu)
    sa, sb = (au - u0) * per_u, (bu - u0) * per_u
    low, high = k.max(sa, 0.0), k.min(sb, 1.0)
    slope = (bq - aq) / k.max(sb - sa, 1e-20)
    rise = dq - slope
    above = q0 - aq + slope * sa
    at_low, at_high = above + low * rise, above + high * rise
    met = joined & (low <= high) & (at_low >= 0.0) & (at_high <= 0.0) & (k.abs(bq - aq) <= steep * k.abs(bu - au))
    return met, low + (high - low) * k.clamp(at_low / k.max(at_low - at_high, 1e-20), 0.0, 1.0), -rise
