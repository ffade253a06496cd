"""Kernel: where the line of sight from a vertex to the eye is above and below a reflector [estalella-2005 section 6.1].

Behind the reflector a vertex V stands for the point that V is the image of. Its reflection point R lies on the line from the eye to V,
where that enters the surface: a root along one line, whatever the surface's normals do.
Spaces as in reflection_search.py: map space, eye and vertex homogeneous. Distances go along the line from the vertex, in sizes.
"""

from .reflection_geometry import NEAREST, geometry
from .reflector_map import look

# Where an orthographic camera's eye is taken to be, in sizes; look-ups for the lowest place of a line of sight, and how far from where it
# is nearest to the centre that may be.
FAR_EYE, DEEPEST, AROUND = 1e4, 12, 2.0


def line_of_sight(k, observer, vertex):
    """(unit vector from the vertex to the eye, how far it is: to an orthographic camera FAR_EYE)."""
    across = observer.xyz - vertex.xyz * observer.w
    reach = k.length(across)
    return across / k.max(reach, NEAREST), k.select(observer.w > 0.5, reach, FAR_EYE)


def height_above(k, scope, place, block):
    """How far a place is above the reflecting side, along the direction from the centre; negative below it."""
    here = look(k, scope, block, place, False)
    above = k.length(place) - k.length(here.point)
    return k.select(k.dot(here.normal, here.point) < 0.0, -above, above)


def deepest(k, scope, vertex, block, toward, deep, reach):
    """Distance from the vertex to where the line of sight is below the surface, or lowest. deep: where it is nearest to the centre.

    g(p), the length of p over that of the surface's point along it, is 1 on the surface and convex where that is; its slope is
    N / (N P). On an ellipsoid the slope of g g is linear along a line, so that false position on it ends at once."""
    low, high = k.max(deep - AROUND, 0.0), k.min(deep + AROUND, reach)

    def slope(distance):
        """(slope of g g / 2 along the line of sight, g), of 1 / g where the reflector is seen from inside."""
        place = vertex.xyz + toward * distance
        here = look(k, scope, block, place, False)
        side = k.dot(here.normal, here.point)
        g = k.length(place) / k.max(k.length(here.point), NEAREST)
        rising = g * k.dot(here.normal, toward) / k.max(k.abs(side), NEAREST)
        return rising, k.select(side < 0.0, 1.0 / k.max(g, NEAREST), g)

    def step(i, low, high, low_slope, high_slope, best, lowest, last):
        share = k.clamp(low_slope / k.away_from_zero(low_slope - high_slope), 0.0, 1.0)
        tried = k.name("lowest", k.mix(low, high, share))
        rising, height = slope(tried)
        up, better = rising > 0.0, height < lowest
        k.cite("the Illinois rule, as in entry")
        state = (
            k.select(up, low, tried), k.select(up, tried, high),
            k.select(up, low_slope * k.select(last > 0.5, 0.5, 1.0), rising),
            k.select(up, rising, high_slope * k.select(last < -0.5, 0.5, 1.0)),
            k.select(better, tried, best), k.select(better, height, lowest), k.select(up, 1.0, -1.0),
        )  # fmt: skip
        return state, height < 1.0

    low_slope, low_height = slope(low)
    high_slope, high_height = slope(high)
    nearer = low_height < high_height
    begin = (low, high, low_slope, high_slope, k.select(nearer, low, high), k.select(nearer, low_height, high_height), 0.0)
    return k.loop(DEEPEST - 2, begin, step)[4]


def entry(k, scope, observer, vertex, block, toward, deep, reach):
    """As reflection_search.descend, of the place where the line of sight enters the surface, between `deep` below it and the eye: false
    position.

    There the hidden vertex's own point p, mirrored about the tangent plane, has bisector and normal together (6.1)."""

    def at(distance):
        return vertex.xyz + toward * distance

    def step(i, low, high, low_value, high_value, last, count):
        share = k.clamp(low_value / k.away_from_zero(low_value - high_value), 0.0, 1.0)
        tried = k.name("sight", k.mix(low, high, share))
        value = height_above(k, scope, at(tried), block)
        is_below = value < 0.0
        k.cite("the Illinois rule: an end that stays twice in a row counts half")
        state = (
            k.select(is_below, tried, low), k.select(is_below, high, tried),
            k.select(is_below, value, low_value * k.select(last > 0.5, 0.5, 1.0)),
            k.select(is_below, high_value * k.select(last < -0.5, 0.5, 1.0), value),
            k.select(is_below, -1.0, 1.0), count + 1.0,
        )  # fmt: skip
        return state, k.abs(value) < 2e-7 * (1.0 + k.length(at(tried)))

    # Neither the reflector nor a ball as wide as it is here reaches so far above the lowest place.
    lowest = at(deep)
    below = look(k, scope, block, lowest, False).point
    outside = k.min(deep + k.max(2.0 * k.length(below) + k.length(lowest), AROUND), reach)
    inner, outer = height_above(k, scope, lowest, block), height_above(k, scope, at(outside), block)
    begin = (deep, outside, inner, outer, 0.0, 3.0)
    low, high, low_value, high_value, _, count = k.loop(scope.options["steps"], begin, step)
    place = at(k.select(k.abs(low_value) < k.abs(high_value), low, high))
    here = geometry(k, scope, observer, vertex, place, block, False)
    eye_side, vertex_side = k.dot(here.eye, here.normal), k.dot(here.vertex, here.normal)
    off = k.length(here.look.point - place) / (1.0 + k.length(place))
    return place, k.select((inner < 0.0) & (outer > 0.0), off, 2.0), count + 1.0, eye_side, vertex_side
