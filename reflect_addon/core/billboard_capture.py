"""What billboards show: the texels of all quads of a bake, traced as one bundle from just above the objects' surfaces.

Flat quads are shared by all reflectors and traced once, with all the texels asked for; a volume's quad belongs to one
reflector. No reflector's asset has texels that it sees under less than billboard_fit.FINEST.
"""

import numpy as np

from .billboard_fit import Quad
from .flat_parts import is_closed
from .job import BakeJob
from .rays import Rays
from .snapshot import Instance, corners_of

# Rays start this share of the scene's diagonal above the surface: below any visible gap ...
LIFT = 2e-5
# ... or this share of their largest coordinate, above float32's rounding: a small scene may lie far from the origin.
LIFT_ROUNDING = 8 * 2.0**-23

# A surface closer than this share of an object's size to its inside is covered by it.
COVERED = 1e-3
# Of a ray with one mesh: an object with more walls than this is not one that stands on a floor.
MOST_CROSSINGS = 32


def capture(job: BakeJob, quads: list[Quad]) -> list[np.ndarray]:
    """Per quad (h, w, 4) float32: premultiplied radiance and alpha, row 0 at its low v."""
    viewers = job.scene.bounds([job.reflector])
    most = int(job.settings["texels"])
    texels = [most if quad.shared else quad.enough(most, viewers) for quad in quads]
    least = LIFT * max(job.scene.diagonal(), 1e-30)
    by_name = {i.name: i for i in (*job.scene.instances, *job.scene.lamps)}
    images = [job.shared.get((quad, n)) for quad, n in zip(quads, texels, strict=True)]
    starts, directions, owners = [], [], []
    for index, quad in enumerate(quads):
        if images[index] is not None:
            continue
        rays = quad.rays(texels[index])
        distance = job.intersect(by_name[quad.instance], rays)
        solid = np.isfinite(distance) & (distance <= quad.reach)
        # Computed in float64: float32 positions far from the origin would lose the lift.
        surface = rays.origin.astype(np.float64) + rays.direction * np.where(solid, distance, 0.0)[:, None]
        lift = np.maximum(least, LIFT_ROUNDING * np.abs(surface).max(-1, keepdims=True))
        start = surface - rays.direction * lift
        images[index] = np.zeros((*quad.size(texels[index]), 4), np.float32)
        starts.append(start[solid])
        directions.append(rays.direction[solid])
        owners.append((index, solid))
    if sum(len(s) for s in starts):
        bundle = Rays(np.concatenate(starts).astype(np.float32), np.concatenate(directions).astype(np.float32))
        hits = job.trace(bundle, hide=(job.reflector.object_name,), samples=int(job.settings["samples"]))
        at = 0
        corners = corners_of(viewers)
        for (index, solid), start in zip(owners, starts, strict=True):
            rows = slice(at, at + len(start))
            at += len(start)
            image = images[index].reshape(-1, 4)
            image[solid, :3] = hits.radiance[rows]
            image[solid, 3] = 1.0
            seen = np.zeros(len(image), bool)
            if quads[index].shared:
                seen[solid] = ~covered(job, quads[index], start)
            else:
                seen[solid] = _faces_any(hits.position[rows], hits.normal[rows], corners)
            fill_unseen(images[index], seen.reshape(images[index].shape[:2]))
    job.shared.update({(quad, most): image for quad, image in zip(quads, images, strict=True) if quad.shared})
    return [_coarser(image, quad.size(quad.enough(most, viewers))) for quad, image in zip(quads, images, strict=True)]


def _coarser(image: np.ndarray, size: tuple[int, int]) -> np.ndarray:
    """The image's means over blocks, at most `size` (height, width); all are powers of two."""
    (h, w), (rows, columns) = image.shape[:2], np.minimum(size, image.shape[:2])
    return image.reshape(rows, h // rows, columns, w // columns, 4).mean((1, 3))


def _faces_any(points: np.ndarray, normals: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """(N,) bool: whether the surface at a point can be seen from any of the corners."""
    height = np.einsum("nx,cx->nc", normals, corners) - np.einsum("nx,nx->n", normals, points)[:, None]
    return (height > 0).any(1)


def covered(job: BakeJob, quad: Quad, points: np.ndarray) -> np.ndarray:
    """(N,) bool: a point just above a flat quad lies inside another object, that stands on it or sticks through it."""
    out = np.zeros(len(points), bool)
    normal = np.asarray(quad.normal)
    for other in job.scene.instances:
        low, high = job.scene.bounds([other])
        step = COVERED * float(np.max(high - low))
        raised = points + normal * step
        near = np.flatnonzero(~out & np.all((low <= raised) & (raised <= high), axis=1))
        if other.name == quad.instance or not len(near) or not _is_closed(job, other):
            continue
        # Inside a closed mesh a ray crosses it an odd number of times. Slanted: along the normal it may follow an edge.
        direction = normal + 0.21 * np.asarray(quad.u) + 0.13 * np.asarray(quad.v)
        direction /= np.linalg.norm(direction)
        at, odd = raised[near], np.zeros(len(near), bool)
        going = np.arange(len(near))
        for _ in range(MOST_CROSSINGS):
            distance = job.intersect(other, Rays(at[going], np.broadcast_to(direction, (len(going), 3))))
            met = np.isfinite(distance)
            going, distance = going[met], distance[met]
            if not len(going):
                break
            odd[going] = ~odd[going]
            at[going] += direction * (distance + 1e-3 * step)[:, None]
        out[near] = odd
    return out


def _is_closed(job: BakeJob, instance: Instance) -> bool:
    key = ("closed", instance.mesh)
    if key not in job.shared:
        mesh = job.scene.meshes[instance.mesh]
        job.shared[key] = is_closed(mesh.positions, mesh.triangles)
    return job.shared[key]


def fill_unseen(image: np.ndarray, seen: np.ndarray) -> None:
    """Gives solid texels that nobody can see the radiance of their nearest seen neighbours, in place.

    A camera that stands far behind the reflector may look at an object from under the floor, and see its underside; a
    floor is dark where something stands on it. Once objects are flat, rays reach these places, which they never would.
    image (h, w, 4), seen (h, w) bool.
    """
    missing = (image[..., 3] > 0) & ~seen
    if not (seen & (image[..., 3] > 0)).any():
        return
    while missing.any():
        known = np.pad(np.where(missing | (image[..., 3] == 0), 0.0, 1.0), 1)
        values = np.pad(image[..., :3], ((1, 1), (1, 1), (0, 0))) * known[..., None]
        h, w = missing.shape
        around = [(slice(1 + y, 1 + y + h), slice(1 + x, 1 + x + w)) for y in (-1, 0, 1) for x in (-1, 0, 1)]
        count = sum(known[a] for a in around)
        reached = missing & (count > 0)
        if not reached.any():
            break  # an island without a seen texel keeps what was captured
        image[reached, :3] = (sum(values[a] for a in around) / np.maximum(count, 1)[..., None])[reached]
        missing = missing & ~reached
