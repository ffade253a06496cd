"""Shapes as arrays, a scene of them, and what is true of it: rays and nearest surfaces through Blender's BVH trees.

Nothing here is a method's: a hit is judged by how far it lies from the triangles themselves. Trees work in float32, so
each object's is centred and of unit size; what they say is good to 1e-6 of the object.
"""

from dataclasses import replace

import bpy  # noqa: F401  the pip module makes mathutils known
import numpy as np
from mathutils.bvhtree import BVHTree

from ..core.job import BakeJob
from ..core.rays import Hits, Rays
from ..core.snapshot import Instance, Material, Mesh, SceneSnapshot
from ..core.spaces import FAR
from ..scene.intersect import intersector

MIRROR = Material("mirror", metallic=1.0, roughness=0.0, is_reflector=True)
MATTE = Material("matte")
Shape = tuple[np.ndarray, np.ndarray]  # ((V, 3) float64 world, (T, 3) int)


def grid(points: np.ndarray, closed: bool = False) -> Shape:
    """Two triangles a cell of points (rows, columns, 3); closed: the last column is followed by the first."""
    rows, columns = points.shape[:2]
    i, j = (a.ravel() for a in np.mgrid[: rows - 1, : columns - (not closed)])
    a, b = i * columns + j, i * columns + (j + 1) % columns
    c, d = a + columns, b + columns
    return points.reshape(-1, 3), np.concatenate([np.stack([a, b, d], -1), np.stack([a, d, c], -1)])


def ball(radius: float, at=(0.0, 0.0, 0.0), rings: int = 12) -> Shape:
    """A sphere of quads; at its poles triangles of no area."""
    down, around = np.meshgrid(np.linspace(0, np.pi, rings + 1), np.arange(2 * rings) * np.pi / rings, indexing="ij")
    points = np.stack([np.sin(down) * np.cos(around), np.sin(down) * np.sin(around), np.cos(down)], -1)
    return grid(radius * points + at, closed=True)


def torus(radius: float, tube: float, at=(0.0, 0.0, 0.0), steps: int = 12) -> Shape:
    v, u = np.meshgrid(np.linspace(0, 2 * np.pi, steps + 1), np.arange(2 * steps) * np.pi / steps, indexing="ij")
    ring = radius + tube * np.cos(v)
    return grid(np.stack([ring * np.cos(u), tube * np.sin(v), ring * np.sin(u)], -1) + at, closed=True)


def box(size, at=(0.0, 0.0, 0.0), inside: bool = False, top: bool = True) -> Shape:
    """inside: its normals point inwards; top: has one."""
    corners = (np.array([[i & 1, i >> 1 & 1, i >> 2] for i in range(8)]) - 0.5) * size + at
    sides = [(0, 2, 3, 1), (0, 1, 5, 4), (1, 3, 7, 5), (3, 2, 6, 7), (2, 0, 4, 6), *([(4, 5, 7, 6)] if top else [])]
    faces = np.array([t for a, b, c, d in sides for t in ((a, b, c), (a, c, d))])
    return corners, faces[:, ::-1] if inside else faces


def broken(shape: Shape) -> Shape:
    """The same surface with every triangle twice, halves of them over it again, and as many triangles without an area."""
    points, faces = shape
    a, b, c = faces.T
    middles = len(points) + np.arange(len(faces))
    points = np.concatenate([points, (points[a] + points[b]) / 2])
    return points, np.concatenate(
        [faces, faces, np.stack([a, middles, c], -1), np.stack([a, middles, b], -1), np.stack([a, a, c], -1)]
    )


def scene_of(shapes: dict[str, tuple[Shape, Material]]) -> SceneSnapshot:
    """The first is the reflector. float32 about each object's own middle, placed by a float64 matrix, as Blender does."""
    meshes, instances = [], []
    materials = (MIRROR, MATTE)
    for index, (name, ((points, faces), material)) in enumerate(shapes.items()):
        matrix = np.eye(4)
        matrix[:3, 3] = points.mean(0)
        corners = points[faces]
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        normal /= np.maximum(np.linalg.norm(normal, axis=-1, keepdims=True), 1e-300)
        shown = np.repeat(normal.astype(np.float32)[:, None], 3, 1)
        local = (points - matrix[:3, 3]).astype(np.float32)
        meshes.append(Mesh(local, faces.astype(np.int32), shown, np.zeros(len(faces), np.int32)))
        instances.append(Instance(name, name, index, matrix, (materials.index(material),), material.is_reflector))
    return SceneSnapshot("stability", 1, tuple(meshes), materials, tuple(instances))


class Surfaces:
    """All triangles of a snapshot: a tracer for bakes, and the nearest surface to any point."""

    def __init__(self, scene: SceneSnapshot):
        self.scene = scene
        self.intersect = intersector(scene)
        self._trees = {}
        for instance in scene.instances:
            points = scene.world_positions(instance)
            low, high = points.min(0), points.max(0)
            middle, size = (low + high) / 2, float((high - low).max())
            triangles = scene.meshes[instance.mesh].triangles
            tree = BVHTree.FromPolygons(((points - middle) / size).tolist(), triangles.tolist(), all_triangles=True)
            self._trees[instance.name] = tree, middle, size

    def job(self, settings: dict, required: dict, light=None) -> BakeJob:
        """light(radiance (N, 3)) -> radiance: what the tracer says instead of what is smooth."""

        def trace(*asked, **more) -> Hits:
            hits = self.trace(*asked, **more)
            return hits if light is None else replace(hits, radiance=light(hits.radiance))

        return BakeJob(self.scene, self.scene.instances[0], trace, self.intersect, settings, required)

    def trace(self, rays: Rays, hide=(), samples: int = 1) -> Hits:
        """The nearest triangle; radiance is a smooth function of the place, a mirror's too."""
        origin, direction = (np.asarray(a, np.float64) for a in (rays.origin, rays.direction))
        nearest, of = np.full(len(rays), np.inf), np.full(len(rays), -1, np.int32)
        normal = np.zeros((len(rays), 3))
        for index, instance in enumerate(self.scene.instances):
            if instance.object_name in hide:
                continue
            tree, middle, size = self._trees[instance.name]
            for i, (o, d) in enumerate(zip(((origin - middle) / size).tolist(), direction.tolist(), strict=True)):
                _, n, _, distance = tree.ray_cast(o, d)
                if distance is not None and distance * size < nearest[i]:
                    nearest[i], of[i], normal[i] = distance * size, index, n
        hit = np.isfinite(nearest)
        position = origin + direction * np.where(hit, nearest, FAR)[:, None]
        normal *= -np.sign((normal * direction).sum(1, keepdims=True))
        low, high = self.scene.bounds()
        place = (position - (low + high) / 2) / self.scene.diagonal()
        radiance = np.where(hit[:, None], 1 + 0.5 * np.sin(5 * place), 0.5 + 0.3 * direction)
        names = tuple(i.object_name for i in self.scene.instances)
        return Hits(radiance.astype("f"), position.astype("f"), normal.astype("f"), of, hit, names)

    def distance(self, instance: Instance, points: np.ndarray) -> np.ndarray:
        """(N,) m from the points (N, 3) to the instance's nearest triangle."""
        tree, middle, size = self._trees[instance.name]
        found = [tree.find_nearest(p)[3] for p in ((points - middle) / size).tolist()]
        return np.array([np.inf if d is None else d * size for d in found])
