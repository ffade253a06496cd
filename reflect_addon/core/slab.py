"""Where a ray leaves a box: the slab method's far distances [Kay and Kajiya 1986], as kernels of boxes share them."""

from . import spaces


def exit_distance(k, start, along, low, high, axis: str):
    """Distance to the wall of one axis ('x', 'y', 'z') that a ray from inside the box goes to; 2 FAR where it never does.

    start, along: vec3, m and unit, in the box's own axes; low, high: vec3 corners, m."""
    d, p = getattr(along, axis), getattr(start, axis)
    wall = k.select(d > 0.0, getattr(high, axis), getattr(low, axis))
    # Parallel to the wall: never leaves through it. 1e-12 keeps FAR / d finite in float32.
    return k.select(k.abs(d) > 1e-12, (wall - p) / k.select(k.abs(d) > 1e-12, d, 1.0), 2.0 * spaces.FAR)
