"""Views of curved mirrors: one distorted view for each viewer, or six faces of a cube for all of them [nielsen-2002 3.2, Figs 5 and 6].

A curved reflector is a ball around it. Its view-dependent map is "a single distorted projection of the reflection as seen from the
reflecting object in the direction of the virtual viewer" with a high field of view (2.3); its view-independent one is a cube map, in the
layout of core/spaces.py: faces of a positive axis would be improper cameras, so their x is negated as a mirrored view's is.
Limits. "The back and parts of the sides of the environment are disregarded" by the one view (2.3). A reflector that is mostly planar counts as
planar only; its round part is left to gather methods.
"""

from dataclasses import dataclass

import numpy as np

from .camera import Camera
from .mirror_planes import MirrorPlane, is_mirror, reflectance, world_normals
from .mirrored_view import far_of
from .snapshot import Instance, Material, SceneSnapshot

# Tangent of half the one view's angle: 127 degrees in all.
WIDE = 2.0
# Nothing nearer to the ball's middle than this share of its radius is drawn, and the depth buffer starts there.
NEAR = 0.05
# Corners of the polygon around its outline.
CORNERS = 12
# A reflector is curved when its planar mirrors are less than this share of its mirroring surface: a kettle is, flat bottom or not.
MOSTLY = 0.5
# Share of Schlick's rise towards grazing angles that a ball shows on average: twice the integral of c (1 - c)^5.
MEAN_RISE = 1 / 21
# A mesh is a ball when no corner is nearer to its middle than this share of its radius, ...
AS_FAR = 0.99
# ... no shading normal's cosine to a ball's is less than this (2.6 degrees), which tells smooth from flat shading, ...
AS_BENT = 0.999
# ... and its faces have this share of the ball's surface: 20 segments of 10 rings have 0.96, a cube 0.64, a cut ball less.
AS_WHOLE = 0.94


@dataclass(frozen=True)
class CurvedMirror:
    """A reflector that is mostly curved."""

    reflector: int  # into SceneSnapshot.reflectors()
    center: np.ndarray  # (3,) float64 world, m
    radius: float  # m, of a ball that holds it
    specular: float  # largest channel of its reflectance straight on, 0..1
    grazing: float = 1.0  # at 90 degrees
    ball: Material | None = None  # of a whole smooth ball of one material, which the ball that holds it then is; else None

    @property
    def mean(self) -> float:
        """Reflectance over the ball's picture."""
        return self.specular + (self.grazing - self.specular) * MEAN_RISE


def curved_of(scene: SceneSnapshot, planes: tuple[MirrorPlane, ...]) -> tuple[CurvedMirror, ...]:
    """The reflectors that are mostly curved, in their order; planes: planes_of(scene)."""
    planar, found = np.zeros(len(scene.reflectors())), []
    for plane in planes:
        planar[plane.reflector] += _area(plane.outline[None, 0], plane.outline[1:-1], plane.outline[2:])
    for index, reflector in enumerate(scene.reflectors()):
        mirrors = np.array([is_mirror(scene.materials[m], reflector) for m in reflector.materials], bool)
        shown = scene.meshes[reflector.mesh].triangles[mirrors[scene.slots(reflector)]]
        corners = scene.world_positions(reflector)[shown]
        if not len(shown) or not np.isfinite(corners).all() or planar[index] >= MOSTLY * _area(*np.moveaxis(corners, 1, 0)):
            continue
        low, high = corners.min((0, 1)), corners.max((0, 1))
        center = low / 2 + high / 2
        radius = float(np.linalg.norm(corners - center, axis=-1).max())
        materials = [scene.materials[m] for m, mirror in zip(reflector.materials, mirrors, strict=True) if mirror]
        straight, grazing = np.max([reflectance(m) for m in materials], axis=0)
        is_ball = mirrors.all() and len(set(materials)) == 1 and _is_ball(scene, reflector, center, radius)
        found.append(CurvedMirror(index, center, radius, float(straight), float(grazing), materials[0] if is_ball else None))
    return tuple(found)


