"""Rays that start on a mapped surface: the first texels of their way are marched on the map itself [popescu-2006 section 6,
"self-reflections"].

Problem. A reflector's ray starts on the very surface that its maps show, and what it meets there is near: a fold, a seam,
the other side of a crease. A simplified row is that of the projection's middle, turned by up to half a turn's step: at its
ends it lies texels beside the projection, and a poly-line is as many texels off the surface. So rays met their own start, or,
told to ignore what is nearer than three texels, missed what was near (a third of `contact`'s rays that meet their own mirror).
Idea. Near its start a ray has few texels to cross. It is marched there on the bilinear map, in strides that grow from a texel to
five, and only then looked up in a row, which now begins where the march ended.
The march begins BEGIN texels from the ray's start, where a surface that bends away is not met again. It ends where the ray
passes from above the map to below it, and false positions between its last two looks place that hit.

Depths of maps that are marched are float32 (`mirror_depth_buf`): a half float's rounding is 1 mm on an object of 2 m, which a
curved mirror of 5 cm turns to a degree of the ray that goes on, and lamps are seen a few degrees wide.
"""

from .billboard_kernel import fetch
from .depth_kernel import along_row
from .depth_refine import map_at

# Steps, and how much longer than the one before each is: the first is a texel, all together 26. Where two balls meet, hits of 1 to 8, 8 to 16 and 16
# to 32 texels are found as often as by 16 steps of a texel, or more often (0.947, 0.975, 0.904; 0.941, 0.963, 0.821), and the FLIP of teapots is theirs;
# 7 steps, 1.3 times longer each, do as well there, but teapots have 0.002 more.
STEPS = 10
LONGER = 1.2
# Texels from the ray's start to the first look.
BEGIN = 0.5
# Texels of depth, over `steep`, from the map within which the first look counts as on it. A map that has another surface there
# is not marched: rows are good enough for what is far from the start. 4 lose no hit of two balls that 1e9 find.
NEAR = 4.0
# Texels of depth a texel of the stride, over `steep`, up to which two looks are one surface. With half as many a tenth of the near hits in
# a narrow crease are lost, which all maps see at a slant.
SAME = 0.75


def search(k, asset, i, place, steep, first, last):
    """depth_kernel's: (bool, s), by the march and then along_row. asset: with the maps' depths as its `depth_tx`."""
    corner, step = fetch(k, asset, "table", i).zw, last - first
    # Of s: 0 is the ray's start, 1 its end.
    one = k.name("one_step", 1.0 / k.max(k.max(k.abs(step.x), k.abs(step.y)), 1e-3))

    def look(s):
        """(height of the ray above the map, the map's q)."""
        at = first + step * s
        q = map_at(k, asset, corner, at.xy + 0.5 * place.z, steep)
        return at.z - q, q

    k.cite("a ray that starts on the map: step by step until it passes below ...")

    def march(_, found, s, above, q, before, stride, low):
        stride = stride * LONGER
        s_now = k.min(s + stride, 1.0)
        now, other = look(s_now)
        # `above` is the last look's: the ray must come from the front.
        surface = (q >= 0.0) & (other >= 0.0) & (k.abs(other - q) * one <= SAME * steep * stride)
        met = surface & (above > 0.0) & (now <= 0.0)
        return (met, s_now, now, other, k.select(met, above, now), stride, s), met | (s_now >= 1.0)

    begin = k.name("begin", k.min(BEGIN * one, 1.0))
    above, q = look(begin)
    on_map = (q < 0.0) | (k.abs(above) <= NEAR * steep)
    steps = k.select(on_map, float(STEPS), 0.0)
    found, s, above, _, before, _, low = k.loop(steps, (False, begin, above, q, above, one * (1.0 / LONGER), begin), march)
    k.cite("... and between its last two looks by the false position, twice")
    placed = _false_position(k, look, low, before, s, above)

    def along():
        rest = k.name("rest", first + step * s)
        met, share = along_row(k, asset, i, place, steep, rest, last)
        return met & (s < 1.0), s + (1.0 - s) * share

    return k.branch(found, lambda: (found, placed), along)


def _false_position(k, look, low, above, high, below):
    """s between low, where the ray is `above` the map, and high, where it is `below` it."""
    for _ in range(2):
        s = k.name("placed", low + (high - low) * k.clamp(above / k.max(above - below, 1e-20), 0.0, 1.0))
        now = look(s)[0]
        over = now > 0.0
        low, above = k.select(over, s, low), k.select(over, now, above)
        high, below = k.select(over, high, s), k.select(over, below, now)
    return low + (high - low) * k.clamp(above / k.max(above - below, 1e-20), 0.0, 1.0)
