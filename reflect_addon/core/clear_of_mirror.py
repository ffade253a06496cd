"""A mirrored view's near plane, a little before its mirror: what lies in the mirror itself is not seen in it.

Problem. The mirror's own faces lie in the near plane (mirrored_view.py), and float32 says of half of their pixels that they are before it.
Idea. The plane moves by some float32 steps of the coordinates that a shader multiplies; what stands on the mirror loses as little.
"""

from dataclasses import replace

import numpy as np

from .camera import Camera
from .mirror_planes import MirrorPlane

# A vertex shader's products and sums of places, each rounded.
STEPS = 2.0**-19


def clear_of(camera: Camera, plane: MirrorPlane) -> Camera:
    """camera: mirrored_view.mirrored's, of this plane."""
    clip = camera.clip_from_camera.copy()
    reach = np.linalg.norm(plane.outline - camera.world_from_camera[:3, 3], axis=1).max()
    clip[2, 3] -= STEPS * reach * np.linalg.norm(clip[2, :3] + clip[3, :3])
    return replace(camera, clip_from_camera=clip)
