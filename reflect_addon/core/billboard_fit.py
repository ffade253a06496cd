"""Where billboards stand: on the flat parts of objects, or through an object's centroid facing the reflector.

popescu-2006 section 3: "When the billboard tightly approximates the geometry it replaces (e.g. flat floor, table top,
walls, ceiling), the placement of the billboard is dictated by the original geometry. ... When the billboard replaces
an object with non-negligible volume, we place the billboard plane through the centroid B of the object, and
perpendicularly to the line connecting B to the centroid of the reflector. The billboard is constructed using a camera
with a narrow field of view (10 degrees)."
"""

from dataclasses import dataclass

import numpy as np

from .flat_parts import flat_parts, visible_sides
from .rays import Rays
from .snapshot import Instance, SceneSnapshot

Vector = tuple[float, float, float]

# An object is flat when its thickness is under this share of its width: below that its own parallax is too small to see.
FLAT = 0.02
# Flat parts that together hold this share of the surface stand for the whole object: a slab without its narrow rims.
MOSTLY_FLAT = 0.9
FIELD_OF_VIEW = np.radians(10.0)
# Half extents below this share of the larger one are widened to it: a needle needs a quad with an area.
NEEDLE = 1e-4
# Radians: a texel seen under less is finer than reflections are looked at, that of a cube map with 512 texels a face.
FINEST = 1 / 256
# Below this a quad has no contour.
LEAST_TEXELS = 8


@dataclass(frozen=True)
class Quad:
    """A one-sided rectangle that stands for (a part of) an instance, and the camera that fills it."""

    instance: str
    center: Vector  # world, m
    u: Vector  # unit, world; u x v = normal
    v: Vector
    normal: Vector  # towards those who see it
    half_u: float  # m
    half_v: float
    eye: Vector | None  # where its texels are seen from; None: along the normal
    above: float  # m: rays of the capture start this far above the plane ...
    reach: float  # m: ... and count as the object up to this distance
    shared: bool  # flat: the same for all reflectors

    @property
    def has_relief(self) -> bool:
        """Whether the surface lies off the plane."""
        return not self.shared

    def size(self, texels: int) -> tuple[int, int]:
        """(height, width): powers of two from 4, the longer side `texels` or the power below, texels as square as that
        allows."""
        longest, most = max(self.half_u, self.half_v), np.floor(np.log2(max(texels, 4)))

        def side(half: float) -> int:
            return int(2 ** np.clip(np.ceil(np.log2(max(texels * half / longest, 1e-9)) - 0.25), 2, most))

        return side(self.half_v), side(self.half_u)

    def enough(self, most: int, viewers: tuple[np.ndarray, np.ndarray]) -> int:
        """Texels along the longer side, a power of two, at most `most`: none seen under less than FINEST by anybody in the
        box of `viewers` (low and high corner, world)."""
        center, longest = np.asarray(self.center), max(self.half_u, self.half_v)
        beside = np.maximum(np.maximum(viewers[0] - center, center - viewers[1]), 0)
        distance = np.linalg.norm(beside) - np.hypot(self.half_u, self.half_v)
        wanted = 2 * longest / (FINEST * max(distance, 1e-9 * longest))
        return int(min(most, 2 ** np.ceil(np.log2(max(wanted, LEAST_TEXELS)))))

    def points(self, texels: int) -> np.ndarray:
        """(h * w, 3) float64 world positions of the texel centres, row 0 at low v."""
        h, w = self.size(texels)
        a = ((np.arange(w) + 0.5) / w * 2 - 1) * self.half_u
        b = ((np.arange(h) + 0.5) / h * 2 - 1) * self.half_v
        p = np.asarray(self.center) + a[None, :, None] * np.asarray(self.u) + b[:, None, None] * np.asarray(self.v)
        return p.reshape(-1, 3)

    def rays(self, texels: int) -> Rays:
        """The capture's rays through the texels, from the eye or from above the plane."""
        points = self.points(texels)
        if self.eye is None:
            direction = np.broadcast_to(-np.asarray(self.normal), points.shape)
            return Rays(points - direction * self.above, direction.copy())
        direction = points - np.asarray(self.eye)
        direction /= np.linalg.norm(direction, axis=-1, keepdims=True)
        return Rays(np.broadcast_to(np.asarray(self.eye), points.shape).copy(), direction)

    def height(self, points: np.ndarray) -> np.ndarray:
        """(N,) of world points (N, 3) above the plane, in half widths (half_u)."""
        return (points.astype(np.float64) - np.asarray(self.center)) @ np.asarray(self.normal) / self.half_u

    def faces(self, corners: np.ndarray) -> bool:
        """Whether any of the points (N, 3) lies on the side that the quad can be seen from."""
        return bool(np.any((corners - np.asarray(self.center)) @ np.asarray(self.normal) > 0))


def flat_quads(scene: SceneSnapshot, instance: Instance, inside: bool = False) -> tuple[list[Quad], bool]:
    """(one quad for each visible side of each large flat part, whether these quads are the whole object).

    inside: who looks is inside the mesh, in a room; matters to closed meshes only."""
    vertices = scene.world_positions(instance)
    triangles = scene.meshes[instance.mesh].triangles
    if not len(triangles):
        return [], True
    whole = _plane_through(vertices[np.unique(triangles)])
    if whole is not None:
        low, high, axes = whole
        return [_flat_quad(instance, vertices[np.unique(triangles)], axes, side, high - low) for side in (1, -1)], True
    corners = vertices[triangles]
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(cross, axis=-1) / 2
    parts = flat_parts(corners, cross, area)
    sides = visible_sides(triangles, corners, inside)
    quads = []
    for part in parts:
        normal = (cross[part] / np.linalg.norm(cross[part], axis=-1, keepdims=True)).mean(0)
        for side in sides:
            axes = _frame(corners[part].reshape(-1, 3), side * normal / np.linalg.norm(normal))
            quads.append(_flat_quad(instance, corners[part].reshape(-1, 3), axes, 1, 0.0))
    return quads, sum(area[p].sum() for p in parts) >= MOSTLY_FLAT * area.sum()


