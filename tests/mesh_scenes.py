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


# Of rays that mirrors send on; mirrors of mirrors of mirrors add less than a test can tell.
BOUNCES = 6


def smooth_mirror(shape: trimesh.Trimesh, material: Material = MIRROR) -> trimesh.Trimesh:
    """The shape, marked for snapshot(): of this material, shaded smooth."""
    shape.metadata.update(material=material, smooth=True)
    return shape


def snapshot(reflector: trimesh.Trimesh, **others: trimesh.Trimesh) -> SceneSnapshot:
    """The reflector is called Mirror; the shapes lie in world space already, far or near. A shape is matte and flat, but
    for what its metadata says: material, a Material or one for each face's index in `faces`; smooth."""
    meshes, instances, materials = [], [], [MIRROR, MATTE]
    for index, (name, shape) in enumerate({"Mirror": reflector, **others}.items()):
        # Like Blender: float32 about the object's own origin, placed by a float64 matrix.
        matrix = trimesh.transformations.translation_matrix(np.asarray(shape.vertices).mean(0))
        local = (shape.vertices - matrix[:3, 3]).astype(np.float32)
        corners = np.repeat(np.asarray(shape.face_normals, np.float32)[:, None], 3, 1)
        if shape.metadata.get("smooth"):
            corners = np.asarray(shape.vertex_normals, np.float32)[shape.faces]
        given = shape.metadata.get("material", MIRROR if index == 0 else MATTE)
        given = given if isinstance(given, tuple) else (given,)
        slots = []
        for material in given:
            if material not in materials:
                materials.append(material)
            slots.append(materials.index(material))
        shown = np.asarray(shape.metadata.get("faces", np.zeros(len(shape.faces))), np.int32)
        meshes.append(Mesh(local, np.asarray(shape.faces, np.int32), corners, shown))
        shiny = any(m.is_reflector for m in given)
        instances.append(Instance(name, name, index, matrix, tuple(slots), shiny))
    return SceneSnapshot("test", 1, tuple(meshes), tuple(materials), tuple(instances))


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

    def distances(instance, rays, slots=None):
        mesh = world_mesh(scene, instance)
        if slots is not None:
            mesh = trimesh.Trimesh(mesh.vertices, mesh.faces[np.isin(scene.slots(instance), slots)], process=False)
        return first_hits(mesh, rays.origin, rays.direction)[1]

    return distances


def tracer(scene: SceneSnapshot, paint=None, made=None):
    """BakeJob.trace. paint(positions (N, 3), owner (N,) index or -1) -> radiance that surfaces send out of their own; metals
    send none, and mirrors what reaches them, by Schlick's curve or Fresnel's equations. made: list that collects (rays, hide).
    Paint has no lobe: glossy=True says so."""
    paint = paint or (lambda position, owner: smooth(position) * (2.0 + owner[:, None]))
    meshes = [world_mesh(scene, instance) for instance in scene.instances]

    def trace(rays: Rays, hide=(), samples=1, progress=None, bounces=BOUNCES, glossy=False) -> Hits:
        if made is not None and bounces == BOUNCES:
            made.append((rays, tuple(hide)))
        count = len(rays)
        nearest, owner, triangle = np.full(count, np.inf), np.full(count, -1), np.zeros(count, int)
        for index, (instance, mesh) in enumerate(zip(scene.instances, meshes, strict=True)):
            if instance.object_name in hide:
                continue
            which, distance = first_hits(mesh, rays.origin, rays.direction)
            owner, triangle = np.where(distance < nearest, index, owner), np.where(distance < nearest, which, triangle)
            nearest = np.minimum(nearest, distance)
        found = hits(rays, np.where(np.isfinite(nearest), nearest, SKY), lambda position: paint(position, owner))
        radiance, normal = found.radiance, np.zeros((count, 3), np.float32)
        for index, instance in enumerate(scene.instances):
            mine = np.flatnonzero(owner == index)
            if not len(mine):
                continue
            normal[mine] = shading_normals(scene, instance, meshes[index], triangle[mine], found.position[mine], rays.direction[mine])
            if not instance.is_reflector:
                continue
            slots = scene.slots(instance)[triangle[mine]]
            for slot in np.unique(slots):
                material = scene.materials[instance.materials[slot]]
                some = mine[slots == slot]
                if not material.is_reflector:
                    continue
                d = rays.direction[some].astype(np.float64)
                cosine = -np.minimum((d * normal[some]).sum(1), 0)
                reflected = mirror_reflectance(material, cosine[:, None])
                radiance[some] *= (1 - material.metallic) * (1 - reflected.max(1, keepdims=True))
                if bounces:
                    onward = d + 2 * cosine[:, None] * normal[some]
                    lift = 1e-5 * np.maximum(np.abs(found.position[some]).max(1, keepdims=True), 1e-3 * scene.diagonal())
                    start = found.position[some] + lift * normal[some]
                    again = trace(Rays(start.astype("f"), onward.astype("f")), (), samples, None, bounces - 1)
                    radiance[some] += reflected * again.radiance
        names, lobes = tuple(i.name for i in scene.instances), np.zeros_like(radiance) if glossy else None
        return Hits(radiance, found.position, normal, owner.astype(np.int32), found.hit, names, lobes)

    return trace


def mirror_reflectance(material: Material, cosine) -> np.ndarray:
    """(N, 3) for cosine (N, 1): Schlick for a metal without tint, else Fresnel's equations for a dielectric."""
    if material.metallic == 1:
        base = np.array(material.base_color)
        return base + (1 - base) * (1 - cosine) ** 5
    inner = np.sqrt(1 - (1 - cosine**2) / material.ior**2)
    across, along = (cosine - material.ior * inner) / (cosine + material.ior * inner), (inner - material.ior * cosine) / (inner + material.ior * cosine)
    return np.repeat((across**2 + along**2) / 2, 3, axis=1)


def shading_normals(scene, instance, mesh, triangle, position, direction) -> np.ndarray:
    """(N, 3) unit: the corners' normals by barycentric coordinates, towards where the ray came from."""
    at = trimesh.triangles.points_to_barycentric(mesh.triangles[triangle], np.asarray(position, np.float64), method="cross")
    normal = unit(np.einsum("nc,ncx->nx", at, scene.meshes[instance.mesh].corner_normals[triangle].astype(np.float64)))
    facing = (unit(mesh.triangles_cross[triangle]) * direction).sum(1) > 0
    return np.where(facing[:, None], -normal, normal).astype(np.float32)


def job(scene: SceneSnapshot, settings: dict, required=None, paint=None, made=None) -> BakeJob:
    return BakeJob(scene, scene.instances[0], tracer(scene, paint, made), intersect(scene), settings, required or {})


def depth_map(mesh: trimesh.Trimesh, w: int, half_angle=np.radians(15)):
    """(q (w, w) float32, z of q): the mesh seen along -Z by a pinhole camera whose image it just fills, hither and yon
    at it."""
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
