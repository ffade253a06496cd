"""From a poly-line's hit to the depth map's own: the last texel of the way [popescu-2006 4.2 ends at the poly-line].

Problem. With m = 8 points a row is off by one per cent of the object's depth, several texels.
Idea. The poly-line says where to look, so a few texels decide. One step of Newton's method with the segment's own slope, then
the secant method; of the places looked at, the one nearest to the map counts. Four looks and no loop: a walk from texel to texel until the
ray has crossed the map, and the secant there, has the same errors in three to eighteen.

The map, `depth_tx`, holds in one texel the four depths around a corner of the depth map, so one fetch is a bilinear look-up:
channels xyzw are those at the corner's lower left, lower right, upper left, upper right. The four are blended where they are
one surface, else the nearest counts. Eight points a row are then nearer to the map than a march over every texel.
"""

import numpy as np

# Texels that one step may go.
REACH = 16
# Looks after the first. By 1, 2, 3: the 95 % hit error of a torus of 8 points a row is 0.0046, 0.0013, 0.0011 of the diagonal (the walk's 0.0013), of
# Suzanne 0.0018, 0.0010, 0.0010 (0.0011), and teapots (360x270, the march of depth_start.py) have a FLIP of 0.1061 by 3 (0.1057).
SECANTS = 3
# Texels of depth, over `steep`, from the map up to which a place is on it. By 1.5, and with six looks, a ray that comes from where the map's camera is ended in the air.
ON = 0.25
# Texels of depth between two neighbours, over `steep`, up to which they are one surface: they may lie diagonally.
DIAGONAL = 1.5
# Depth of what is not there: below every q.
NOTHING = -1.0


def corners_of(depth: np.ndarray, kind=np.float16) -> np.ndarray:
    """(w + 1, w + 1, 4), float16 unless told otherwise, of a depth map (w, w), NaN where nothing is: texel (x, y) is
    the corner left below (x, y)."""
    q = np.pad(np.nan_to_num(depth, nan=NOTHING), 1, constant_values=NOTHING)
    return np.stack([q[:-1, :-1], q[:-1, 1:], q[1:, :-1], q[1:, 1:]], -1).astype(kind)


def map_at(k, asset, corner, at, steep):
    """The map's q at texel coordinates `at` (vec2, from the map's lower left); below 0 where there is nothing.

    corner: vec2, where the map lies in depth_tx."""
    x, y = at.x + 0.5, at.y + 0.5
    left, low = k.floor(x), k.floor(y)
    four = k.name("four", k.fetch(asset.images["depth_tx"], corner.x + left, corner.y + low))
    fx, fy = x - left, y - low
    lower, upper = k.mix(four.x, four.y, fx), k.mix(four.z, four.w, fx)
    least, most = (op(op(four.x, four.y), op(four.z, four.w)) for op in (k.min, k.max))
    nearest = k.select(fy < 0.5, k.select(fx < 0.5, four.x, four.y), k.select(fx < 0.5, four.z, four.w))
    one_surface = (least >= 0.0) & (most - least <= DIAGONAL * steep)
    return k.name("map_q", k.select(one_surface, k.mix(lower, upper, fy), nearest))


def texel_at(k, asset, corner, at):
    """The q of the one texel that `at` lies in; see map_at."""
    return k.fetch(asset.images["depth_tx"], corner.x + k.floor(at.x), corner.y + k.floor(at.y)).w


def refined(k, asset, corner, w, steep, first, step, s, fall):
    """s in 0..1 where the projection first + step s meets the map, near the given s.

    corner: the map's place in depth_tx; w: its side in texels; fall: how fast the ray comes nearer to the poly-line there, q
    per s; first, step: vec3, x and y in texels from the map's middle, q.
    """
    texel = k.name("one_texel", 1.0 / k.max(k.max(k.abs(step.x), k.abs(step.y)), 1.0))

    def look(s):
        """(height of the ray above the map, the map's q)."""
        at = first + step * s
        q = map_at(k, asset, corner, at.xy + 0.5 * w, steep)
        return at.z - q, q

    def onward(s, above, fall):
        """The place where the ray would meet what it is `above` of, coming nearer by `fall` per s."""
        return k.clamp(s + k.clamp(above / k.away_from_zero(fall, 1e-20), -REACH * texel, REACH * texel), 0.0, 1.0)

    k.cite("from the poly-line to the depth map: one step of Newton's method ...")
    above, q = look(s)
    best, least = s, k.select(q >= 0.0, k.abs(above), 0.0)  # over a hole of the map nothing is nearer
    now = k.name("newton", onward(s, above, fall))
    k.cite("... then of the secant method; what came nearest counts")
    for step_number in range(SECANTS):
        higher, q = look(now)
        # What comes nearer and stays off the map by more than a texel has found no surface: where it is means nothing.
        nearer = (q >= 0.0) & (k.abs(higher) < k.min(least, ON * steep))
        best, least = k.name("nearest", k.select(nearer, now, best)), k.select(nearer, k.abs(higher), least)
        if step_number + 1 < SECANTS:
            fall = (above - higher) / k.away_from_zero(now - s, 1e-20)
            s, above, now = now, higher, k.name("secant", onward(now, higher, fall))
    return best
