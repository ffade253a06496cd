"""The ray map without a GPU: primary rays against Blender's BVH tree. The same rules as gpu/glsl/raymap.frag.glsl,
without its footprints (width and spread are 0)."""

from collections.abc import Callable

import numpy as np
from mathutils.bvhtree import BVHTree

from ..core.camera import Camera
from ..core.rays import RayMap
from ..core.snapshot import SceneSnapshot


def numpy_ray_map(snapshot: SceneSnapshot, camera: Camera) -> RayMap:
    """Mirror rays of the reflectors that the camera sees; other surfaces hide them."""
    return ray_mapper(snapshot)(camera)


def ray_mapper(snapshot: SceneSnapshot) -> Callable[[Camera], RayMap]:
    """numpy_ray_map of a scene for several cameras, its tree made once."""
    names = tuple(i.name for i in snapshot.reflectors())
    soup = _soup(snapshot)
    triangles = np.arange(3 * len(soup["corners"])).reshape(-1, 3)
    tree = BVHTree.FromPolygons(soup["corners"].reshape(-1, 3).tolist(), triangles.tolist()) if len(triangles) else None

    def ray_map(camera: Camera) -> RayMap:
        shape = (camera.height, camera.width)
        rays = camera.primary_rays()
        count = len(rays)
        origin, direction, normal = (np.zeros((count, 3), np.float32) for _ in range(3))
        reflector = np.full(count, -1, np.int32)
        if tree is not None:
            pixels, triangles = _first_hits(tree, rays, *_reach(camera, rays))
            shiny = soup["reflector"][triangles] >= 0
            pixels, triangles = pixels[shiny], triangles[shiny]
            view, start = rays.direction[pixels].astype(np.float64), rays.origin[pixels].astype(np.float64)
            point, weights = _meet(soup["corners"][triangles], start, view)
            mirrored, shading = _mirror(soup, triangles, weights, view)
            origin[pixels], direction[pixels], normal[pixels] = point, mirrored, shading
            reflector[pixels] = soup["reflector"][triangles]
        zero = np.zeros(shape, np.float32)
        image = (*shape, 3)
        return RayMap(
            origin.reshape(image), direction.reshape(image), normal.reshape(image), reflector.reshape(shape), zero, zero, names
        )

    return ray_map


def _soup(snapshot: SceneSnapshot) -> dict[str, np.ndarray]:
    """All triangles in world space: corners (T, 3, 3), normals (T, 3, 3), reflector (T,) or -1."""
    corners, normals, reflectors = [np.zeros((0, 3, 3))], [np.zeros((0, 3, 3))], [np.zeros(0, np.int32)]
    index = -1
    for instance in snapshot.instances:
        mesh = snapshot.meshes[instance.mesh]
        index += instance.is_reflector
        if not len(mesh.triangles):
            continue
        corners.append(snapshot.world_positions(instance)[mesh.triangles])
        turned = mesh.corner_normals.astype(np.float64) @ np.linalg.pinv(instance.world_from_object[:3, :3])
        normals.append(turned)
        slots = np.clip(mesh.material_index, 0, len(instance.materials) - 1)
        shiny = np.array([snapshot.materials[m].is_reflector for m in instance.materials])[slots]
        # As the ray map pass has it: a reflector that was marked by hand shines all over.
        shines = (shiny if shiny.any() else np.ones(len(shiny), bool)) & instance.is_reflector
        reflectors.append(np.where(shines, index, -1).astype(np.int32))
    return {n: np.concatenate(a) for n, a in (("corners", corners), ("normals", normals), ("reflector", reflectors))}


def _reach(camera: Camera, rays) -> tuple[np.ndarray, np.ndarray]:
    """(N,) each: where along the rays the camera's clipping planes lie, as a rasteriser clips."""
    near, far = camera.depths()
    if camera.is_orthographic:  # its rays start on the near plane
        return np.zeros(len(rays)), np.full(len(rays), far - near)
    along = rays.direction.astype(np.float64) @ -camera.world_from_camera[:3, 2]
    return near / along, far / along


def _first_hits(tree: BVHTree, rays, near: np.ndarray, far: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(pixels, triangles) of the rays that meet something between near and far."""
    starts = rays.origin + rays.direction * near[:, None]
    rays_within = zip(starts.tolist(), rays.direction.tolist(), (far - near).tolist())
    found = [tree.ray_cast(start, direction, reach)[2] for start, direction, reach in rays_within]
    triangles = np.array([-1 if t is None else t for t in found], np.int64)
    pixels = np.flatnonzero(triangles >= 0)
    return pixels, triangles[pixels]


def _meet(corners: np.ndarray, start: np.ndarray, view: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(points, barycentric weights (N, 3)) of rays on the planes of their triangles, in double precision."""
    a, ab, ac = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    p = np.cross(view, ac)
    scale = 1 / np.sum(ab * p, -1)
    s = start - a
    u = np.sum(s * p, -1) * scale
    v = np.sum(view * np.cross(s, ab), -1) * scale
    weights = np.clip(np.stack([1 - u - v, u, v], -1), 0, 1)
    weights /= weights.sum(-1, keepdims=True)
    return np.einsum("nc,ncx->nx", weights, corners), weights


def _mirror(soup, triangles, weights, view) -> tuple[np.ndarray, np.ndarray]:
    """(directions, normals): both normals face the viewer, and no ray goes into the surface."""
    corners = soup["corners"][triangles]
    face = _unit(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), -view)
    normal = _unit(np.einsum("nc,ncx->nx", weights, soup["normals"][triangles]), face)
    # The shading normals say which way is out; a mirrored transform turns the triangle round.
    face = np.where(np.sum(face * normal, -1, keepdims=True) < 0, -face, face)
    behind = np.sum(face * view, -1, keepdims=True) > 0
    face, normal = np.where(behind, -face, face), np.where(behind, -normal, normal)
    mirrored = view - 2 * np.minimum(np.sum(view * normal, -1, keepdims=True), 0) * normal
    lowest = np.minimum(0.5 * np.maximum(-np.sum(face * view, -1, keepdims=True), 0), 0.01)
    height = np.sum(mirrored * face, -1, keepdims=True)
    low = height < lowest
    raised = _unit(mirrored + (lowest - height) * face, mirrored)
    normal = np.where(low, _unit(raised - view, face), normal)
    return _unit(np.where(low, raised, mirrored), face), normal


def _unit(vectors: np.ndarray, other: np.ndarray) -> np.ndarray:
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.where(length > 1e-30, vectors / np.maximum(length, 1e-30), other)
