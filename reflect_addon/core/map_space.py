"""Map space: where a part of a reflector is searched, one unit wide, at home and turned as it was when it was baked.

x_map = map_from_world (x_world - center): world axes at the bake, metres over the part's size. A reflector that has moved since takes
its maps along; a motion that is rigid up to a uniform scale keeps angles, and so bisectors [estalella-2005 section 3].
Differences to the centre are taken first, so nothing is lost far from the world's origin.
"""

from dataclasses import dataclass

import numpy as np

from .camera import Camera


@dataclass(frozen=True)
class MapSpace:
    """Of one part as its reflector stands now."""

    center: np.ndarray  # (3,) float64, world, m
    map_from_world: np.ndarray  # (3, 3) float64: a rotation over the part's size in m

    @property
    def units_per_metre(self) -> float:
        return float(np.cbrt(abs(np.linalg.det(self.map_from_world))))

    def points(self, world: np.ndarray) -> np.ndarray:
        """(..., 3) map space of world points."""
        return (np.asarray(world, np.float64) - self.center) @ self.map_from_world.T

    def from_objects(self, world_from_object: np.ndarray) -> np.ndarray:
        """(N, 3, 4) float64: map space from objects' spaces, (N, 4, 4)."""
        relative = np.array(world_from_object[:, :3, :], np.float64)
        relative[..., 3] -= self.center
        return self.map_from_world @ relative

    def observer(self, camera: Camera) -> np.ndarray:
        """(4,) float64 homogeneous: the eye, of an orthographic camera the direction to it."""
        if camera.is_orthographic:
            return np.append(self.map_from_world @ camera.world_from_camera[:3, 2], 0.0)
        return np.append(self.points(camera.world_from_camera[:3, 3]), 1.0)

    def clip_from_map(self, camera: Camera) -> np.ndarray:
        """(4, 4) float64."""
        world_from_map = np.linalg.inv(self.map_from_world)
        rotation, eye = camera.world_from_camera[:3, :3], camera.world_from_camera[:3, 3]
        camera_from_map = np.eye(4)
        camera_from_map[:3, :3] = rotation.T @ world_from_map
        camera_from_map[:3, 3] = rotation.T @ (self.center - eye)
        return camera.clip_from_camera @ camera_from_map


def map_space(center: np.ndarray, size: float, baked: np.ndarray, now: np.ndarray) -> MapSpace:
    """The space of a part with this centre (world, at the bake) and size, m; baked, now: (4, 4) the reflector's world_from_object."""
    now_from_baked = now @ np.linalg.inv(baked)
    turn = np.linalg.inv(now_from_baked[:3, :3])
    return MapSpace(now_from_baked[:3, :3] @ center + now_from_baked[:3, 3], turn / size)
