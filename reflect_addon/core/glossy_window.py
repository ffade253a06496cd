"""How much more than its mirror's outline the view of a rough mirror draws: what the lobe's rays meet beside what the mirror ray meets.

A ray of a GGX lobe leaves the mirror direction by twice the slope of its facet; of the slopes, a share c lies below alpha sqrt(c / (1 - c))
(shading.py). The window is widened by the angle of 98 of 100 in pixels, beyond the picture too; rays beyond it are answered by distance maps. With nine
tenths and half a picture's side FLIP against Cycles was 0.166 instead of 0.128 at roughness 0.5, 0.083 instead of 0.071 at 0.35.
"""

import numpy as np

from .camera import Camera

Window = tuple[int, int, int, int]  # x, y, width, height, px; may reach beyond the picture
# Radians for each unit of alpha: 2 sqrt(0.98 / 0.02).
NEARLY_ALL = 14.0
# Of the picture's larger side, at most: reached at roughness 0.3, with up to nine times the picture's pixels.
WIDEST = 1.0


def widened(window: Window, roughness: float, camera: Camera) -> Window:
    """The window, and around it what rays of a lobe may meet. roughness: Blender's; 0: the window itself."""
    if not roughness > 0:
        return window
    margin = WIDEST * max(camera.width, camera.height)
    if not camera.is_orthographic:  # where lines do not spread, an angle is any number of pixels
        margin = min(margin, NEARLY_ALL * roughness**2 * abs(camera.clip_from_camera[1, 1]) * camera.height / 2)
    margin = int(np.ceil(margin))
    x, y, width, height = window
    return x - margin, y - margin, width + 2 * margin, height + 2 * margin
