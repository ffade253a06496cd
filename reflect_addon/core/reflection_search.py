"""The search for the reflection point: where on the reflector the eye sees a vertex [estalella-2005 sections 3, 4.2, 4.3, 6.1].

Problem. R is where the bisector B of the directions to the eye O and to the vertex V is the normal N. Nothing but look-ups in the
reflector's maps may be asked.
Idea, the paper's (`midpoint`): the bisectors make a field with a sink at R, which is followed (bisector_field.py).
Idea, ours (`newton`): B - N is a residual that vanishes at R, and a bilinear look-up knows its slopes; so Gauss and Newton's method
finds R with one look-up a step and quadratically. A step that makes the residual larger is taken back and tried shorter.
Both end on the residual or after `steps`, and say which: what was not found is never given out as found (virtual_status.py).
Hidden vertices (6.1). Behind the reflector a vertex V stands for the point p that V is the image of. The paper searches on with p's
bisector. At the end eye, R and V lie on one line, so `newton` goes along that line instead (line_of_sight.py).
`start`: a direction from the centre, w 0: none is known, 1: one is, 2: one is, and this part may have other reflection points, so that
what is behind it somewhere is not hidden yet.
Spaces. All of it in map space (map_space.py); eye and vertex are homogeneous, w = 0 being a direction. `block` is the map's place in
the atlas, and 1 or -1: which side of the surface mirrors.
Limits. Eye or vertex on the surface, or a normal that jumps, have no slope: such searches end as failed, after bounded work.
"""

from . import virtual_status as status
from .bisector_field import follow
from .line_of_sight import DEEPEST, deepest, entry, height_above, line_of_sight
from .reflection_geometry import NEAREST, There, geometry, off_normal

INPUTS = {"observer": "vec4", "vertex": "vec4", "start": "vec4", "block": "vec4", "ball": "vec4", "cone": "vec4"}
# Sine of the angle between bisector and normal at which a search ends: a few roundings of float32 ...
TOLERANCE = 2e-6
# ... and up to which its last point counts as found: a thousandth of a pixel on a reflector a thousand pixels wide.
ACCEPTED = 1e-4
# Longest step, in sizes of the part.
LONGEST = 0.6
# After so many look-ups a squared residual above this does not come down any more: there is no such point on this part.
PATIENCE, HOPELESS = 10.0, 0.05
# A step is cut to this share when it made things worse; damping of the normal equations, of their largest number.
CUT, DAMPING = 0.3, 1e-7


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
    toward, reach = line_of_sight(k, observer, vertex)
    to_ball = ball.xyz - vertex.xyz
    along = k.clamp(k.dot(to_ball, toward), 0.0, reach)
    missed = to_ball - toward * along
    on_sight = (vertex.w > 0.5) & (k.dot(missed, missed) <= ball.w * ball.w)
    return k.name("may_reflect", inside | near | on_sight | (cone.w < -0.5))


def _newton(k, scope, observer, vertex, start, block, ball):
    begin = begin_at(k, observer, vertex, start)
    toward, reach = line_of_sight(k, observer, vertex)
    # Where the line of sight comes nearest to the centre; below the surface there, the vertex is behind it.
    deep = k.clamp(-k.dot(vertex.xyz, toward), 0.0, reach)
    nearest = k.name("nearest", vertex.xyz + toward * deep)
    behind = k.name("behind", (height_above(k, scope, nearest, block) < 0.0) & (vertex.w > 0.5))
    sought = (scope, observer, vertex, block)
    k.cite("where a surface has several reflection points, one that is behind a part of it may be reflected by another")
    front_first = k.name("front_first", behind & (start.w < 1.5))
    first = k.branch(front_first, lambda: entry(k, *sought, toward, deep, reach), lambda: descend(k, *sought, begin))
    k.cite("6.1: what is not reflected may be hidden all the same, where the reflector is no ball")
    missed = ball.xyz - vertex.xyz
    missed = missed - toward * k.clamp(k.dot(missed, toward), 0.0, reach)
    again = ~_found(k, first, front_first) & ~front_first & (vertex.w > 0.5) & (k.dot(missed, missed) <= ball.w * ball.w)

    def second():
        deeper = k.branch(behind, lambda: (deep,), lambda: (deepest(k, scope, vertex, block, toward, deep, reach),))[0]
        return (*entry(k, *sought, toward, deeper, reach), 1.0)

    mode = k.select(front_first, 1.0, 0.0)
    direction, residual, evaluations, *_, hidden = k.branch(again, second, lambda: (*first, mode))
    evaluations = k.select(again, evaluations + first[2] + DEEPEST, evaluations) + 1.0
    return _answer(k, scope, observer, vertex, block, direction, residual, evaluations, hidden > 0.5)


def descend(k, scope, observer, vertex, block, begin):
    """(direction, residual, evaluations, toward eye, toward vertex): Gauss and Newton's method with steps that are taken back."""
    tolerance = scope.options["tolerance"]

    def step(i, best, merit, residual, move, share, count, eye_side, vertex_side):
        direction = k.name("tried", best + move * share)
        here = geometry(k, scope, observer, vertex, direction, block)
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


def _residual(k, here: There):
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

    sine = off_normal(k, bisector, here)
    slopes = (slope(here.look.point_x, here.look.normal_x), slope(here.look.point_y, here.look.normal_y))
    return bisector - here.normal, *slopes, sine


def midpoint(k, scope, observer, vertex, start, block, ball, cone):
    """Kernel of the paper's search (4.3), two map evaluations a step. Hidden vertices: its inverse search (6.1)."""
    begin = begin_at(k, observer, vertex, start)
    first = follow(k, scope, observer, vertex, block, begin)
    again = ~_found(k, first, False)

    def second():
        return (*follow(k, scope, observer, vertex, block, k.normalize(observer.xyz), True), 1.0)

    direction, residual, evaluations, *_, hidden = k.branch(again, second, lambda: (*first, 0.0))
    evaluations = k.select(again, evaluations + first[2], evaluations)
    return _answer(k, scope, observer, vertex, block, direction, residual, evaluations, hidden > 0.5)


def begin_at(k, observer, vertex, start):
    """Where a search begins: the given direction, or half way between eye and vertex as seen from the centre."""
    half = k.normalize(observer.xyz) + k.normalize(vertex.xyz)
    half = k.select(k.dot(half, half) > 1e-4, half, observer.xyz)
    return k.name("begin", k.select(start.w > 0.5, start.xyz, k.normalize(half)))


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
    here = geometry(k, scope, observer, vertex, direction, block, False)
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
