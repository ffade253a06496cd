"""A planar mirror's view as an ordinary camera [nielsen-2002 3.1: "a rendered view of the scene from a mirror viewpoint"].

Problem. A planar mirror shows the scene as seen by the eye's mirror image; that view is improper (it swaps left and right), and what stands
behind the mirror is between it and its virtual eye.
Idea. A point q is seen in the mirror where its image M q is seen, M the reflection about the plane: clip = P W^-1 M q. With F = diag(-1, 1, 1, 1)
the pose M W F is rigid again and P F is a projection, P F (M W F)^-1 = P W^-1 M: the result is a Camera, and pixel (x, y) of it is what
pixel (x, y) of the mirror shows. So views of views are the same function again, and nothing downstream need know. Triangles' winding on
the screen swaps, as P F has a negative determinant.
The near plane is laid into the mirror [Lengyel 2005, "Oblique View Frustum Depth Projection and Clipping", J. Game Development 1(2), eqs. 7-8]:
the depth row becomes a C - w, C the plane, a such that the far plane just holds the frustum's corner farthest from the mirror.
Where we depart. Lengyel's far plane leans, and leans more with each mirror. That corner is always at the first camera's far distance and all
other points of the leaning plane are beyond it, so the distance is found again from any such matrix, and each view starts from it.
Limits. Camera.depths() of such a camera is of its middle ray only.
"""

from dataclasses import replace

import numpy as np

from .camera import Camera
from .mirror_planes import MirrorPlane

# An eye is in the plane when it is nearer than this share of its distance from the mirror's origin: a float32 shader cannot tell more.
IN_PLANE = 1e-7
_FLIP = np.diag([-1.0, 1.0, 1.0, 1.0])
_CORNERS = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])


def reflection(origin: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """(4, 4) world -> world: the mirror image about the plane through origin (3,) with unit normal (3,)."""
    image = np.eye(4)
    image[:3, :3] -= 2.0 * np.outer(normal, normal)
    image[:3, 3] = 2.0 * (origin @ normal) * normal
    return image


def height_of(camera: Camera, origin: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """(...,): > 0 where the camera sees the side of planes, origin and normal (..., 3), that mirrors; of an orthographic camera a cosine,
    else sine of the eye's elevation as seen from origin."""
    if camera.is_orthographic:
        return normal @ camera.world_from_camera[:3, 2]
    away = camera.world_from_camera[:3, 3] - origin
    return (away * normal).sum(-1) / np.maximum(np.linalg.norm(away, axis=-1), 1e-300)


def mirrored(camera: Camera, plane: MirrorPlane) -> Camera | None:
    """What the mirror shows, of the size of camera's picture; None where camera does not see the side that mirrors (its eye is behind the
    plane or in it), and where everything before the mirror is beyond the far plane."""
    if not height_of(camera, plane.origin, plane.normal) > IN_PLANE:
        return None
    return begun_at(image_of(camera, plane), plane)


def begun_at(camera: Camera, plane: MirrorPlane) -> Camera | None:
    """The camera with its near plane in this plane, what lies before that being seen; None where all of it is beyond the far plane."""
    depth_row = _oblique(camera, np.append(plane.normal, -plane.normal @ plane.origin))
    if depth_row is None:
        return None
    clip = camera.clip_from_camera.copy()
    clip[2] = depth_row
    return replace(camera, clip_from_camera=clip)


def image_of(camera: Camera, plane: MirrorPlane) -> Camera:
    """The camera's mirror image, rigid, its near plane where it was: nothing between mirror and eye is clipped."""
    pose = reflection(plane.origin, plane.normal) @ camera.world_from_camera @ _FLIP
    return replace(camera, world_from_camera=pose, clip_from_camera=camera.clip_from_camera @ _FLIP)


def far_of(camera: Camera) -> float:
    """m: the far distance of the camera that this one was mirrored from; its own where it was not."""
    start, step = _corner_lines(camera.clip_from_camera)
    beyond = camera.clip_from_camera[3] - camera.clip_from_camera[2]
    with np.errstate(divide="ignore", invalid="ignore"):
        far = -(start @ beyond) / (step @ beyond)
    far = far[np.isfinite(far) & (far > 0)]
    return float(far.min()) if len(far) else np.inf


def _corner_lines(clip: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(4, 4) start and (4, 4) step of the picture's corners: start + depth * step, homogeneous, camera space. Of x, y and w alone."""
    start, step = np.zeros((4, 4)), np.zeros((4, 4))
    start[:, 3], step[:, 2] = 1.0, -1.0
    rows = clip[:2] - _CORNERS[:, :, None] * clip[3]
    solved = np.linalg.solve(rows[:, :, :2], np.stack([-rows[:, :, 3], rows[:, :, 2]], -1))
    start[:, :2], step[:, :2] = solved[:, :, 0], solved[:, :, 1]
    return start, step


def _oblique(camera: Camera, world_plane: np.ndarray) -> np.ndarray | None:
    """(4,): the depth row with which clip z is -w on the plane, its positive side inside; None: the frustum does not reach that side."""
    clip = camera.clip_from_camera
    plane = camera.world_from_camera.T @ world_plane
    start, step = _corner_lines(clip)
    far = far_of(camera)
    corners = start + far * step if np.isfinite(far) else step
    height = corners @ plane
    farthest = corners[np.argmax(height)]
    if not height.max() > 0:
        return None
    return 2.0 * (clip[3] @ farthest) / height.max() * plane - clip[3]
