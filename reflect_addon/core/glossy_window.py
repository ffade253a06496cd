"""How much more than its mirror's outline the view of a rough mirror draws: what the lobe's rays meet beside what the mirror ray meets.

A ray of a GGX lobe leaves the mirror direction by twice the slope of its facet; of the slopes, a share c lies below alpha sqrt(c / (1 - c))
(shading.py). The window is widened by the angle of nine tenths, in pixels; rays beyond it, and beyond the picture, are answered by distance maps.
"""

import numpy as np

from .camera import Camera

Window = tuple[int, int, int, int]  # x, y, width, height, px
# Radians for each unit of alpha: 2 sqrt(0.9 / 0.1).
NINE_TENTHS = 6.0


def widened(window: Window, roughness: float, camera: Camera) -> Window:
    """The window, and around it as far as the picture goes what rays of a lobe may meet. roughness: Blender's; 0: the window itself."""
    if not roughness > 0:
        return window
    margin = max(camera.width, camera.height)  # where lines do not spread, an angle is any number of pixels
    if not camera.is_orthographic:
        margin = min(margin, int(np.ceil(NINE_TENTHS * roughness**2 * abs(camera.clip_from_camera[1, 1]) * camera.height / 2)))
    x, y, width, height = window
    left, below = max(x - margin, 0), max(y - margin, 0)
    return left, below, min(x + width + margin, camera.width) - left, min(y + height + margin, camera.height) - below