def _plane_through(points: np.ndarray):
    """(low, high, axes) of a thin set of points along its thinnest direction, or None when it is not FLAT."""
    centered = points - points.mean(0)
    scale = np.abs(centered).max()
    if scale == 0:
        return None
    _, vectors = np.linalg.eigh((centered / scale).T @ (centered / scale))
    along = centered @ vectors
    extent = np.ptp(along, axis=0)
    if extent[0] > FLAT * extent[1]:
        return None
    return along[:, 0].min(), along[:, 0].max(), _frame(points, vectors[:, 0])


def _frame(points: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """(3, 3) rows u, v, normal: the rectangle of least area around the points in their plane."""
    helper = np.eye(3)[np.argmin(np.abs(normal))]
    a = np.cross(helper, normal)
    a /= np.linalg.norm(a)
    b = np.cross(normal, a)
    flat = np.stack([points @ a, points @ b], -1)
    # The rectangle of least area lies along an edge of the outline; whole degrees serve outlines that are round.
    circle = np.radians(np.arange(0, 360, 1.0))
    outline = flat[np.argmax(flat @ np.stack([np.cos(circle), np.sin(circle)]), axis=0)]
    edges = np.roll(outline, -1, axis=0) - outline
    along = np.arctan2(edges[:, 1], edges[:, 0])[np.any(edges != 0, axis=1)] % (np.pi / 2)
    angles = np.unique(np.concatenate([circle[:90], along]))
    u = np.stack([np.cos(angles), np.sin(angles)])
    areas = np.ptp(flat @ u, axis=0) * np.ptp(flat @ np.stack([-u[1], u[0]]), axis=0)
    # A tie (a square, rounding) goes to the smallest angle.
    c, s = u[:, np.argmax(areas <= areas.min() * (1 + 1e-6))]
    return np.array([c * a + s * b, -s * a + c * b, normal])


def _flat_quad(instance: Instance, points: np.ndarray, axes: np.ndarray, side: int, thickness: float) -> Quad:
    u, v, normal = axes
    if side < 0:
        u, normal = -u, -normal
    low = np.array([(points @ axis).min() for axis in (u, v)])
    high = np.array([(points @ axis).max() for axis in (u, v)])
    middle, half = (low + high) / 2, (high - low) / 2
    half = np.maximum(half, NEEDLE * half.max())
    top = (points @ normal).max()
    center = u * middle[0] + v * middle[1] + normal * top
    above = 0.01 * half.max()
    return Quad(
        instance.name, _t(center), _t(u), _t(v), _t(normal), float(half[0]), float(half[1]), None, above,
        float(above * 1.5 + thickness), True,
    )  # fmt: skip


def volume_quad(scene: SceneSnapshot, instance: Instance, reflector_center: np.ndarray) -> Quad:
    """The quad through the instance's centroid that faces the reflector's."""
    vertices = scene.world_positions(instance)[np.unique(scene.meshes[instance.mesh].triangles)]
    return quad_around(instance.name, vertices, reflector_center)


def quad_around(name: str, vertices: np.ndarray, reflector_center: np.ndarray) -> Quad:
    """The same for any vertices (V, 3), world, that are to be seen on it."""
    centroid = (vertices.min(0) + vertices.max(0)) / 2
    radius = float(np.linalg.norm(vertices - centroid, axis=-1).max())
    normal = np.asarray(reflector_center, np.float64) - centroid
    distance = np.linalg.norm(normal)
    # Centred on each other: any side is as good as another.
    normal = normal / distance if distance > 1e-6 * radius else np.array([0.0, 0.0, 1.0])
    up = np.array([0.0, 0.0, 1.0]) if abs(normal[2]) < 0.99 else np.array([0.0, 1.0, 0.0])
    u = np.cross(up, normal)
    u /= np.linalg.norm(u)
    v = np.cross(normal, u)
    eye = centroid + normal * (radius / np.sin(FIELD_OF_VIEW / 2))
    # The object's outline on the plane, as the camera projects it.
    from_eye = vertices - eye
    depth = np.maximum(-(from_eye @ normal), 1e-9 * radius)
    on_plane = eye + from_eye * ((eye - centroid) @ normal / depth)[:, None] - centroid
    low = np.array([(on_plane @ axis).min() for axis in (u, v)])
    high = np.array([(on_plane @ axis).max() for axis in (u, v)])
    middle, half = (low + high) / 2, (high - low) / 2
    half = np.maximum(half, NEEDLE * half.max())
    center = centroid + u * middle[0] + v * middle[1]
    return Quad(
        name, _t(center), _t(u), _t(v), _t(normal), float(half[0]), float(half[1]), _t(eye), 0.0,
        float(np.inf), False,
    )  # fmt: skip


def _t(v: np.ndarray) -> Vector:
    return tuple(float(x) for x in v)
