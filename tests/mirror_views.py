"""Cameras and planar mirrors made of numbers, for the tests of mirrored views and of their schedule."""

import numpy as np
from analytic import unit

from reflect_addon.core.camera import Camera
from reflect_addon.core.mirror_planes import MirrorPlane


def camera(place, at, size=(320, 240), lens=1.2, near=0.1, far=100.0, orthographic=False, shift=(0.0, 0.0)) -> Camera:
    """Looks from place at a point; lens: focal length over half the picture's height, or half the height in m if orthographic."""
    back = unit(np.subtract(place, at))
    right = unit(np.cross([0.0, 0.0, 1.0] if abs(back[2]) < 0.99 else [0.0, 1.0, 0.0], back))
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = np.stack([right, np.cross(back, right), back], -1), place
    clip = np.zeros((4, 4))
    aspect = size[0] / size[1]
    if orthographic:
        clip[0, 0], clip[1, 1], clip[2, 2], clip[2, 3], clip[3, 3] = 1 / (lens * aspect), 1 / lens, -2 / (far - near), -(far + near) / (far - near), 1.0
        clip[:2, 3] = shift
    else:
        clip[0, 0], clip[1, 1], clip[2, 2], clip[2, 3], clip[3, 2] = lens / aspect, lens, -(far + near) / (far - near), -2 * far * near / (far - near), -1.0
        clip[:2, 2] = shift
    return Camera(pose, clip, *size)


def mirror(origin, normal, half=1.0, reflector=0, specular=1.0, grazing=1.0, corners=4) -> MirrorPlane:
    """A regular polygon (a square) around origin; half: from its middle to its sides."""
    normal = unit(normal)
    across = unit(np.cross(normal, [0.0, 0.0, 1.0] if abs(normal[2]) < 0.9 else [1.0, 0.0, 0.0]))
    along = np.cross(normal, across)
    angle = 2 * np.pi * (np.arange(corners) + 0.5) / corners
    radius = half / np.cos(np.pi / corners)
    outline = np.asarray(origin, float) + radius * (np.cos(angle)[:, None] * across + np.sin(angle)[:, None] * along)
    return MirrorPlane(reflector, np.asarray(origin, float), normal, outline, specular, grazing)


def clip_of(seen: Camera, points: np.ndarray) -> np.ndarray:
    """(N, 4) clip coordinates of world points (N, 3)."""
    return np.column_stack([points, np.ones(len(points))]) @ seen.clip_from_world().T


def pixels(seen: Camera, points: np.ndarray) -> np.ndarray:
    """(N, 2) px of world points (N, 3)."""
    clip = clip_of(seen, points)
    return (clip[:, :2] / clip[:, 3:] * 0.5 + 0.5) * (seen.width, seen.height)
