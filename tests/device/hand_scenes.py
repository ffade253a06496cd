"""Small snapshots, cameras, assets and kernels by hand: what the device tests draw."""

import numpy as np

from reflect_addon.core.asset import Asset
from reflect_addon.core.camera import Camera
from reflect_addon.core.kernel import Hit
from reflect_addon.core.snapshot import Instance, Material, Mesh, SceneSnapshot
from reflect_addon.core.spaces import FAR, STATUS_HIT

MIRROR = Material("mirror", metallic=1.0, roughness=0.0, base_color=(1, 1, 1), is_reflector=True)
MATTE = Material("matte")


def sphere_mesh(segments=64, rings=32) -> Mesh:
    """A unit sphere whose corner normals are its positions: interpolated and normalised they are exact."""
    theta = np.linspace(0, np.pi, rings + 1)
    phi = np.linspace(0, 2 * np.pi, segments + 1)
    t, p = np.meshgrid(theta, phi, indexing="ij")
    positions = np.stack([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)], -1).reshape(-1, 3)
    i, j = np.meshgrid(np.arange(rings), np.arange(segments), indexing="ij")
    a = (i * (segments + 1) + j).ravel()
    b, c, d = a + 1, a + segments + 1, a + segments + 2
    triangles = np.concatenate([np.stack([a, c, b], -1), np.stack([b, c, d], -1)])
    corners = positions[triangles]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=-1)
    triangles = triangles[area > 1e-9]
    return _mesh(positions, triangles, positions[triangles])


def quad_mesh() -> Mesh:
    """A square of side 2 in the plane z = 0, facing +Z."""
    positions = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], float)
    triangles = np.array([[0, 1, 2], [0, 2, 3]])
    return _mesh(positions, triangles, np.broadcast_to([0.0, 0, 1], (2, 3, 3)))


def cube_mesh() -> Mesh:
    """A cube of side 2 with flat normals, 6 material slots: one a face."""
    triangles, positions, normals = [], [], []
    for face in range(6):
        axis, sign = face // 2, 1 - 2 * (face % 2)
        normal = np.zeros(3)
        normal[axis] = sign
        u, v = np.roll(np.eye(3)[0], (axis + 1) % 3), np.roll(np.eye(3)[0], (axis + 2) % 3)
        start = len(positions)
        ring = [normal - u - v, normal + u - v, normal + u + v, normal - u + v]
        positions += ring if sign > 0 else ring[::-1]
        triangles += [[start, start + 1, start + 2], [start, start + 2, start + 3]]
        normals += [[normal] * 3] * 2
    mesh = _mesh(np.array(positions), np.array(triangles), np.array(normals))
    return Mesh(mesh.positions, mesh.triangles, mesh.corner_normals, np.repeat(np.arange(6), 2).astype(np.int32))


def _mesh(positions, triangles, normals) -> Mesh:
    return Mesh(
        np.asarray(positions, np.float32),
        np.asarray(triangles, np.int32),
        np.ascontiguousarray(normals, np.float32),
        np.zeros(len(triangles), np.int32),
    )


def placed(location=(0, 0, 0), scale=1.0) -> np.ndarray:
    matrix = np.diag([*np.broadcast_to(np.asarray(scale, float), 3), 1.0])
    matrix[:3, 3] = location
    return matrix


def snapshot(*things) -> SceneSnapshot:
    """things: (name, mesh, world_from_object, material)."""
    meshes, materials, instances = [], [], []
    for name, mesh, matrix, material in things:
        if not any(m is mesh for m in meshes):
            meshes.append(mesh)
        if material not in materials:
            materials.append(material)
        index = next(k for k, m in enumerate(meshes) if m is mesh)
        slot = materials.index(material)
        instances.append(Instance(name, name, index, matrix, (slot,), material.is_reflector))
    return SceneSnapshot("test", 1, tuple(meshes), tuple(materials), tuple(instances))


def camera(eye, target, size=(96, 64), fov=0.8, near=0.05, far=1000.0, ortho=None) -> Camera:
    """Looks from eye at target, +Z up; fov: vertical, radians; ortho: height of the view in m instead."""
    eye, target = np.asarray(eye, float), np.asarray(target, float)
    back = eye - target
    back /= np.linalg.norm(back)
    side = np.cross([0, 0, 1.0] if abs(back[2]) < 0.999 else [0, 1.0, 0], back)
    side /= np.linalg.norm(side)
    world = np.eye(4)
    world[:3, :3] = np.stack([side, np.cross(back, side), back], -1)
    world[:3, 3] = eye
    aspect = size[0] / size[1]
    clip = np.zeros((4, 4))
    if ortho is None:
        f = 1 / np.tan(fov / 2)
        clip[0, 0], clip[1, 1] = f / aspect, f
        clip[2, 2], clip[2, 3] = (far + near) / (near - far), 2 * far * near / (near - far)
        clip[3, 2] = -1
    else:
        clip[0, 0], clip[1, 1] = 2 / (ortho * aspect), 2 / ortho
        clip[2, 2], clip[2, 3] = -2 / (far - near), -(far + near) / (far - near)
        clip[3, 3] = 1
    return Camera(world, clip, *size)


def sky_kernel(k, asset, ray):
    """A toy method: a gradient along world z, two colours from the asset, its strength from an image."""
    up = k.name("up", ray.direction.z * 0.5 + 0.5)
    strength = k.sample(asset.images["strength_tx"], up * asset.images["strength_tx"].size.x, 0.5).x
    colour = k.mix(asset.uniforms["ground"], asset.uniforms["zenith"], up) * strength
    return Hit(colour, ray.origin + ray.direction * FAR, 1.0, STATUS_HIT)


def sky_asset(reflector="", ground=(1.0, 0.2, 0.1), zenith=(0.1, 0.3, 2.0)) -> Asset:
    strength = np.ones((1, 4, 4), np.float16)
    strength[0, :, :3] = np.linspace(0.5, 1.0, 4)[:, None]
    return Asset("sky", reflector, {"strength_tx": strength}, {"ground": ground, "zenith": zenith})


def kernels(kind):
    return {"sky": sky_kernel, "white": white_kernel}[kind]


def white_kernel(k, asset, ray):
    """Radiance 1 from everywhere, one metre away along the ray."""
    return Hit(k.vec3(1.0), ray.origin + ray.direction, 1.0, STATUS_HIT)


def white_asset() -> Asset:
    return Asset("white", "", {})
