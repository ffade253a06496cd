"""What is seen through a pane, as an ordinary camera: the same one, begun behind the pane and moved a little.

Problem. A ray leaves a flat pane as it came, beside where it would have gone; a view has one eye for all rays.
Idea. Parallel faces give back the direction, so pixel (x, y) of the view is what pixel (x, y) of the pane shows. The line of the ray that
leaves meets the axis through the eye across the pane nearer by s = t (1 - cos a / sqrt(n^2 - sin^2 a)), t the thickness: for rays near the axis
t (1 - 1 / n), by which the eye is moved. So things behind a pane look nearer by a third of a window's thickness.
Its near plane is its other face, laid into the frustum as a mirror's is (mirrored_view.py), so that nothing before it is seen again, and mirrors
and panes behind it are views of this view, as in the recursion of nielsen-2002 (3.1).
Limits. At an angle a to the axis the view is off by s(a) - s(0): 0.26 t at 60 degrees, n = 1.5.
"""

from dataclasses import replace

import numpy as np

from .camera import Camera
from .glass_shapes import Pane
from .mirrored_view import IN_PLANE, begun_at, height_of


def shift(thickness: float, ior: float, cosine: float = 1.0) -> float:
    """m by which the line of a ray that leaves a pane is nearer along the pane's axis; cosine: of the ray to the axis."""
    inner = np.sqrt(max(ior**2 - 1 + cosine**2, 1e-12))
    return float(thickness * (1 - cosine / inner))


def through(camera: Camera, pane: Pane) -> Camera | None:
    """What the pane lets be seen, of the size of camera's picture; None where camera does not see this side of it, or all beyond it is
    beyond the far plane."""
    if not height_of(camera, pane.origin, pane.normal) > IN_PLANE:
        return None
    pose = camera.world_from_camera.copy()
    pose[:3, 3] -= pane.normal * shift(pane.thickness, pane.ior)
    return begun_at(replace(camera, world_from_camera=pose), pane.beyond)
