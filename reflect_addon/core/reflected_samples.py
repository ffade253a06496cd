"""What a reflector's rays really meet: sample rays from its surface, traced once [popescu-2006 section 6; design].

Nobody knows the cameras to come, so viewers are anywhere: from far away a surface is seen in proportion to the cosine of
its slant, so mirrored directions are spread by the cosine about the normal. A small thing on a wide floor is met by a
handful of such rays, which do not tell from where it is seen: more are aimed at it, as they would have met it.
"""

import numpy as np

from .job import BakeJob
from .rays import Hits, Rays
from .snapshot import Instance, SceneSnapshot

# Rays of one reflector: a part that one in a hundred meets is then met by some forty.
COUNT = 4096
# Rays start this share of the scene's diagonal above the surface, below any visible gap, as the truth's do ...
LIFT = 2e-5
# ... or this share of their largest coordinate, above float32's rounding: a small scene may lie far from the origin.
LIFT_ROUNDING = 8 * 2.0**-23
# Aimed rays of one object, each chosen among this many starting points by what passes between them and where it ends.
AIMED = 512
CHOICES = 8
# A viewer stands at least this many of the reflector's radii away.
VIEW = 1.0


def lifted(origin: np.ndarray, normal: np.ndarray, diagonal: float) -> np.ndarray:
    """(N, 3) float32: points on reflectors, moved off them along their normals, so that rays do not meet what they start on."""
    return (origin + normal * LIFT * diagonal).astype(np.float32)


def reflected(job: BakeJob, count: int = COUNT, seed: int = 7) -> tuple[Rays, Hits]:
    """(rays from the reflector's surface, what they meet first, the reflector itself included).

    A point that no viewer sees (inside another object, in a narrow gap) has no ray: towards the viewer, too, the way
    must be free for VIEW of the reflector's radius.
    """
    return seen_by_viewers(job, *sample_rays(job, count, seed))


def aimed(job: BakeJob, instances: list[Instance], count: int = AIMED, seed: int = 8) -> tuple[Rays, Hits]:
    """The same for rays that are aimed at points spread evenly over each instance, whatever they meet first."""
    rng = np.random.default_rng(seed)
    parts = [_aimed_rays(job, instance, count, rng) for instance in instances]
    rays = Rays(*(np.concatenate([getattr(r, f) for r, _ in parts]) for f in ("origin", "direction")))
    return seen_by_viewers(job, rays, np.concatenate([t for _, t in parts]))


def seen_by_viewers(job: BakeJob, rays: Rays, towards: np.ndarray) -> tuple[Rays, Hits]:
    """(rays whose viewers, in the directions `towards`, have a free way to them, what they meet)."""
    n = len(rays)
    both = Rays(np.concatenate([rays.origin, rays.origin]), np.concatenate([rays.direction, towards]))
    hits = job.trace(both, hide=(), samples=1)
    low, high = job.scene.bounds([job.reflector])
    clear = VIEW * float(np.linalg.norm(high - low)) / 2
    free = ~hits.hit[n:] | (np.linalg.norm(hits.position[n:] - rays.origin, axis=-1) > clear)
    return Rays(rays.origin[free], rays.direction[free]), hits.part(slice(0, n)).part(free)


def sample_rays(job: BakeJob, count: int, seed: int) -> tuple[Rays, np.ndarray]:
    """(rays from points spread evenly over the reflector's surface, (N, 3) float32 directions towards their viewers)."""
    rng = np.random.default_rng(seed)
    point, normal, flat = _surface(job, count, rng)
    if not len(point):
        return Rays(*np.zeros((2, 0, 3), np.float32)), np.zeros((0, 3), np.float32)
    sphere = rng.normal(size=(count, 3))
    sphere /= np.linalg.norm(sphere, axis=-1, keepdims=True)
    direction = normal + 0.999 * sphere
    direction /= np.linalg.norm(direction, axis=-1, keepdims=True)
    # A shading normal may send a ray below its own triangle: there it is lifted, as the ray map lifts it.
    below = np.minimum(np.einsum("nx,nx->n", direction, flat) - 1e-3, 0)
    direction -= below[:, None] * flat
    direction /= np.linalg.norm(direction, axis=-1, keepdims=True)
    return _with_viewers(point, normal, direction)


