"""What a rough surface shows of a lamp: a GGX lobe integrated over a rectangle, as a kernel.

Problem. A glossy surface shows a lamp as a highlight whose place follows the eye and whose width is the lobe's. A ray along
the mirror direction says "lamp" or "no lamp"; a sum over many rays is not for a shader.
Idea. A surface of microfacets mirrors a direction o to the eye i where a facet's normal is h = (i + o) / |i + o|, and GGX is
the cosine seen from a point over a plane: of the slopes s = h / (n.h) - n, those in a region have the share
    integral of alpha^2 / (pi (alpha^2 + s^2)^2) ds,
which is Lambert's form factor of that region, put one unit above a point and stretched by 1 / alpha. So a lamp's corners
become slopes, the slopes a quadrilateral over the plane, and Lambert's sum over its edges is the integral in closed form
[Lambert 1760; Heitz, Dupuy, Hill, Neubelt 2016 do this with fitted transforms of directions. In slopes GGX needs no fit].
The rest of the reflection (Fresnel, shadowing and the measure) varies slowly: it is taken at one point, between the
lamp's middle and where it is nearest to the mirror direction [the representative point of Karis 2013, moved by what was
measured]. Limits. A lamp's edges are straight, its slopes' not quite: exact for small lamps; one as wide as it is far
away is within 4 % in the median. At eyes beyond 75 degrees a large lamp that goes on below the surface may lose most of
its light. Bounces between facets are left out, as in shading.py.
"""

import math

from .shading import reflectance

# Least alpha: a lobe of a tenth of a degree, below which float32 corners of a lamp are no longer told apart.
SHARPEST = 1e-3
# Cosines are raised to this: a grazing eye's weight is bounded by the shadowing, which falls with it.
GRAZING = 1e-3
# Of the way from a lamp's middle to its point nearest to the mirror direction: of 1, 0.8, 0.6 and 0.4 the least worst error.
BETWEEN = 0.4
# A quadrilateral with less than this area, over the square of its distance from the point, has one density for all of it:
# there the sum over edges would be the difference of nearly equal numbers.
SMALL = 0.01


def lamp_light(k, scope, toward, normal, alpha, lamp, material):
    """vec3: share of a lamp's radiance that leaves towards the eye.

    toward, normal: unit vec3, to the eye and of the surface; lamp: (vec3 from the surface to its middle, vec3 half sides u, v:
    it shines along u x v); material: keyword arguments of shading.reflectance without the cosine."""
    middle, u, v = lamp
    alpha = k.max(alpha, SHARPEST)
    s, t = nearest_to_mirror(k, toward, normal, lamp)
    nearest = k.normalize(middle + u * (s * BETWEEN) + v * (t * BETWEEN))
    half = k.normalize(toward + nearest)
    cosine = k.max(k.dot(half, toward), GRAZING)
    weight = _weight(k, toward, nearest, normal, half, cosine, alpha)
    terms = reflectance(k, scope, cosine, **material)
    return terms["reflectance"] * (share_of_lobe(k, toward, normal, alpha, lamp, (s, t)) * weight)


def share_of_lobe(k, toward, normal, alpha, lamp, nearest):
    """float in 0..1: share of the facets that mirror the rectangle to the eye; 0 for an eye behind the lamp.

    nearest: nearest_to_mirror's. Each edge has a corner of its own there, so that the slopes' outline bends as it does."""
    middle, u, v = lamp
    k.cite("a corner of the lamp as the slope of the facet that mirrors it, over alpha")

    def slope(s, t):
        to = k.normalize(middle + u * s + v * t)
        # What is below the surface is moved up to its horizon: beyond it slopes come back from the other side.
        half = toward + k.normalize(to - normal * k.min(k.dot(to, normal), 0.0))
        up = k.dot(half, normal)
        return (half - normal * up) / (k.max(up, GRAZING) * alpha)

    s, t = nearest
    outline = ((-1.0, -1.0), (-1.0, t), (-1.0, 1.0), (s, 1.0), (1.0, 1.0), (1.0, t), (1.0, -1.0), (s, -1.0))
    slopes = [slope(*corner) for corner in outline]
    area = k.name("slope_area", 0.5 * k.dot(normal, k.cross(slopes[4] - slopes[0], slopes[6] - slopes[2])))
    at = slope(0.0, 0.0)
    far = k.name("slope_far", 1.0 + k.dot(at, at))
    corners = [k.normalize(corner + normal) for corner in slopes]
    k.cite("Lambert: the form factor of a polygon is the sum of its edges' angles times their normals")
    ring = _edge(k, corners[-1], corners[0])
    for one, other in zip(corners, corners[1:], strict=False):
        ring = ring + _edge(k, one, other)
    share = k.select(k.abs(area) < SMALL * far, area / (math.pi * far * far), k.dot(ring, normal))
    return k.name("lobe_share", k.clamp(share, 0.0, 1.0))


def nearest_to_mirror(k, toward, normal, lamp):
    """(s, t) in -1..1: where on the lamp, in half sides, the mirror direction comes nearest to it [Karis 2013]."""
    middle, u, v = lamp
    mirrored = k.normalize(normal * (2.0 * k.dot(toward, normal)) - toward)
    across = k.normalize(k.cross(u, v))
    # Where the mirrored ray meets the lamp's plane; for one that does not, where it passes the lamp.
    facing = k.dot(mirrored, across)
    meets = k.dot(middle, across) / k.away_from_zero(facing, GRAZING)
    off = mirrored * k.select(meets > 0.0, meets, k.length(middle)) - middle
    return tuple(k.clamp(k.dot(off, axis) / k.max(k.dot(axis, axis), 1e-30), -1.0, 1.0) for axis in (u, v))


def _edge(k, a, b):
    """vec3: a x b / |a x b| times the angle between unit vectors, over 2 pi; Heitz's fit of angle / sine [Heitz et al.
    2016]."""
    x = k.dot(a, b)
    y = k.abs(x)
    fit = (0.8543985 + (0.4965155 + 0.0145206 * y) * y) / (3.4175940 + (4.1616724 + y) * y)
    wide = 0.5 / k.sqrt(k.max(1.0 - x * x, 1e-7)) - fit
    return k.cross(a, b) * k.select(x > 0.0, fit, wide)


def _weight(k, toward, to, normal, half, cosine, alpha):
    """float: what the measure of slopes leaves of the reflection: (h.i) / (n.h n.i) times Smith's G2; 1 straight on."""
    eye, out = k.max(k.dot(toward, normal), GRAZING), k.dot(to, normal)
    shadow = 1.0 / (1.0 + smith(k, eye, alpha) + smith(k, k.max(out, GRAZING), alpha))
    facet = k.max(k.dot(half, normal), GRAZING)
    return k.select(out > 0.0, shadow * cosine / (facet * eye), 0.0)


def smith(k, cosine, alpha):
    """Smith's auxiliary function of GGX, Lambda [Walter et al. 2007; Heitz 2014]."""
    c2 = cosine * cosine
    return 0.5 * (k.sqrt(1.0 + alpha * alpha * k.max(1.0 - c2, 0.0) / c2) - 1.0)
