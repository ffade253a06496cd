"""A pixel of a curved mirror as a few mirror rays, where the surface stretches it more one way than the other.

Problem. A footprint that is as wide as it is high is a number for each pixel, and levels of a map are read by it. Towards a ball's rim a pixel sees many
times as much across the rim as along it: the round footprint of the same area blurs along and still is too narrow across.
Idea. As textures are filtered anisotropically [Heckbert 1989, "Fundamentals of Texture Mapping and Image Warping"; McCormack et al. 1999,
"Feline"]: from the differences between the mirror ray and its neighbours' [Igehy 1999, "Tracing Ray Differentials"] follow the pixel's
longest and shortest extent and the line across the pixel that is stretched most; rays along that line have the shortest extent each, and their mean is shown. Their
count is odd: the middle one is the pixel's own ray and says where things are.
A footprint is as wide as a box, and what reads a level of a map is not: between texels it blends four (a tent), and each is a box itself. A
tent of half width h and a box of width h have the variance h^2 / 6 + h^2 / 12 together, a pixel p^2 / 12; so the level is that of p / sqrt(3).
The kernel below is told of a pixel's differences; gpu/glsl/fill_pixel.frag.glsl takes them from the ray map, `differences` is the same in NumPy.
Flat reflectors stretch no pixel; they are asked as the ray map says.
Limits. Differences between pixels, so what changes within one is not seen; only along one line; up to MOST rays. On rough surfaces the rays
of the lobe (lobe_rays.py) are shared out over the pixel instead where they are more.
"""

import numpy as np

from .kernel import evaluate, record_function
from .rays import RayMap

# Most rays of one pixel, odd: in a picture, and in a window, where coarse pixels would cost several times what fine ones do.
MOST, LIVE = 7, 1
# A pixel that is stretched less than so many times sends one ray.
UNEVEN = 1.5
# Growth of the longest extent, per metre, that one ray may have however stretched the pixel is: a degree and a half, a texel or two of
# most maps. So the finer a picture, the fewer rays its pixels send.
FINE = 0.03
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
    times = k.name("times", k.sqrt(k.min(longest / k.max(shortest, 1e-12), longest * FINE**-2)))
    several = (spread > FINE) & (times > UNEVEN)
    count = k.name("count", k.select(several, k.min(2.0 * k.ceil(0.5 * times - 0.5) + 1.0, most), 1.0))
    each = k.sqrt(0.5 * (longest / (count * count) + shortest))
    k.cite("differences across an edge of the surface say nothing of it: no footprint is wider than the surface's own")
    return {
        "rays": count, "line": line, "width": FILTER * width, "spread": FILTER * k.select(several, k.min(each, spread), spread),
    }  # fmt: skip


def differences(ray_map: RayMap) -> tuple[tuple[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]:
    """((turned, moved) along x, the same along y), (N, 3) each, of the covered pixels in row order: what direction and origin change by from a pixel to the
    next one on the same reflector, on that side where the direction changes less, since the other may lead across an edge; 0 where there is none."""
    mask, found = ray_map.covered(), []
    for axis in (1, 0):
        least, turned, moved = np.full(mask.shape, np.inf), np.zeros_like(ray_map.direction), np.zeros_like(ray_map.origin)
        for side in (-1, 1):
            here, there = _shifted(mask.ndim, axis, side), _shifted(mask.ndim, axis, -side)
            change = ray_map.direction[there] - ray_map.direction[here]
            amount = (change**2).sum(-1)
            better = mask[here] & (ray_map.reflector[there] == ray_map.reflector[here]) & (amount < least[here])
            least[here][better] = amount[better]
            turned[here][better] = side * change[better]
            moved[here][better] = side * (ray_map.origin[there] - ray_map.origin[here])[better]
        found.append((turned[mask], moved[mask]))
    return found[0], found[1]


def of_ray_map(ray_map: RayMap, most: int = MOST) -> dict[str, np.ndarray]:
    """What `rays` says of the covered pixels in row order; all must be smooth, since a ray map's spread has a rough surface's lobe in it."""
    mask = ray_map.covered()
    (turned_x, _), (turned_y, _) = differences(ray_map)
    inputs = {"along_x": turned_x, "along_y": turned_y, "width": ray_map.width[mask], "spread": ray_map.spread[mask]}
    return evaluate(record_function(rays, INPUTS), {**inputs, "most": np.full(mask.sum(), most, np.float32)})


def _shifted(dimensions: int, axis: int, side: int) -> tuple[slice, ...]:
    """All of an image that has a neighbour on that side."""
    return tuple((slice(None, -1) if side > 0 else slice(1, None)) if i == axis else slice(None) for i in range(dimensions))
