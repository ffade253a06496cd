"""The camera on the GPU: relative to the eye, in float64 until the last moment."""

import numpy as np

from ..core.camera import Camera
from .device import ensure

# What shaders see of the camera. frame: x 1 = orthographic, y footprint of a pixel (at 1 m for a perspective
# camera), z depth bias, w 1 = rays of the ray map have footprints, 0 = they are lines. Vectors are padded to vec4 as uniform
# buffers ask.
VIEW_STRUCT = "struct ReflectView { mat4 clip_from_rel; vec4 eye; vec4 forward; vec4 frame; };"
VIEW_BLOCK = (VIEW_STRUCT, "ReflectView", "view")


class View:
    """The uniform buffer of the camera, rewritten for each frame (128 bytes)."""

    def __init__(self):
        self.eye = np.zeros(3)
        self.rel_from_clip = np.eye(4, dtype=np.float32).ravel()  # column by column: clip space to space relative to the eye
        self.footprint = 0.0  # of a pixel, at 1 m for a perspective camera
        self.has_footprints = True  # its rays; without them each is a line, as the truth's
        self._buffer = None

    def set(self, camera: Camera, depth_bias: float = 0.0):
        gpu = ensure()
        self.eye = camera.world_from_camera[:3, 3].astype(np.float64)
        camera_from_rel = np.eye(4)
        camera_from_rel[:3, :3] = camera.world_from_camera[:3, :3].T
        clip_from_rel = camera.clip_from_camera @ camera_from_rel
        self.rel_from_clip = np.linalg.inv(clip_from_rel).T.ravel().astype(np.float32)
        # Half the height of the picture at 1 m (or its half height) over half its pixels.
        self.footprint = 2.0 / (abs(camera.clip_from_camera[1, 1]) * camera.height)
        data = np.zeros(28, np.float32)
        data[:16] = clip_from_rel.T.ravel()
        data[16:19] = self.eye
        data[20:23] = -camera.world_from_camera[:3, 2]
        data[24:] = float(camera.is_orthographic), self.footprint, depth_bias, float(self.has_footprints)
        if self._buffer is None:
            self._buffer = gpu.types.GPUUniformBuf(data)
        else:
            self._buffer.update(data)

    @property
    def buffer(self):
        return self._buffer

    def rel_from_object(self, world_from_object: np.ndarray) -> np.ndarray:
        """16 float32, column by column: object space to space relative to the eye."""
        relative = np.array(world_from_object, np.float64)
        relative[:3, 3] -= self.eye
        return relative.T.ravel().astype(np.float32)
