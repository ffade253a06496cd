"""The cameras that fill stand-ins, as any other camera: what their rays are in a bake, for a rasteriser."""

import numpy as np

from .billboard_fit import Quad
from .camera import Camera
from .depth_camera import DepthCamera

# Clipping planes stand this share of the depth range off the object: float32 depths end at them.
ROOM = 1e-3


def quad_camera(quad: Quad, width: int, height: int, points: np.ndarray) -> Camera:
    """The camera whose pixels are a quad's texels: through the eye, or along the normal where it has none.

    points (N, 3): what it looks at, world, m; the clipping planes are put around them (for a quad without an eye around
    what its capture reaches). Its x, y and z axes are the quad's u, v and normal; the frustum is off its axis where the
    quad's centre is.
    """
    u, v, n = (np.asarray(axis, np.float64) for axis in (quad.u, quad.v, quad.normal))
    center = np.asarray(quad.center, np.float64)
    eye = center + n * quad.above if quad.eye is None else np.asarray(quad.eye, np.float64)
    world = np.eye(4)
    world[:3, :3] = np.stack([u, v, n], -1)
    world[:3, 3] = eye
    low = np.array([(center - eye) @ u - quad.half_u, (center - eye) @ v - quad.half_v])
    high = low + 2 * np.array([quad.half_u, quad.half_v])
    clip = np.zeros((4, 4))
    if quad.eye is None:
        near, far = 0.0, float(quad.reach)
        clip[0, 0], clip[1, 1] = 2 / (high - low)
        clip[:2, 3] = -(high + low) / (high - low)
        clip[2, 2], clip[2, 3], clip[3, 3] = -2 / (far - near), -(far + near) / (far - near), 1.0
        return Camera(world, clip, width, height)
    depth = (eye - points) @ n
    room = ROOM * max(float(np.ptp(depth)), 1e-9 * float(depth.max()))
    far = float(depth.max()) + room
    near = max(float(depth.min()) - room, 1e-6 * far)
    distance = float((eye - center) @ n)
    clip[0, 0], clip[1, 1] = 2 * distance / (high - low)
    clip[:2, 2] = (high + low) / (high - low)
    clip[2, 2], clip[2, 3] = (far + near) / (near - far), 2 * far * near / (near - far)
    clip[3, 2] = -1.0
    return Camera(world, clip, width, height)


def map_camera(camera: DepthCamera, texels: int) -> Camera:
    """The camera whose texels x texels pixels are a depth map's; its clipping planes are the map's hither and yon."""
    world = np.eye(4)
    world[:3, :3] = np.stack([camera.right, camera.up, -camera.forward], -1)
    world[:3, 3] = camera.eye
    near, far = camera.hither, camera.yon
    clip = np.zeros((4, 4))
    clip[0, 0] = clip[1, 1] = 1 / camera.tan_half
    clip[2, 2], clip[2, 3], clip[3, 2] = (far + near) / (near - far), 2 * far * near / (near - far), -1.0
    return Camera(world, clip, texels, texels)
