"""A camera as numbers: what the ray map and the primary rays of a picture need."""

from dataclasses import dataclass, replace

import numpy as np

from .rays import Rays


@dataclass(frozen=True)
class Camera:
    """world_from_camera is rigid; clip_from_camera is an OpenGL projection (z in -1..1), as Blender's gpu.matrix has it."""

    world_from_camera: np.ndarray  # (4, 4) float64
    clip_from_camera: np.ndarray  # (4, 4) float64
    width: int  # px
    height: int  # px

    def plain(self) -> dict:
        """As JSON keeps it; `of` reads it."""
        return {"pose": self.world_from_camera.tolist(), "lens": self.clip_from_camera.tolist(), "size": [self.width, self.height]}

    @staticmethod
    def of(plain: dict) -> "Camera":
        return Camera(np.array(plain["pose"]), np.array(plain["lens"]), *plain["size"])

    @property
    def is_orthographic(self) -> bool:
        return bool(self.clip_from_camera[3, 3] == 1.0)

    def depths(self) -> tuple[float, float]:
        """(near, far): the clipping planes' distances before the eye, m."""
        planes = _unproject(np.linalg.inv(self.clip_from_camera), np.zeros((2, 2)), np.array([[-1.0], [1.0]]))
        return float(-planes[0, 2]), float(-planes[1, 2])

    def starts(self) -> np.ndarray:
        """(N, 3) float64 world: the eye; of an orthographic camera, whose rays start all over the near plane, its corners."""
        if not self.is_orthographic:
            return self.world_from_camera[None, :3, 3].astype(np.float64)
        corners = np.array([[-1.0, -1.0], [-1.0, 1.0], [1.0, -1.0], [1.0, 1.0]])
        near = _unproject(np.linalg.inv(self.clip_from_camera), corners, -1.0)
        return near @ self.world_from_camera[:3, :3].T + self.world_from_camera[:3, 3]

    def part(self, x: int, y: int, width: int, height: int) -> "Camera":
        """The camera of a part of the picture, with the same pixels; the part may reach beyond the picture."""
        crop = np.eye(4)
        for axis, (start, side, whole) in enumerate(((x, width, self.width), (y, height, self.height))):
            crop[axis, axis], crop[axis, 3] = whole / side, (whole - 2 * start) / side - 1
        return replace(self, clip_from_camera=crop @ self.clip_from_camera, width=width, height=height)

    def finer(self, times: int) -> "Camera":
        """The same picture with so many pixels along each of its own."""
        return replace(self, width=times * self.width, height=times * self.height)

    def clip_from_world(self) -> np.ndarray:
        return self.clip_from_camera @ np.linalg.inv(self.world_from_camera)

    def primary_rays(self) -> Rays:
        """Rays through the pixel centres, row 0 at the bottom, (H*W, 3). Perspective rays start at the eye,
        orthographic ones on the near plane."""
        x = (np.arange(self.width) + 0.5) / self.width * 2 - 1
        y = (np.arange(self.height) + 0.5) / self.height * 2 - 1
        ndc = np.stack(np.broadcast_arrays(x[None, :], y[:, None]), -1).reshape(-1, 2)
        camera_from_clip = np.linalg.inv(self.clip_from_camera)
        near = _unproject(camera_from_clip, ndc, -1.0)
        if self.is_orthographic:
            origin, direction = near, np.broadcast_to([0.0, 0.0, -1.0], near.shape)
        else:
            # A near plane that leans (core/mirrored_view.py) meets some pixels' lines behind the eye.
            ahead = np.where(near[:, 2:] > 0, -near, near)
            origin, direction = np.zeros_like(near), ahead / np.linalg.norm(ahead, axis=-1, keepdims=True)
        rotation = self.world_from_camera[:3, :3]
        return Rays(
            (origin @ rotation.T + self.world_from_camera[:3, 3]).astype(np.float32),
            (direction @ rotation.T).astype(np.float32),
        )


def _unproject(camera_from_clip: np.ndarray, ndc: np.ndarray, z: float | np.ndarray) -> np.ndarray:
    one = np.ones((len(ndc), 1))
    p = np.concatenate([ndc, z * one, one], -1) @ camera_from_clip.T
    return p[:, :3] / p[:, 3:]