def _is_ball(scene: SceneSnapshot, reflector: Instance, center: np.ndarray, radius: float) -> bool:
    mesh = scene.meshes[reflector.mesh]
    out = scene.world_positions(reflector)[mesh.triangles] - center
    far = np.linalg.norm(out, axis=-1, keepdims=True)
    normals = world_normals(reflector, mesh.corner_normals)
    bent = np.abs((normals * out / np.maximum(far, 1e-300)).sum(-1)).min()
    return bool(far.min() >= AS_FAR * radius and bent >= AS_BENT and _area(*np.moveaxis(out, 1, 0)) >= AS_WHOLE * 4 * np.pi * radius**2)


def _area(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> float:
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=-1).sum() / 2)


def outline_of(curved: CurvedMirror, camera: Camera) -> np.ndarray | None:
    """(CORNERS, 3) world: around the ball's outline as the camera sees it; None from within the ball."""
    back, distance = _towards(curved, camera)
    if not camera.is_orthographic and distance <= curved.radius * (1 + 1e-9):
        return None
    sine = 0.0 if camera.is_orthographic else curved.radius / distance
    across = np.linalg.svd(back[None])[2][1:]
    angle = 2 * np.pi * np.arange(CORNERS) / CORNERS
    radius = curved.radius * np.sqrt(1 - sine**2) / np.cos(np.pi / CORNERS)
    return curved.center + curved.radius * sine * back + radius * np.stack([np.cos(angle), np.sin(angle)], -1) @ across


def approximate_view(curved: CurvedMirror, camera: Camera, side: int) -> Camera:
    """The view-dependent map's camera, side x side px, from the ball's middle to whoever looks. With WIDE times the texels of a cube map's
    face along a side it is as fine in its middle."""
    back, _ = _towards(curved, camera)
    up = camera.world_from_camera[:3, 1]
    right = np.cross(back, up)
    if np.linalg.norm(right) < 1e-6:
        right = camera.world_from_camera[:3, 0]
    right /= np.linalg.norm(right)
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = np.stack([right, np.cross(right, back), -back], -1), curved.center
    return Camera(pose, _square(WIDE, NEAR * curved.radius, far_of(camera)), side, side)


def cube_views(curved: CurvedMirror, side: int, far: float, border: int = 0) -> tuple[Camera, ...]:
    """Six cameras of side x side px, in the order and layout of cube faces; border: px around a face that are drawn besides."""
    views = []
    for face in range(6):
        axis, sign = face // 2, 1.0 - 2.0 * (face % 2)
        pose, clip = np.eye(4), _square(1.0, NEAR * curved.radius, far)
        right, up = np.eye(3)[(axis + 1) % 3], np.eye(3)[(axis + 2) % 3]
        pose[:3, :3], pose[:3, 3] = np.stack([-sign * right, up, -sign * np.eye(3)[axis]], -1), curved.center
        clip[:, 0] *= -sign
        views.append(Camera(pose, clip, side, side).part(-border, -border, side + 2 * border, side + 2 * border))
    return tuple(views)


def _towards(curved: CurvedMirror, camera: Camera) -> tuple[np.ndarray, float]:
    """((3,) unit from the ball's middle to who looks, m of distance)."""
    away = camera.world_from_camera[:3, 3] - curved.center
    distance = float(np.linalg.norm(away))
    if camera.is_orthographic or distance < 1e-9 * curved.radius:
        return camera.world_from_camera[:3, 2].copy(), distance
    return away / distance, distance


def _square(tangent: float, near: float, far: float) -> np.ndarray:
    """(4, 4) OpenGL projection of a square picture."""
    far = max(far, 2 * near)
    clip = np.zeros((4, 4))
    clip[0, 0] = clip[1, 1] = 1 / tangent
    clip[2, 2], clip[2, 3], clip[3, 2] = (far + near) / (near - far), 2 * far * near / (near - far), -1.0
    return clip
