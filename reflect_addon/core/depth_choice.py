"""How many depth maps of an object, and from where: chosen by the points that reflected rays meet [popescu-2006 section 6].

"for the ears of the bunny to correctly reflect each other, at least two depth maps are needed. We will investigate
optimizing the placement". Every candidate view is judged by which of the met points it sees, not too slanted; views are
added while they see a share of points that no other does.
"""

from collections.abc import Callable

import numpy as np

from .depth_camera import DepthCamera, fit
from .depth_fit import DepthView
from .job import BakeJob
from .rays import Rays
from .reflected_samples import aimed, reflected
from .snapshot import Instance

# Candidate directions beside the one that faces the reflector, spread evenly over the sphere.
CANDIDATES = 26
# A further map must see this share of all the object's met points anew.
WORTH = 0.01
# Points met judged per object: the share of a map that is worth having is then ten points or more.
JUDGED = 1000
# Fewer points than this do not tell from where an object is seen: rays are aimed at it.
TELLING = 200
# A surface is seen where a map's ray ends within this share of the object's size of it ...
NEAR = 4e-3
# ... and seen well where it faces the camera by more than this cosine: below it, a texel covers five times its width.
SLANT = 0.2
# A reflector sees itself when this share of its rays does.
SELF = 0.003


def views_for(job: BakeJob, volumes: tuple[str, ...]) -> list[DepthView]:
    """The views of every volume (names of instances), and of the reflector where its own rays meet it. What does not depend on how many there are is worked
    out once for all bakes of a run (job.shared): a plan makes a dozen of the same reflector."""
    by_name = {i.name: i for i in job.scene.instances}
    lamps = {i.name: i for i in job.scene.lamps}
    if not volumes and not job.settings["self_reflections"]:
        return []

    def once(what: tuple, make: Callable[[], object]):
        key = (views_for, job.reflector.name, *what)
        if key not in job.shared:
            job.shared[key] = make()
        return job.shared[key]

    rays, hits = once((), lambda: reflected(job))
    views: list[DepthView] = []
    wanted = [by_name.get(name) or lamps[name] for name in volumes]
    points = {i.name: (hits.position[met], hits.normal[met]) for i in wanted for met in [_met(job, i, hits)]}
    rare = [i for i in wanted if len(points[i.name][0]) < TELLING]
    told = tuple(i.name for i in rare)
    if rare:
        _, more = once(told, lambda: aimed(job, rare))
        points |= {i.name: (more.position[met], more.normal[met]) for i in rare for met in [_met(job, i, more)]}
    maps = int(job.settings["maps"])
    for instance in wanted:
        which = ("cameras", instance.name, maps, told if instance.name in told else ())
        views += [DepthView(instance.name, c) for c in once(which, lambda i=instance: chosen(job, i, *points[i.name]))]
    met = _met(job, job.reflector, hits)
    if job.settings["self_reflections"] and len(rays) and np.mean(met) > SELF:
        cameras = once(("cameras", job.reflector.name, maps, ()), lambda: chosen(job, job.reflector, hits.position[met], hits.normal[met]))
        views += [DepthView(job.reflector.name, c, own=True, detail=int(job.settings["self_detail"])) for c in cameras]
    return views


def chosen(job: BakeJob, instance: Instance, points: np.ndarray, normals: np.ndarray) -> list[DepthCamera]:
    """Cameras of one instance, at most settings["maps"], at least one: the best first. points, normals: (N, 3), met by rays."""
    vertices = job.scene.world_positions(instance)
    vertices = vertices[np.unique(job.scene.meshes[instance.mesh].triangles)]
    middle = (vertices.min(0) + vertices.max(0)) / 2
    facing = job.center() - middle
    if not len(points):  # rays may still meet it from views that the samples did not think of
        return [fit(vertices, facing)]
    step = max(len(points) // JUDGED, 1)
    points, normals = points[::step].astype(np.float64), normals[::step].astype(np.float64)
    near = NEAR * float(np.linalg.norm(vertices - middle, axis=-1).max())
    cameras = [fit(vertices, towards) for towards in (facing, *_spread(CANDIDATES))]
    seen = np.array([_seen(job, instance, camera, points, normals, near) for camera in cameras])
    kept: list[int] = []
    covered = np.zeros(len(points), bool)
    while len(kept) < int(job.settings["maps"]):
        gain = (seen & ~covered).mean(1)
        best = int(np.argmax(gain))
        if kept and gain[best] < WORTH:
            break
        kept.append(best)
        covered |= seen[best]
    return [cameras[i] for i in kept]


def _met(job: BakeJob, instance: Instance, hits) -> np.ndarray:
    """(N,) bool: which rays ended on the instance (one dupli of an object: where it stands)."""
    if instance.object_name not in hits.object_names:
        return np.zeros(len(hits.object), bool)
    met = hits.hit & (hits.object == hits.object_names.index(instance.object_name))
    if instance.name != instance.object_name or any(
        i.object_name == instance.object_name and i.name != instance.name for i in job.scene.instances
    ):
        low, high = job.scene.bounds([instance])
        slack = 1e-3 * float(np.max(high - low))
        met = met & np.all((hits.position >= low - slack) & (hits.position <= high + slack), axis=1)
    return met


def _seen(job: BakeJob, instance: Instance, camera: DepthCamera, points, normals, near: float) -> np.ndarray:
    """(N,) bool: which points the camera sees well."""
    towards = points - camera.eye
    length = np.linalg.norm(towards, axis=-1)
    direction = towards / length[:, None]
    facing = np.abs(np.einsum("nx,nx->n", direction, normals)) > SLANT
    origin = np.broadcast_to(camera.eye, direction.shape)
    distance = job.intersect(instance, Rays(origin[facing], direction[facing]))
    out = np.zeros(len(points), bool)
    out[facing] = np.abs(distance - length[facing]) < near
    return out


def _spread(count: int) -> np.ndarray:
    """(count, 3) unit directions, a Fibonacci lattice."""
    i = np.arange(count) + 0.5
    z, angle = 1 - 2 * i / count, np.pi * (1 + np.sqrt(5)) * i
    ring = np.sqrt(1 - z * z)
    return np.stack([ring * np.cos(angle), ring * np.sin(angle), z], -1)
