"""Kernel: the paper's own search for a reflection point, along the field of bisectors [estalella-2005 sections 4.2 and 4.3].

The error (1 - B N) / 2 (eq. 1) falls along the vector from the end of the normal N to that of the bisector B; projected onto the face of
a cube map it is a field with a sink at the reflection point, followed by the midpoint method with a step that grows and shrinks.
Spaces as in reflection_search.py.
"""

from .reflection_geometry import geometry, off_normal


def follow(k, scope, observer, vertex, block, begin, behind: bool = False):
    """As reflection_search.descend: (place on the cube map, residual, evaluations, toward eye, toward vertex)."""
    epsilon = scope.options["tolerance"]

    def field(place):
        """The projected bisector direction b_P at a place on the cube map's faces, and the geometry there."""
        here = geometry(k, scope, observer, vertex, place, block, False)
        away = here.vertex
        if behind:
            k.cite("6.1: the bisector of p, the mirror image of the hidden vertex at the tangent plane here")
            away = here.vertex - here.normal * (2.0 * k.dot(here.vertex, here.normal))
        bisector = k.normalize(here.eye + away)
        bent = bisector - here.normal
        k.cite("projected from the centre onto the cube's face")
        on_face = _on_cube(k, place)
        major = k.dot(bent, _axis(k, on_face))
        sine = off_normal(k, bisector, here)
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
