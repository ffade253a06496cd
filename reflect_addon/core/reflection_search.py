"""The search for the reflection point: where on the reflector the eye sees a vertex [estalella-2005 sections 3, 4.2, 4.3, 6.1].

Problem. R is where the bisector B of the directions to the eye O and to the vertex V is the normal N. Nothing but look-ups in the
reflector's maps may be asked.
Idea, the paper's (`midpoint`): the error (1 - B N) / 2 (eq. 1) falls along the vector from N's end to B's; projected onto the face of
a cube map it is a field with a sink at R, followed by the midpoint method with a step that grows and shrinks.
Idea, ours (`newton`): B - N is a residual that vanishes at R, and a bilinear look-up knows its slopes; so Gauss and Newton's method
finds R with one look-up a step and quadratically. A step that makes the residual larger is taken back and tried shorter.
Both end on the residual or after `steps`, and say which: what was not found is never given out as found (virtual_status.py).
Hidden vertices (6.1). Behind the reflector a vertex V stands for the point p that V is the image of. The paper searches on with p's
bisector. At the end eye, R and V lie on one line, so `newton` goes along that line instead, between below and above the surface.
`start`: a direction from the centre, w 0: none is known, 1: one is, 2: one is, and this part may have other reflection points, so that
what is behind it somewhere is not hidden yet.
Spaces. All of it in map space (map_space.py); eye and vertex are homogeneous, w = 0 being a direction. `block` is the map's place in
the atlas, and 1 or -1: which side of the surface mirrors.
Limits. Eye or vertex on the surface, or a normal that jumps, have no slope: such searches end as failed, after bounded work.
"""

from dataclasses import dataclass

from . import virtual_status as status
from .reflector_map import look

INPUTS = {"observer": "vec4", "vertex": "vec4", "start": "vec4", "block": "vec4", "ball": "vec4", "cone": "vec4"}
# Sine of the angle between bisector and normal at which a search ends: a few roundings of float32 ...
TOLERANCE = 2e-6
# ... and up to which its last point counts as found: a thousandth of a pixel on a reflector a thousand pixels wide.
ACCEPTED = 1e-4
# Longest step, in sizes of the part; shortest distance to eye and vertex that has a direction.
LONGEST, NEAREST = 0.6, 1e-7
# Where an orthographic camera's eye is taken to be, in sizes; look-ups for the lowest place of a line of sight, and how far from where it
# is nearest to the centre that may be.
FAR_EYE, DEEPEST, AROUND = 1e4, 12, 2.0
# After so many look-ups a squared residual above this does not come down any more: there is no such point on this part.
PATIENCE, HOPELESS = 10.0, 0.05
# A step is cut to this share when it made things worse; damping of the normal equations, of their largest number.
CUT, DAMPING = 0.3, 1e-7


@dataclass(frozen=True)
class _There:
    """The geometry at one point of the surface."""

    look: object
    normal: object  # unit
    eye: object  # unit, to the eye ...
    vertex: object  # ... and to the vertex
    per_eye: object  # 1 / distance, 0 at infinity
    per_vertex: object


def newton(k, scope, observer, vertex, start, block, ball, cone):
    """Kernel of the second-order search. See _answer for what it returns; options: steps, tolerance."""
    names = ("point", "normal", "virtual", "direction", "status", "evaluations")

    def searched():
        found = _newton(k, scope, observer, vertex, start, block, ball)
        return tuple(found[name] for name in names)

    nothing = (k.vec4(0.0, 0.0, 0.0, 2.0), k.vec3(0.0), vertex, k.vec3(0.0), status.FAILED, 0.0)
    return dict(zip(names, k.branch(may_reflect(k, observer, vertex, block, ball, cone), searched, lambda: nothing), strict=True))


def may_reflect(k, observer, vertex, block, ball, cone):
    """Whether a part may have the vertex's reflection point or hide it. ball: its middle and radius; cone: the axis of its normals and
    the cosine of how far they turn from it, both in map space.

    As seen from the middle the bisector has one direction; over the part it turns with the directions to eye and vertex, which turn by
    the ball's angular radius as seen from there."""
    axis = cone.xyz * block.w

    def towards(p):
        to = p.xyz - ball.xyz * p.w
        distance = k.length(to)
        sine = k.select(p.w > 0.5, k.min(ball.w / k.max(distance, NEAREST), 1.0), 0.0)
        return to / k.max(distance, NEAREST), sine

    eye, eye_sine = towards(observer)
    away, vertex_sine = towards(vertex)
    total = eye + away
    long = k.length(total)
    cosine = k.dot(total, axis) / k.max(long, 1e-6)
    # The bisector turns by what both directions turn, over the length of their sum.
    # Chords are sines up to a tenth; where they are not, any turn is possible.
    turn = 1.1 * (eye_sine + vertex_sine) / k.max(long, 1e-3)
    turn = k.select(turn < 0.65, turn, 2.0)
    between = cosine * cone.w + k.sqrt(1.0 - cosine * cosine) * k.sqrt(1.0 - cone.w * cone.w)
    inside = (cosine >= cone.w) | (between >= 1.0 - 0.5 * turn * turn)
    near = (eye_sine > 0.7) | (vertex_sine > 0.7)
    toward, reach = _sight(k, observer, vertex)
    to_ball = ball.xyz - vertex.xyz
    along = k.clamp(k.dot(to_ball, toward), 0.0, reach)
    missed = to_ball - toward * along
    on_sight = (vertex.w > 0.5) & (k.dot(missed, missed) <= ball.w * ball.w)
    return k.name("may_reflect", inside | near | on_sight | (cone.w < -0.5))


