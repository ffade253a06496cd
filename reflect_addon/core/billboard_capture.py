"""What billboards show: the texels of all quads of a bake, traced as one bundle from just above the objects' surfaces.

Flat quads are shared by all reflectors and traced once, with all the texels asked for; a volume's quad belongs to one
reflector. No reflector's asset has texels that it sees under less than billboard_fit.FINEST.
"""

from dataclasses import dataclass

import numpy as np

from . import billboard_mirrors
from .billboard_fit import Quad
from .flat_parts import is_closed
from .glossy import glossy_of, is_on, matte
from .job import BakeJob
from .mirrors import mirror_of
from .rays import Hits, Rays
from .reflected_samples import LIFT, LIFT_ROUNDING
from .snapshot import Instance, corners_of

# Of a lamp's size, rays to it start this far off: its mesh lies inside the true ball (scene/lamps.py), and from inside a
# ball does not shine. At its rim more would be needed, but a shade may be near.
LAMP_LIFT = 0.05

# A surface closer than this share of an object's size to its inside is covered by it.
COVERED = 1e-3
# Of a ray with one mesh: an object with more walls than this is not one that stands on a floor.
MOST_CROSSINGS = 32


@dataclass(frozen=True, eq=False)
class Texels:
    """What fills a quad; row 0 at its low v."""

    radiance: np.ndarray  # (h, w, 4) float32: premultiplied radiance and alpha; of mirrors their own light only
    # (h, w, 4) float32 relief of a mirror: world unit normal * share that mirrors, height above the plane in half widths,
    # all times alpha; None: nothing of it mirrors
    normals: np.ndarray | None = None
    distance: np.ndarray | None = None  # (h, w) float64, m along the capture's rays, inf: nothing; None after `coarser`
    # (h, w, 4) float32 of what is glossy: like radiance, without what its lobe reflects (view_dependent.py); None: of all else
    own: np.ndarray | None = None

    @property
    def mirrors(self) -> bool:
        """Whether a ray goes on from here as from a mirror; normals alone may also be there to be shaded."""
        return self.normals is not None and self.own is None

    def coarser(self, size: tuple[int, int]) -> "Texels":
        """Means over blocks, at most `size` (height, width)."""
        if self.radiance.shape[:2] == tuple(size):
            return self
        radiance, normals, own = (
            None if image is None else _coarser(image, size) for image in (self.radiance, self.normals, self.own)
        )
        return Texels(radiance, normals, None, own)


@dataclass(eq=False)
class Part:
    """The solid texels of one quad, on their way through the bundles."""

    instance: Instance
    size: tuple[int, int]
    rays: Rays  # of all texels
    solid: np.ndarray  # (h * w,) bool
    distance: np.ndarray  # (h * w,)
    start: np.ndarray  # (n, 3) float64, world: just above the surface
    lift: np.ndarray  # (n,) m

    @property
    def direction(self) -> np.ndarray:
        return self.rays.direction[self.solid]


def capture(job: BakeJob, quads: list[Quad]) -> list[Texels]:
    """What fills each of the quads."""
    viewers = job.scene.bounds([job.reflector])
    most = int(job.settings["texels"])
    by_name = {i.name: i for i in (*job.scene.instances, *job.scene.lamps)}
    keys = [(quad, most, is_on(job), is_own(job, quad)) for quad in quads]
    found = [job.shared.get(key) if quad.shared else None for quad, key in zip(quads, keys, strict=True)]
    missing = [i for i, texels in enumerate(found) if texels is None]
    parts = [
        part(job, quads[i], by_name[quads[i].instance], most if quads[i].shared else quads[i].enough(most, viewers))
        for i in missing
    ]
    hits = _trace_all(job, parts)
    for i, texels in zip(missing, _filled(job, [quads[i] for i in missing], parts, hits, viewers), strict=True):
        found[i] = texels
    job.shared.update({key: texels for quad, key, texels in zip(quads, keys, found, strict=True) if quad.shared})
    return [texels.coarser(quad.size(quad.enough(most, viewers))) for quad, texels in zip(quads, found, strict=True)]


def is_own(job: BakeJob, quad: Quad) -> bool:
    """Whether it is a flat part of the reflector itself, which stands as lit."""
    return quad.shared and quad.instance == job.reflector.name


