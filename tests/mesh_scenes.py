"""Snapshots of trimesh shapes, and a tracer and an intersector through Embree: a method's own bake without Blender."""

import numpy as np
import trimesh
from analytic import SKY, hits, smooth, unit
from trimesh.ray.ray_pyembree import RayMeshIntersector

from reflect_addon.core.job import BakeJob
from reflect_addon.core.rays import Hits, Rays
from reflect_addon.core.snapshot import Instance, Material, Mesh, SceneSnapshot

MIRROR = Material("mirror", metallic=1.0, roughness=0.0, is_reflector=True)
MATTE = Material("matte")


def snapshot(reflector: trimesh.Trimesh, **others: trimesh.Trimesh) -> SceneSnapshot:
    """The reflector is called Mirror; the shapes lie in world space already, far or near."""
    meshes, instances = [], []
    for index, (name, shape) in enumerate({"Mirror": reflector, **others}.items()):
        # Like Blender: float32 about the object's own origin, placed by a float64 matrix.
        matrix = trimesh.transformations.translation_matrix(np.asarray(shape.vertices).mean(0))
        local = (shape.vertices - matrix[:3, 3]).astype(np.float32)
        corners = np.repeat(np.asarray(shape.face_normals, np.float32)[:, None], 3, 1)
        meshes.append(Mesh(local, np.asarray(shape.faces, np.int32), corners, np.zeros(len(shape.faces), np.int32)))
        instances.append(Instance(name, name, index, matrix, (0 if index == 0 else 1,), index == 0))
    return SceneSnapshot("test", 1, tuple(meshes), (MIRROR, MATTE), tuple(instances))


def world_mesh(scene: SceneSnapshot, instance: Instance) -> trimesh.Trimesh:
    return trimesh.Trimesh(scene.world_positions(instance), scene.meshes[instance.mesh].triangles, process=False)


def first_hits(mesh: trimesh.Trimesh, origin, direction):
    """((N,) triangle or -1, (N,) distance or inf): Embree says which triangle, its plane says in float64 how far."""
    origin, direction = np.asarray(origin, np.float64), np.asarray(direction, np.float64)
    middle, size = mesh.bounds.mean(0), max(np.ptp(mesh.bounds, axis=0).max(), 1e-30)
    # Embree works in float32: centred and of unit size the mesh keeps its digits.
    local = trimesh.Trimesh((mesh.vertices - middle) / size, mesh.faces, process=False)
    triangle = np.asarray(RayMeshIntersector(local, scale_to_box=False).intersects_first((origin - middle) / size, direction))
    met = triangle >= 0
    distance = np.full(len(origin), np.inf)
    corner, normal = mesh.triangles[triangle[met], 0], unit(mesh.triangles_cross[triangle[met]])
    with np.errstate(divide="ignore", invalid="ignore"):
        distance[met] = ((corner - origin[met]) * normal).sum(1) / (direction[met] * normal).sum(1)
    return triangle, distance


def intersect(scene: SceneSnapshot):
    """BakeJob.intersect."""
    return lambda instance, rays: first_hits(world_mesh(scene, instance), rays.origin, rays.direction)[1]


def tracer(scene: SceneSnapshot, paint=None, made=None):
    """BakeJob.trace. paint(positions (N, 3), owner (N,) index or -1) -> radiance; made: list that collects (rays, hide)."""
    paint = paint or (lambda position, owner: smooth(position) * (2.0 + owner[:, None]))

    def trace(rays: Rays, hide=(), samples=1, progress=None) -> Hits:
        if made is not None:
            made.append((rays, tuple(hide)))
        nearest, owner = np.full(len(rays), np.inf), np.full(len(rays), -1)
        for index, instance in enumerate(scene.instances):
            if instance.object_name in hide:
                continue
            _, distance = first_hits(world_mesh(scene, instance), rays.origin, rays.direction)
            owner = np.where(distance < nearest, index, owner)
            nearest = np.minimum(nearest, distance)
        found = hits(rays, np.where(np.isfinite(nearest), nearest, SKY), lambda position: paint(position, owner))
        return Hits(found.radiance, found.position, found.normal, owner.astype(np.int32), found.hit, tuple(i.name for i in scene.instances))

    return trace


def job(scene: SceneSnapshot, settings: dict, required=None, paint=None, made=None) -> BakeJob:
    return BakeJob(scene, scene.instances[0], tracer(scene, paint, made), intersect(scene), settings, required or {})


def depth_map(mesh: trimesh.Trimesh, w: int, half_angle=np.radians(15)):
    """(q (w, w) float32, z of q): the mesh seen along -Z by a pinhole camera whose image it just fills, hither and yon at it."""
    center = mesh.bounds.mean(0)
    radius = np.linalg.norm(mesh.vertices - center, axis=1).max()
    eye = center + [0, 0, radius / np.sin(half_angle)]
    at = ((np.arange(w) + 0.5) / w * 2 - 1) * np.tan(half_angle)
    direction = np.stack([*np.meshgrid(at, at), np.full((w, w), -1.0)], -1).reshape(-1, 3)
    _, z = first_hits(mesh, np.broadcast_to(eye, direction.shape), direction)
    z = np.where(np.isfinite(z), z, np.nan).reshape(w, w)
    hither, yon = np.nanmin(z), np.nanmax(z)
    q = (1 / z - 1 / yon) / (1 / hither - 1 / yon)
    return q.astype(np.float32), lambda v: 1 / (1 / yon + v * (1 / hither - 1 / yon)), yon - hither