def _newton(k, scope, observer, vertex, start, block, ball):
    begin = begin_at(k, observer, vertex, start)
    toward, reach = _sight(k, observer, vertex)
    # Where the line of sight comes nearest to the centre; below the surface there, the vertex is behind it.
    deep = k.clamp(-k.dot(vertex.xyz, toward), 0.0, reach)
    nearest = k.name("nearest", vertex.xyz + toward * deep)
    behind = k.name("behind", (_height(k, scope, nearest, block) < 0.0) & (vertex.w > 0.5))
    sought = (scope, observer, vertex, block)
    k.cite("where a surface has several reflection points, one that is behind a part of it may be reflected by another")
    front_first = k.name("front_first", behind & (start.w < 1.5))
    first = k.branch(front_first, lambda: _front(k, *sought, toward, deep, reach), lambda: descend(k, *sought, begin))
    k.cite("6.1: what is not reflected may be hidden all the same, where the reflector is no ball")
    missed = ball.xyz - vertex.xyz
    missed = missed - toward * k.clamp(k.dot(missed, toward), 0.0, reach)
    again = ~_found(k, first, front_first) & ~front_first & (vertex.w > 0.5) & (k.dot(missed, missed) <= ball.w * ball.w)

    def second():
        deeper = k.branch(behind, lambda: (deep,), lambda: (_deepest(k, scope, vertex, block, toward, deep, reach),))[0]
        return (*_front(k, *sought, toward, deeper, reach), 1.0)

    mode = k.select(front_first, 1.0, 0.0)
    direction, residual, evaluations, *_, hidden = k.branch(again, second, lambda: (*first, mode))
    evaluations = k.select(again, evaluations + first[2] + DEEPEST, evaluations) + 1.0
    return _answer(k, scope, observer, vertex, block, direction, residual, evaluations, hidden > 0.5)


def descend(k, scope, observer, vertex, block, begin):
    """(direction, residual, evaluations, toward eye, toward vertex): Gauss and Newton's method with steps that are taken back."""
    tolerance = scope.options["tolerance"]

    def step(i, best, merit, residual, move, share, count, eye_side, vertex_side):
        direction = k.name("tried", best + move * share)
        here = _geometry(k, scope, observer, vertex, direction, block)
        value, slope_x, slope_y, sine = _residual(k, here)
        merit_here = k.dot(value, value)
        better = k.name("better", merit_here < merit)
        k.cite("Gauss and Newton: the normal equations of two unknowns")
        a, b, c = k.dot(slope_x, slope_x), k.dot(slope_x, slope_y), k.dot(slope_y, slope_y)
        damping = DAMPING * (a + c) + 1e-30
        a, c = a + damping, c + damping
        p, q = k.dot(slope_x, value), k.dot(slope_y, value)
        per_determinant = 1.0 / k.max(a * c - b * b, 1e-35)
        x, y = (b * q - c * p) * per_determinant, (b * p - a * q) * per_determinant
        wanted = here.look.point_x * x + here.look.point_y * y
        wanted = wanted * k.min(LONGEST / k.max(k.length(wanted), 1e-20), 1.0)
        # A bilinear position lies a little beside the direction that it was looked up along; steps go from that one.
        place = k.normalize(direction) * k.length(here.look.point)
        state = (
            k.select(better, place, best), k.select(better, merit_here, merit), k.select(better, sine, residual),
            k.select(better, wanted, move), k.select(better, 1.0, share * CUT), count + 1.0,
            k.select(better, k.dot(here.eye, here.normal), eye_side), k.select(better, k.dot(here.vertex, here.normal), vertex_side),
        )  # fmt: skip
        hopeless = (count >= PATIENCE) & (state[1] > HOPELESS)
        return state, (state[2] <= tolerance) | (state[4] < 1e-3) | hopeless

    best, _, residual, move, _, count, eye_side, vertex_side = k.loop(
        scope.options["steps"], (begin, 1e9, 2.0, k.vec3(0.0), 1.0, 0.0, -1.0, -1.0), step
    )
    # The last point's own step costs nothing: where light grazes, the residual's tolerance is far in sizes.
    return k.select(residual <= tolerance, best + move, best), residual, count, eye_side, vertex_side