def part(job: BakeJob, quad: Quad, instance: Instance, texels: int) -> Part:
    """Where the solid ones of `texels` (along the longer side) lie on the instance's surface."""
    rays = quad.rays(texels)
    distance = job.intersect(instance, rays)
    solid = np.isfinite(distance) & (distance <= quad.reach)
    # Computed in float64: float32 positions far from the origin would lose the lift.
    surface = rays.origin.astype(np.float64) + rays.direction * np.where(solid, distance, 0.0)[:, None]
    least = LIFT * max(job.scene.diagonal(), 1e-30)
    if instance.name in {lamp.name for lamp in job.scene.lamps}:
        low, high = job.scene.bounds([instance])
        least = max(least, LAMP_LIFT * float(np.linalg.norm(high - low)))
    lift = np.maximum(least, LIFT_ROUNDING * np.abs(surface).max(-1, keepdims=True))
    start = surface - rays.direction * lift
    return Part(instance, quad.size(texels), rays, solid, distance, start[solid], lift[solid, 0])


def _trace_all(job: BakeJob, parts: list[Part]) -> list[Hits]:
    """What each part's texels show. Other duplis of the reflector's object would be hidden with it."""
    siblings = [p for p in parts if p.instance.object_name == job.reflector.object_name]
    others = [p for p in parts if p.instance.object_name != job.reflector.object_name]
    found = {}
    for group, hide in ((others, (job.reflector.object_name,)), (siblings, ())):
        rays = [Rays(p.start.astype(np.float32), p.direction.astype(np.float32)) for p in group]
        glossy = is_on(job) and any(glossy_of(job.scene, p.instance) for p in group)
        found.update(zip(map(id, group), _trace(job, rays, hide, glossy), strict=True))
    return [found[id(p)] for p in parts]


def _trace(job: BakeJob, bundles: list[Rays], hide: tuple[str, ...], glossy: bool = False) -> list[Hits]:
    """Hits of each bundle, traced as one; glossy: with what glossy lobes reflect apart."""
    ends = np.cumsum([0, *map(len, bundles)])
    if not ends[-1]:
        return [Hits(*(np.zeros((0, *n)) for n in ((3,), (3,), (3,), (), ()))) for _ in bundles]
    joined = Rays(np.concatenate([b.origin for b in bundles]), np.concatenate([b.direction for b in bundles]))
    hits = job.trace(joined, hide=hide, samples=int(job.settings["samples"]), **({"glossy": True} if glossy else {}))
    return [hits.part(slice(a, b)) for a, b in zip(ends, ends[1:], strict=False)]


def _filled(job: BakeJob, quads: list[Quad], parts: list[Part], hits: list[Hits], viewers) -> list[Texels]:
    corners = corners_of(viewers)
    lit = [is_own(job, quad) for quad in quads]
    mirrors = [None if own else mirror_of(job.scene, part.instance) for own, part in zip(lit, parts, strict=True)]
    glossy = [glossy_of(job.scene, part.instance) if is_on(job) and not own else None for own, part in zip(lit, parts, strict=True)]
    shares = [
        mirror and billboard_mirrors.share_of(job, part.instance, mirror, part.rays, part.distance)[part.solid]
        for part, mirror in zip(parts, mirrors, strict=True)
    ]
    rays = [
        billboard_mirrors.mirrored(h, part.direction, part.lift) if share is not None and share.any() else None
        for part, h, share in zip(parts, hits, shares, strict=True)
    ]
    # Nothing is hidden: the captured mirrors showed the reflector too.
    arriving = iter(_trace(job, [r for r, _ in filter(None, rays)], ()))
    out = []
    for quad, part, h, mirror, lobe, share, bent in zip(quads, parts, hits, mirrors, glossy, shares, rays, strict=True):
        normals = own = None
        shown = h.radiance
        if bent is not None:
            normals = _image(part, np.c_[h.normal * share[:, None], quad.height(h.position)])
            shown = billboard_mirrors.own_light(mirror.material, shown, bent[1], share, next(arriving).radiance)
        elif lobe is not None:
            share = billboard_mirrors.share_of(job, part.instance, lobe, part.rays, part.distance)[part.solid]
            normals = _image(part, np.c_[h.normal * share[:, None], quad.height(h.position)])
            own = _image(part, np.c_[matte(lobe.material, h, part.direction, share), np.ones(len(shown))])
        radiance = _image(part, np.c_[shown, np.ones(len(shown))])
        seen = np.zeros(len(part.solid), bool)
        if quad.shared:
            seen[part.solid] = ~covered(job, quad, part.start)
        else:
            seen[part.solid] = _faces_any(h.position, h.normal, corners)
        for image in (radiance, own) if own is not None else (radiance,):
            fill_unseen(image, seen.reshape(part.size))
        out.append(Texels(radiance, normals, part.distance.reshape(part.size), own))
    return out


def _image(part: Part, values: np.ndarray) -> np.ndarray:
    """(h, w, 4) float32 of the solid texels' values."""
    out = np.zeros((*part.size, 4), np.float32)
    out.reshape(-1, 4)[part.solid] = values
    return out


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
