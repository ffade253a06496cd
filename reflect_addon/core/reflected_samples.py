"""What a reflector's rays really meet: sample rays from its surface, traced once [popescu-2006 section 6; design].

Nobody knows the cameras to come, so viewers are anywhere: from far away a surface is seen in proportion to the cosine of
its slant, so mirrored directions are spread by the cosine about the normal.
"""

import numpy as np

from .job import BakeJob
from .rays import Hits, Rays

# Rays of one reflector: a part that one in a hundred meets is then met by some forty.
COUNT = 4096
# Rays start this share of the scene's diagonal above the surface, as the truth's do.
LIFT = 2e-5
# A viewer stands at least this many of the reflector's radii away.
VIEW = 1.0


def reflected(job: BakeJob, count: int = COUNT, seed: int = 7) -> tuple[Rays, Hits]:
    """(rays from the reflector's surface, what they meet first, the reflector itself included).

    A point that no viewer sees (inside another object, in a narrow gap) has no ray: towards the viewer, too, the way
    must be free for VIEW of the reflector's radius.
    """
    rays, towards = sample_rays(job, count, seed)
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
    mesh = job.scene.meshes[job.reflector.mesh]
    point, triangle, share, cross = points_on(job, count, rng)
    if not len(point):
        return Rays(*np.zeros((2, 0, 3), np.float32)), np.zeros((0, 3), np.float32)
    normal_from_object = np.linalg.inv(job.reflector.world_from_object[:3, :3]).T
    normal = np.einsum("nc,ncx->nx", share, mesh.corner_normals[triangle].astype(np.float64)) @ normal_from_object.T
    normal /= np.maximum(np.linalg.norm(normal, axis=-1, keepdims=True), 1e-30)
    sphere = rng.normal(size=(count, 3))
    sphere /= np.linalg.norm(sphere, axis=-1, keepdims=True)
    direction = normal + 0.999 * sphere
    direction /= np.linalg.norm(direction, axis=-1, keepdims=True)
    flat = cross / np.linalg.norm(cross, axis=-1, keepdims=True)
    flat *= np.sign(np.einsum("nx,nx->n", flat, normal))[:, None]
    # A shading normal may send a ray below its own triangle: there it is lifted, as the ray map lifts it.
    below = np.minimum(np.einsum("nx,nx->n", direction, flat) - 1e-3, 0)
    direction -= below[:, None] * flat
    direction /= np.linalg.norm(direction, axis=-1, keepdims=True)
    point += flat * LIFT * job.scene.diagonal()
    towards = 2 * np.einsum("nx,nx->n", direction, normal)[:, None] * normal - direction
    return Rays(point.astype(np.float32), direction.astype(np.float32)), towards.astype(np.float32)


def points_on(job: BakeJob, count: int, rng) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """(world points (N, 3), their triangles (N,), barycentric shares (N, 3), the triangles' normals (N, 3), not unit), spread
    evenly over the reflector's surface; none where it has no area."""
    corners = job.scene.world_positions(job.reflector)[job.scene.meshes[job.reflector.mesh].triangles]
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(cross, axis=-1)
    total = area.sum()
    if not total > 0:
        return np.zeros((0, 3)), np.zeros(0, int), np.zeros((0, 3)), np.zeros((0, 3))
    triangle = np.minimum(np.searchsorted(np.cumsum(area) / total, rng.random(count)), len(area) - 1)
    a, b = np.sort(rng.random((2, count)), axis=0)
    share = np.stack([a, b - a, 1 - b], -1)
    return np.einsum("nc,ncx->nx", share, corners[triangle]), triangle, share, cross[triangle]
