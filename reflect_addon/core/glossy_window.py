"""How much more than its mirror's outline the view of a rough mirror draws: what the lobe's rays meet beside what the mirror ray meets.

A ray of a GGX lobe leaves the mirror direction by twice the slope of its facet; of the slopes, a share c lies below alpha sqrt(c / (1 - c))
(shading.py). The window is widened by the angle of nine tenths, in pixels, beyond the picture too; rays beyond it are answered by distance maps.
"""

import numpy as np

from .camera import Camera

Window = tuple[int, int, int, int]  # x, y, width, height, px; may reach beyond the picture
# Radians for each unit of alpha: 2 sqrt(0.9 / 0.1).
NINE_TENTHS = 14.0
# Of the picture's larger side, at most.
WIDEST = 1.0


def widened(window: Window, roughness: float, camera: Camera) -> Window:
    """The window, and around it what rays of a lobe may meet. roughness: Blender's; 0: the window itself."""
    if not roughness > 0:
        return window
    margin = WIDEST * max(camera.width, camera.height)
    if not camera.is_orthographic:  # where lines do not spread, an angle is any number of pixels
        margin = min(margin, NINE_TENTHS * roughness**2 * abs(camera.clip_from_camera[1, 1]) * camera.height / 2)
    margin = int(np.ceil(margin))
    x, y, width, height = window
    return x - margin, y - margin, width + 2 * margin, height + 2 * margin
