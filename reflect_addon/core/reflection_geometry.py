"""Kernel: the reflection at one point of a reflector's surface: its normal, and the directions to eye and vertex [estalella-2005 3].

Spaces as in reflection_search.py: map space, eye and vertex homogeneous.
"""

from dataclasses import dataclass

from .reflector_map import look

# Shortest distance to eye and vertex that has a direction, in sizes of the part.
NEAREST = 1e-7


@dataclass(frozen=True)
class There:
    """The geometry at one point of the surface."""

    look: object
    normal: object  # unit
    eye: object  # unit, to the eye ...
    vertex: object  # ... and to the vertex
    per_eye: object  # 1 / distance, 0 at infinity
    per_vertex: object


def geometry(k, scope, observer, vertex, direction, block, slopes: bool = True) -> There:
    """The geometry where the surface is met along `direction` from the centre; slopes: with how look-ups change over a texel."""
    here = look(k, scope, block, direction, slopes)

    def towards(p):
        to = p.xyz - here.point * p.w
        per = 1.0 / k.max(k.length(to), NEAREST)
        return to * per, per * p.w

    eye, per_eye = towards(observer)
    away, per_vertex = towards(vertex)
    return There(here, k.normalize(here.normal), eye, away, per_eye, per_vertex)


def off_normal(k, bisector, here: There):
    """Sine of the angle between the bisector and the normal; 2 where they point to opposite sides."""
    return k.select(k.dot(bisector, here.normal) > 0.0, k.length(k.cross(bisector, here.normal)), 2.0)