def _aimed_rays(job: BakeJob, instance: Instance, count: int, rng) -> tuple[Rays, np.ndarray]:
    """Rays between points of the reflector and the instance, by the light that would pass from one to the other."""
    target, _, _, cross = points_on(job.scene, instance, count, rng)
    start, normal, flat = _surface(job, CHOICES * len(target), rng)
    if not len(start):
        return Rays(*np.zeros((2, 0, 3), np.float32)), np.zeros((0, 3), np.float32)
    start, normal, flat = (a.reshape(len(target), CHOICES, 3) for a in (start, normal, flat))
    way = target[:, None] - start
    length = np.maximum(np.linalg.norm(way, axis=-1), 1e-30)
    direction = way / length[..., None]
    leaving = np.maximum(np.einsum("ncx,ncx->nc", direction, normal), 0)
    leaving *= np.einsum("ncx,ncx->nc", direction, flat) > 0
    passes = leaving * np.abs(np.einsum("ncx,nx->nc", direction, cross)) / length**2
    # One of the choices by its share; none where nothing passes.
    heaped = np.cumsum(passes, axis=1)
    pick = np.minimum((heaped < rng.random((len(target), 1)) * heaped[:, -1:]).sum(1), CHOICES - 1)
    rows = np.flatnonzero(heaped[:, -1] > 0)
    pick = pick[rows]
    return _with_viewers(start[rows, pick], normal[rows, pick], direction[rows, pick])


def _with_viewers(point: np.ndarray, normal: np.ndarray, direction: np.ndarray) -> tuple[Rays, np.ndarray]:
    """(rays, directions back to those who see along them by the mirror)."""
    towards = 2 * np.einsum("nx,nx->n", direction, normal)[:, None] * normal - direction
    return Rays(point.astype(np.float32), direction.astype(np.float32)), towards.astype(np.float32)


def _surface(job: BakeJob, count: int, rng) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(points just above the reflector, shading normals, face normals on the same side), (N, 3) each, world, normals unit."""
    mesh = job.scene.meshes[job.reflector.mesh]
    point, triangle, share, cross = points_on(job.scene, job.reflector, count, rng)
    if not len(point):
        return point, point, point
    normal_from_object = np.linalg.inv(job.reflector.world_from_object[:3, :3]).T
    normal = np.einsum("nc,ncx->nx", share, mesh.corner_normals[triangle].astype(np.float64)) @ normal_from_object.T
    normal /= np.maximum(np.linalg.norm(normal, axis=-1, keepdims=True), 1e-30)
    flat = cross / np.linalg.norm(cross, axis=-1, keepdims=True)
    flat *= np.sign(np.einsum("nx,nx->n", flat, normal))[:, None]
    return point + flat * LIFT * job.scene.diagonal(), normal, flat


def points_on(scene: SceneSnapshot, instance: Instance, count: int, rng):
    """(world points (N, 3), their triangles (N,), barycentric shares (N, 3), the triangles' normals (N, 3), not unit), spread
    evenly over the instance's surface; none where it has no area."""
    corners = scene.world_positions(instance)[scene.meshes[instance.mesh].triangles]
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(cross, axis=-1)
    total = area.sum()
    if not total > 0:
        return np.zeros((0, 3)), np.zeros(0, int), np.zeros((0, 3)), np.zeros((0, 3))
    triangle = np.minimum(np.searchsorted(np.cumsum(area) / total, rng.random(count)), len(area) - 1)
    a, b = np.sort(rng.random((2, count)), axis=0)
    share = np.stack([a, b - a, 1 - b], -1)
    return np.einsum("nc,ncx->nx", share, corners[triangle]), triangle, share, cross[triangle]
