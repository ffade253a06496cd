"""A pixel of a curved mirror as a few mirror rays, where the surface stretches it more one way than the other.

Problem. A footprint that is as wide as it is high is a number for each pixel, and levels of a map are read by it. Towards a ball's rim a pixel sees many
times as much across the rim as along it: the round footprint of the same area blurs along and still is too narrow across.
Idea. As textures are filtered anisotropically [Heckbert 1989, "Fundamentals of Texture Mapping and Image Warping"; McCormack et al. 1999,
"Feline"]: from the differences between the mirror ray and its neighbours' [Igehy 1999, "Tracing Ray Differentials"] follow the pixel's
longest and shortest extent and the line across the pixel that is stretched most; rays along that line have the shortest extent each, and their mean is shown. Their
count is odd: the middle one is the pixel's own ray and says where things are.
A footprint is as wide as a box, and what reads a level of a map is not: between texels it blends four (a tent), and each is a box itself. A
tent of half width h and a box of width h have the variance h^2 / 6 + h^2 / 12 together, a pixel p^2 / 12; so the level is that of p / sqrt(3).
Limits. Differences between pixels, so what changes within one is not seen; only along one line; up to MOST rays. On rough surfaces the rays
of the lobe (lobe_rays.py) are shared out over the pixel instead where they are more.
"""

# Most rays of one pixel, odd.
MOST = 7
# A pixel that is stretched less than so many times sends one ray.
UNEVEN = 1.5
# So does one whose footprint grows less than this, per metre: half a degree, less than a texel of most maps.
LEAST = 0.01
# Level of a map over the pixel's extent, see above.
FILTER = 3.0**-0.5

INPUTS = {"along_x": "vec3", "along_y": "vec3", "width": "float", "spread": "float", "most": "float"}


def rays(k, scope, along_x, along_y, width, spread, most):
    """{'rays': float, their count; 'line': vec2, across the pixel, px, a unit vector; 'width', 'spread': float, of each ray's footprint}.

    along_x, along_y: what the mirror direction changes by from one pixel to the next, 0 where it is not known; width, spread: core.rays.RayMap,
    without what roughness adds; most: odd."""
    xx, xy, yy = k.dot(along_x, along_x), k.dot(along_x, along_y), k.dot(along_y, along_y)
    k.cite("axes of the ellipse that a round pixel becomes")
    uneven = k.name("uneven", 0.5 * (xx - yy))
    swing = k.name("swing", k.sqrt(uneven * uneven + xy * xy))
    longest = k.name("longest", 0.5 * (xx + yy) + swing)
    shortest = k.name("shortest", k.max(0.5 * (xx + yy) - swing, 0.0))
    cosine = k.name("cosine", k.clamp(uneven / k.max(swing, 1e-20), -1.0, 1.0))
    line = k.vec2(k.sqrt(0.5 + 0.5 * cosine), k.sqrt(0.5 - 0.5 * cosine) * k.select(xy < 0.0, -1.0, 1.0))
    times = k.name("times", k.sqrt(longest / k.max(shortest, 1e-12)))
    several = (spread > LEAST) & (times > UNEVEN)
    count = k.name("count", k.select(several, k.min(2.0 * k.ceil(0.5 * times - 0.5) + 1.0, most), 1.0))
    each = k.sqrt(0.5 * (longest / (count * count) + shortest))
    k.cite("differences across an edge of the surface say nothing of it: no footprint is wider than the surface's own")
    return {
        "rays": count, "line": line, "width": FILTER * width, "spread": FILTER * k.select(several, k.min(each, spread), spread),
    }  # fmt: skip
