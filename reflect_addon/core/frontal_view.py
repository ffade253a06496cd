"""A planar mirror's view for a renderer that is not ours: a plain camera that looks straight at the mirror from behind.

Problem. The viewport's engines draw any rigid camera with a plain projection. A mirrored view (mirrored_view.py) is no such: its near plane
leans, and an engine that takes near and far distances from the matrix then shades wrongly (in a floor Workbench is darker, EEVEE lacks a
part of its light: Blender 5.2.3); with the near plane upright, what is behind the mirror hides all that is before it. And a picture that swaps left and
right turns faces inside out.
Idea. From the same eye, looked at along the mirror's normal, the mirror is a window that is parallel to the picture: the off-centre frustum
through it [Kooima 2009, "Generalized perspective projection"] has its upright near plane in the mirror. What is seen depends on the eye
alone, so the picture is not the mirrored view's pixel for pixel, but has what is in any direction of it: a pixel's place is projected to find it.
The window is what is seen of the mirror, as many pixels as there are of it in the picture.
Limits. Pixels are as large all over the mirror: of one that is seen at a slant its near end is coarser than the picture, by as much as its far end
is farther. No orthographic cameras: they would need a sheared one. None where the eye is next to in the mirror's plane.
"""

import numpy as np

from .camera import Camera
from .mirror_outline import Polygon
from .mirror_planes import MirrorPlane
from .mirrored_view import far_of

# The near plane is so much beyond the mirror, of the distance of its farthest corner and of places in the world: float32 steps of an engine
# that transforms places first into the world, then into the view, and of faces that do not quite lie in the plane.
CLEAR, STEPS = 2.0**-16, 2.0**-20
# Width of what is seen over the eye's distance from the plane: an eye that is nearer looks along it, and nearly all pixels are of its far end.
WIDEST = 64.0
# Of a side of the window, left free around it: lookups blend neighbours.
MARGIN = 0.01


def frontal(camera: Camera, plane: MirrorPlane, polygon: Polygon, most: int) -> Camera | None:
    """The camera from the eye of a mirrored view (mirrored_view.mirrored of plane), of what its polygon, px of it, shows; sides of at most
    `most` px. None where there is none; see Limits."""
    if camera.is_orthographic or len(polygon) < 3:
        return None
    eye, normal = camera.world_from_camera[:3, 3], plane.normal
    away = float((plane.origin - eye) @ normal)
    axes = _axes(camera, normal)
    seen = np.array(polygon)
    window = _on_plane(camera, axes, seen)
    if window is None:
        return None
    low, high = window.min(0), window.max(0)
    size = high - low
    if not 0 < size.min() <= size.max() < WIDEST or not away > 0:
        return None
    low, high = low - MARGIN * size, high + MARGIN * size
    reach = away * float(np.sqrt(1.0 + (window**2).sum(1)).max())
    near = away + CLEAR * reach + STEPS * float(np.abs(eye).max())
    far = max(far_of(camera), 2.0 * near)
    clip = np.zeros((4, 4))
    clip[0, 0], clip[1, 1] = 2.0 / (high - low)
    clip[:2, 2] = (high + low) / (high - low)
    clip[2, 2:] = -(far + near) / (far - near), -2.0 * far * near / (far - near)
    clip[3, 2] = -1.0
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = axes.T, eye
    return Camera(pose, clip, *_pixels(camera, axes, seen, high - low, most))


def _axes(camera: Camera, normal: np.ndarray) -> np.ndarray:
    """(3, 3) rows x, y, z of a right-handed frame that looks along normal, x as the camera's where that can be."""
    x = camera.world_from_camera[:3, 0] - normal * (camera.world_from_camera[:3, 0] @ normal)
    if np.linalg.norm(x) < 0.5:
        x = camera.world_from_camera[:3, 1] - normal * (camera.world_from_camera[:3, 1] @ normal)
    x = x / np.linalg.norm(x)
    return np.stack([x, np.cross(-normal, x), -normal])


def _on_plane(camera: Camera, axes: np.ndarray, pixels: np.ndarray) -> np.ndarray | None:
    """(N, 2): slopes along x and y, in a frame, of the rays through pixels (N, 2); None where one does not go ahead."""
    x, y, w = (camera.clip_from_camera[row, :3] for row in (0, 1, 3))
    ndc = 2.0 * pixels / (camera.width, camera.height) - 1.0
    # On a pixel's ray x = ndc w and y = ndc w of clip coordinates: it is across both planes.
    rays = np.cross(x - ndc[:, :1] * w, y - ndc[:, 1:] * w)
    rays *= np.sign(rays @ w)[:, None]
    own = rays @ (axes @ camera.world_from_camera[:3, :3]).T
    if not (own[:, 2] < 0).all():
        return None
    return own[:, :2] / -own[:, 2:]


def _pixels(camera: Camera, axes: np.ndarray, seen: np.ndarray, size: np.ndarray, most: int) -> tuple[int, int]:
    """Sides of a picture that is nowhere coarser than the mirrored view is in its window, but at most `most`."""
    middle = seen.mean(0)
    inside = np.concatenate([middle + 0.9 * (seen - middle), middle[None]])
    right, up = (_on_plane(camera, axes, inside + step) for step in ((0.1, 0.0), (0.0, 0.1)))
    here = _on_plane(camera, axes, inside)
    if here is None or right is None or up is None:
        return most, most
    slope_of_px = np.stack([right - here, up - here], -1) / 0.1
    px_of_slope = np.linalg.norm(np.linalg.inv(slope_of_px), axis=1).max(0)
    return tuple(int(np.clip(np.ceil(s), 1, most)) for s in size * px_of_slope)
