"""From a poly-line's hit to the depth map's own: the last texel of the way [popescu-2006 4.2 ends at the poly-line].

Problem. With m = 8 points a row is off by one per cent of the object's depth, several texels.
Idea. The poly-line says where to look, so a few texels decide. One step of Newton's method with the segment's own slope; a
walk from texel to texel until the ray has crossed the map, at most REACH of them; one more step on the bilinear map.
The map's q is the alpha of the colours' block, so this reads an image that is bound anyway. Eight points a row are then
nearer to the map than a march over every texel.
"""

# Texels from the poly-line's hit in which the map's is looked for: beyond, it is another surface's.
REACH = 8
# Texels of depth between two neighbours, over `steep`, up to which they are one surface: they may lie diagonally.
DIAGONAL = 1.5


def refined(k, asset, place, steep, first, step, s, fall):
    """s in 0..1 where the projection first + step s meets the map, near the given s.

    place: the map's block; fall: how fast the ray comes nearer to the poly-line there, q per s; first, step: vec3, x and y
    in texels from the map's middle, q.
    """
    image = asset.images["billboard_tx"]
    x0, y0 = place.x + 0.5 * place.z, place.y + 0.5 * place.z
    texel = k.name("one_texel", 1.0 / k.max(k.max(k.abs(step.x), k.abs(step.y)), 1.0))

    def map_at(s):
        """(height of the ray above the map, the map's q: below 0 where there is nothing)."""
        at = first + step * s
        q = k.fetch(image, x0 + at.x, y0 + at.y).w
        return at.z - q, q

    def newton(s, above, q, most):
        moved = k.clamp(above / k.max(fall, 1e-20), -most * texel, most * texel)
        return k.select(q >= 0.0, k.clamp(s + moved, 0.0, 1.0), s)

    k.cite("from the poly-line to the depth map: one step of Newton's method ...")
    s = k.name("newton", newton(s, *map_at(s), float(REACH)))
    k.cite("... then texel by texel until the ray has crossed the map")
    above, q = map_at(s)
    way = k.name("way", k.select(above >= 0.0, texel, -texel))

    def walk(_, crossed, best, s, above, q):
        t = s + way
        now, other = map_at(t)
        solid = (other >= 0.0) & (t >= 0.0) & (t <= 1.0) & (k.abs(other - q) <= DIAGONAL * steep)
        crossed = solid & (now * above <= 0.0)
        share = k.clamp(above / k.away_from_zero(above - now, 1e-20), 0.0, 1.0)
        return (crossed, k.select(crossed, s + way * share, best), t, now, other), crossed | ~solid

    walked = k.loop(REACH, (False, s, s, above, q), walk)[1]
    s = k.name("walked", k.select(q >= 0.0, walked, s))
    k.cite("... and a step on the bilinear map, where its four texels are one surface")
    at = first + step * s
    nearest = k.fetch(image, x0 + at.x, y0 + at.y).w
    smooth = k.sample(image, x0 + at.x, y0 + at.y).w
    smooth = k.select(k.abs(smooth - nearest) <= steep, smooth, nearest)
    return newton(s, at.z - smooth, nearest, 1.0)
