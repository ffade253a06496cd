"""Two mirrors, volumes and flat things that move and deform: snapshots, their bakes through Embree, and what rays see."""

from dataclasses import replace

import numpy as np
import trimesh
from analytic import directions, smooth
from mesh_scenes import job, snapshot, tracer

from reflect_addon.core import methods, spaces, surface_radiance
from reflect_addon.core.kernel import record, run_numpy
from reflect_addon.core.methods import billboards
from reflect_addon.core.rays import Rays

SETTINGS = {**billboards.DEFAULTS, "resolution": 16, "samples": 1, "texels": 64, "sky_error": 0}
SURFACES = {**surface_radiance.DEFAULTS, "surface_samples": 1, "surface_tolerance": 0.02}
VOLUMES, FLAT, MIRRORS = ("Torus", "Rock"), ("Floor", "Crate"), ("Mirror", "Second")


def at(shape, *place):
    return shape.apply_translation(place)


def scene_of_two_mirrors():
    crate = trimesh.creation.box((0.5, 0.6, 0.7))
    found = snapshot(
        at(trimesh.creation.icosphere(3, 0.4), 0, 0, 0.5),
        Second=at(trimesh.creation.icosphere(3, 0.4), 2.2, 0, 0.5),
        Torus=at(trimesh.creation.torus(0.35, 0.15), 1.0, 1.0, 0.5),
        Rock=at(trimesh.creation.icosphere(3, 0.3), 1.0, -1.2, 0.35),
        Floor=at(trimesh.creation.box((8, 8, 0.01)), 0, 0, 0),
        Crate=at(crate, -1.5, 1, 0.4),
    )
    instances = tuple(replace(i, is_reflector=i.name in MIRRORS, materials=(int(i.name not in MIRRORS),)) for i in found.instances)
    return replace(found, instances=instances, light_hash="day")


def paint_of(scene, undone=lambda name, points: points):
    """Paint that is on the objects and goes where they go; undone: from the points (N, 3) of a deformed mesh to where
    they were."""
    inverse = [np.linalg.inv(i.world_from_object) for i in scene.instances]

    def paint(position, owner):
        out = np.zeros((len(position), 3))
        for k, matrix in enumerate(inverse):
            mine = owner == k
            own = position[mine] @ matrix[:3, :3].T + matrix[:3, 3]
            out[mine] = smooth(3 * undone(scene.instances[k].name, own)) + 0.2 * k
        return out

    return paint


def bake(scene, method=billboards, settings=SETTINGS, **deformed):
    """({reflector: asset}, surface radiance of all that may be captured again), through Embree."""
    paint = paint_of(scene, **deformed)
    assets = {r.name: method.bake(replace(job(scene, settings, paint=paint), reflector=r)) for r in scene.reflectors()}
    return assets, surface_radiance.bake(scene, tracer(scene, paint), scene.instances, SURFACES)


def change(scene, name, matrix=None, mesh=None):
    index = next(k for k, i in enumerate(scene.instances) if i.name == name)
    instance, meshes = scene.instances[index], scene.meshes
    if matrix is not None:
        instance = replace(instance, world_from_object=matrix @ instance.world_from_object)
    if mesh is not None:
        meshes = tuple(mesh(m) if k == instance.mesh else m for k, m in enumerate(meshes))
    return replace(scene, meshes=meshes, instances=(*scene.instances[:index], instance, *scene.instances[index + 1 :]))


def step(x=0.0, y=0.0, z=0.0):
    matrix = np.eye(4)
    matrix[:3, 3] = x, y, z
    return matrix


def rays_at(scene, name, count=4000):
    """Mirror-like rays of a reflector: from its surface outwards."""
    rng = np.random.default_rng(5)
    low, high = scene.bounds([scene.named()[name]])
    out = directions(rng, count)
    return Rays(((low + high) / 2 + 0.41 * out).astype("f"), out.astype("f"))


def rays_towards(scene, reflector, name):
    """Rays of a reflector that pass near the middle of another thing."""
    rays, (low, high) = rays_at(scene, reflector), scene.bounds([scene.named()[name]])
    aim = (low + high) / 2 + 0.4 * np.random.default_rng(8).permutation(rays.direction) - rays.origin
    return Rays(rays.origin, (aim / np.linalg.norm(aim, axis=1, keepdims=True)).astype("f"))


def seen(asset, rays):
    return run_numpy(record(methods.get(asset.kind).trace, asset), asset, rays)


def off_from(truth, found):
    """(N,) relative error of the radiance of rays that meet a stand-in in truth."""
    stands = truth.status == spaces.STATUS_HIT
    return np.abs(found.radiance - truth.radiance).max(1)[stands] / (truth.radiance.max(1)[stands] + 0.1)
