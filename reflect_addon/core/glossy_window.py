"""How much more than its mirror's outline the view of a rough mirror draws, and how finely: what the lobe's rays meet beside what the mirror ray meets.

A ray of a GGX lobe leaves the mirror direction by twice the slope of its facet; of the slopes, a share c lies below alpha sqrt(c / (1 - c))
(shading.py). The window is widened by the angle of 98 of 100 in pixels, beyond the picture too; rays beyond it are answered by distance maps. With nine
tenths and half a picture's side FLIP against Cycles was 0.166 instead of 0.128 at roughness 0.5, 0.083 instead of 0.071 at 0.35.
A narrow lobe is blurred by the view's own pixels: an edge is where a pixel's middle falls, so a lobe of a pixel and a half sees steps. The view of a lobe
that is narrower than LOBE pixels therefore has several pixels to each of the picture's. At roughness 0.05, 160x120, FLIP is 0.0170 with one, 0.0107
with 3 x 3 and 0.0094 with 5 x 5, where two truths differ by 0.0051.
"""

import numpy as np

from .camera import Camera
from .shading import ROUGHNESS_SPREAD

Window = tuple[int, int, int, int]  # x, y, width, height, px; may reach beyond the picture
# Radians for each unit of alpha: 2 sqrt(0.98 / 0.02).
NEARLY_ALL = 14.0
# Of the picture's larger side, at most: reached at roughness 0.3, with up to nine times the picture's pixels.
WIDEST = 1.0
# px of a view in the angle that half of a lobe's light comes from: what is narrower is drawn finer ...
LOBE = 8.0
# ... unless it is narrower than so many px of the picture, where FLIP would gain a tenth at most ...
SHARP = 0.5
# ... px along one of the picture's at most, and in all: memory of a level is a hundred bytes each.
FINEST, MOST_PIXELS = 5, 2**20


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


def fineness(window: Window, roughness: float, camera: Camera) -> int:
    """Pixels of a rough mirror's view along one of the picture's. window: px of the picture in which the mirror is seen; camera: the picture's size."""
    if not roughness > 0 or camera.is_orthographic:
        return 1
    lobe = ROUGHNESS_SPREAD * roughness**2 * abs(camera.clip_from_camera[1, 1]) * camera.height / 2
    if lobe < SHARP:
        return 1
    _, _, width, height = widened(window, roughness, camera)
    room = int(np.sqrt(MOST_PIXELS / (width * height)))
    return max(min(int(np.ceil(LOBE / lobe)), FINEST, room), 1)