def _sight(k, observer, vertex):
    """(unit vector from the vertex to the eye, how far it is: to an orthographic camera FAR_EYE)."""
    across = observer.xyz - vertex.xyz * observer.w
    reach = k.length(across)
    return across / k.max(reach, NEAREST), k.select(observer.w > 0.5, reach, FAR_EYE)


def _height(k, scope, place, block):
    """How far a place is above the reflecting side, along the direction from the centre; negative below it."""
    here = look(k, scope, block, place, False)
    above = k.length(place) - k.length(here.point)
    return k.select(k.dot(here.normal, here.point) < 0.0, -above, above)


def _deepest(k, scope, vertex, block, toward, deep, reach):
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
        k.cite("the Illinois rule, as in _front")
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


def _front(k, scope, observer, vertex, block, toward, deep, reach):
    """As descend, of the place where the line of sight enters the surface: between `deep` below it and the eye, by false position.

    There the hidden vertex's own point p, mirrored about the tangent plane, has bisector and normal together (6.1)."""

    def at(distance):
        return vertex.xyz + toward * distance

    def step(i, low, high, low_value, high_value, last, count):
        share = k.clamp(low_value / k.away_from_zero(low_value - high_value), 0.0, 1.0)
        tried = k.name("sight", k.mix(low, high, share))
        value = _height(k, scope, at(tried), block)
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
    inner, outer = _height(k, scope, lowest, block), _height(k, scope, at(outside), block)
    begin = (deep, outside, inner, outer, 0.0, 3.0)
    low, high, low_value, high_value, _, count = k.loop(scope.options["steps"], begin, step)
    place = at(k.select(k.abs(low_value) < k.abs(high_value), low, high))
    here = _geometry(k, scope, observer, vertex, place, block, False)
    eye_side, vertex_side = k.dot(here.eye, here.normal), k.dot(here.vertex, here.normal)
    off = k.length(here.look.point - place) / (1.0 + k.length(place))
    return place, k.select((inner < 0.0) & (outer > 0.0), off, 2.0), count + 1.0, eye_side, vertex_side


def _residual(k, here: _There):
    """(B - N, its slopes over a texel in x and y, sine of the angle between both)."""
    total = here.eye + here.vertex
    per_sum = 1.0 / k.max(k.length(total), 1e-6)
    per_normal = 1.0 / k.max(k.length(here.look.normal), 1e-6)
    bisector = total * per_sum

    def slope(point, normal):
        eye = (here.eye * k.dot(here.eye, point) - point) * here.per_eye
        vertex = (here.vertex * k.dot(here.vertex, point) - point) * here.per_vertex
        both = eye + vertex
        bent = (both - bisector * k.dot(bisector, both)) * per_sum
        return bent - (normal - here.normal * k.dot(here.normal, normal)) * per_normal

    sine = k.select(k.dot(bisector, here.normal) > 0.0, k.length(k.cross(bisector, here.normal)), 2.0)
    slopes = (slope(here.look.point_x, here.look.normal_x), slope(here.look.point_y, here.look.normal_y))
    return bisector - here.normal, *slopes, sine


def midpoint(k, scope, observer, vertex, start, block, ball, cone):
    """Kernel of the paper's search (4.3), two map evaluations a step. Hidden vertices: its inverse search (6.1)."""
    begin = begin_at(k, observer, vertex, start)
    first = follow(k, scope, observer, vertex, block, begin)
    again = ~_found(k, first, False)

    def second():
        return (*follow(k, scope, observer, vertex, block, k.normalize(observer.xyz), True), 1.0)

    direction, residual, evaluations, *rest, hidden = k.branch(again, second, lambda: (*first, 0.0))
    evaluations = k.select(again, evaluations + first[2], evaluations)
    return _answer(k, scope, observer, vertex, block, direction, residual, evaluations, hidden > 0.5)


def follow(k, scope, observer, vertex, block, begin, behind: bool = False):
    """(place on the cube map, residual, evaluations, toward eye, toward vertex)."""
    epsilon = scope.options["tolerance"]

    def field(place):
        """The projected bisector direction b_P at a place on the cube map's faces, and the geometry there."""
        here = _geometry(k, scope, observer, vertex, place, block, False)
        away = here.vertex
        if behind:
            k.cite("6.1: the bisector of p, the mirror image of the hidden vertex at the tangent plane here")
            away = here.vertex - here.normal * (2.0 * k.dot(here.vertex, here.normal))
        bisector = k.normalize(here.eye + away)
        bent = bisector - here.normal
        k.cite("projected from the centre onto the cube's face")
        on_face = _on_cube(k, place)
        major = k.dot(bent, _axis(k, on_face))
        sine = k.select(k.dot(bisector, here.normal) > 0.0, k.length(k.cross(bisector, here.normal)), 2.0)
        return bent - on_face * major, sine, here

    def step(i, place, residual, size, count, eye_side, vertex_side, last):
        bent, sine, here = field(place)
        middle = k.name("middle", _on_cube(k, place + bent * (0.5 * size)))
        bent_there, _, _ = field(middle)
        k.cite("4.3: very different vectors shrink the step, similar ones let it grow")
        off = k.length(bent_there - bent) / k.max(k.length(bent), 1e-12)
        ended = sine <= epsilon
        onward = k.select(ended, place, _on_cube(k, place + bent_there * size))
        grown = size * k.select(off > 0.6, 0.5, k.select(off < 0.4, 1.5, 1.0))
        state = (
            onward, sine, grown, count + 2.0, k.dot(here.eye, here.normal), k.dot(here.vertex, here.normal), place
        )
        return state, ended

    # The last step's place has a residual; where it led to has none yet.
    _, residual, _, count, eye_side, vertex_side, place = k.loop(
        scope.options["steps"], (_on_cube(k, begin), 2.0, 1.0, 0.0, -1.0, -1.0, _on_cube(k, begin)), step
    )
    return place, residual, count, eye_side, vertex_side


def _on_cube(k, direction):
    """The place on the cube's faces that a direction leads to."""
    return direction / k.max(k.max(k.abs(direction.x), k.abs(direction.y)), k.abs(direction.z), 1e-20)


def _axis(k, place):
    """The axis of the face that a place is on, with its sign: its dot product with a vector is that one's part along it."""
    a = k.abs(place)
    is_x, is_y = (a.x >= a.y) & (a.x >= a.z), a.y >= a.z
    sign = k.select(k.select(is_x, place.x, k.select(is_y, place.y, place.z)) < 0.0, -1.0, 1.0)
    one, none = sign, 0.0 * sign
    return k.vec3(
        k.select(is_x, one, none), k.select(is_x, none, k.select(is_y, one, none)), k.select(is_x, none, k.select(is_y, none, one))
    )


def begin_at(k, observer, vertex, start):
    """Where a search begins: the given direction, or half way between eye and vertex as seen from the centre."""
    half = k.normalize(observer.xyz) + k.normalize(vertex.xyz)
    half = k.select(k.dot(half, half) > 1e-4, half, observer.xyz)
    return k.name("begin", k.select(start.w > 0.5, start.xyz, k.normalize(half)))


def _geometry(k, scope, observer, vertex, direction, block, slopes: bool = True) -> _There:
    here = look(k, scope, block, direction, slopes)

    def towards(p):
        to = p.xyz - here.point * p.w
        per = 1.0 / k.max(k.length(to), NEAREST)
        return to * per, per * p.w

    eye, per_eye = towards(observer)
    away, per_vertex = towards(vertex)
    return _There(here, k.normalize(here.normal), eye, away, per_eye, per_vertex)


def _found(k, ended, behind):
    """Whether a search ended where it should: eye and vertex before the surface, or the vertex behind it."""
    _, residual, _, eye_side, vertex_side = ended
    if isinstance(behind, bool):
        right = vertex_side < 1e-4 if behind else vertex_side > -1e-4
    else:
        right = k.select(behind, -vertex_side, vertex_side) > -1e-4
    return (residual <= ACCEPTED) & (eye_side > -1e-4) & right


def _answer(k, scope, observer, vertex, block, direction, residual, evaluations, behind):
    """{'point': vec4 R and the residual, 'normal': vec3 unit, 'virtual': vec4 the vertex mirrored about the tangent plane at R, w as
    the vertex's, 'direction': vec3 unit from the centre, 'status': float, 'evaluations': float of the map}."""
    here = _geometry(k, scope, observer, vertex, direction, block, False)
    ended = (direction, residual, evaluations, k.dot(here.eye, here.normal), k.dot(here.vertex, here.normal))
    found = _found(k, ended, behind)
    height = k.dot(vertex.xyz - here.look.point * vertex.w, here.normal)
    virtual = k.vec4(vertex.xyz - here.normal * (2.0 * height), vertex.w)
    there = k.select(behind, status.HIDDEN, k.select(here.look.inside > 0.5, status.CONVERGED, status.UNREFLECTED))
    return {
        "point": k.vec4(here.look.point, residual),
        "normal": here.normal,
        "virtual": virtual,
        "direction": k.normalize(direction),
        "status": k.select(found, there, status.FAILED),
        "evaluations": evaluations,
    }
