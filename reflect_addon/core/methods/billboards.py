"""`billboards`: objects near the reflector stand as textured quads [popescu-2006 section 3, diffuse billboards].

Problem. The environment map shows near objects at the wrong place and without parallax.
Idea. Every other object becomes a quad with an alpha contour; a reflected ray takes the nearest quad it meets and the
environment map, captured without these objects, where it meets none (3.1, steps 2 to 4).
  * What is flat (a floor, a picture, a wall of the room) lies on its own fitted plane; it is captured once and serves
    all reflectors (section 3, second paragraph).
  * What has volume stands through its centroid B, perpendicular to the line from B to the reflector's centroid, seen
    by a camera with a field of view of 10 degrees: one quad for each reflector.
Where we depart. No limit on how many (the paper: 17): quads are rows of a table that a loop fetches. Texels are not
rendered by a camera but traced from just above the object's own surface, so that all objects of a bake are one bundle
and nothing in front of an object can stand in its way. The texture's level follows the ray's footprint.
Limits. A volume is flat once reflected; objects that touch the reflector need depth maps. Meshes that enclose the
reflector (a room) lend their large flat parts only; the rest of them stays in the environment map.
"""

import numpy as np

from .. import spaces
from ..asset import Asset, half_with_scale
from ..billboard_atlas import ROW, Placed, pack, table_rows
from ..billboard_fit import Quad, contains, flat_quads, is_closed, volume_quad
from ..cubemap import blend_levels
from ..kernel import Hit
from ..rays import Rays
from ..snapshot import Instance
from . import environment
from .job import BakeJob

NAME = "billboards"
LABEL = "Billboards"
REQUIRES = ()
DEFAULTS = {"resolution": 128, "samples": 16, "texels": 128, "sky_error": environment.DEFAULTS["sky_error"]}

# Alpha above which a texel is the object: half, so that bilinear contours lie where the object's edge lies.
SOLID = 0.5
# Below it the ratio of premultiplied radiance and alpha is no colour.
LEAST_ALPHA = 1e-3
# Rays start this share of the scene's diagonal above the surface: below any visible gap ...
LIFT = 2e-5
# ... or this share of their largest coordinate, above float32's rounding: a small scene may lie far from the origin.
LIFT_ROUNDING = 8 * 2.0**-23

# A surface closer than this share of an object's size to its inside is covered by it.
COVERED = 1e-3
# Of a ray with one mesh: an object with more walls than this is not one that stands on a floor.
MOST_CROSSINGS = 32


def bake(job: BakeJob) -> Asset:
    """Quads for every other object, their texels in one bundle, and the environment without those objects."""
    quads, hidden = quads_for(job)
    backdrop = environment.capture(job, NAME, hide=(job.reflector.object_name, *hidden))
    captured = _capture(job, quads)
    atlas, placed = pack(captured)
    atlas[..., :3], scale = _scaled(atlas[..., :3])
    opaque = [bool(image[..., 3].min() == 1.0) for image in captured]
    rows = table_rows(quads, placed, opaque, backdrop.uniforms["center"])
    return Asset(
        kind=NAME,
        reflector=job.reflector.name,
        images={**backdrop.images, "billboard_tx": atlas.astype(np.float16), "billboard_buf": rows},
        uniforms={**backdrop.uniforms, "billboard_scale": scale},
        options={"count": len(quads), "contours": not all(opaque)},
        settings=dict(job.settings),
    )


def _scaled(radiance: np.ndarray) -> tuple[np.ndarray, float]:
    half, scale = half_with_scale(radiance)
    return half.astype(np.float32), scale


def quads_for(job: BakeJob) -> tuple[list[Quad], tuple[str, ...]]:
    """(quads of all objects that the reflector can see, names of the objects that they stand for whole)."""
    low, high = job.scene.bounds([job.reflector])
    center = (low + high) / 2
    corners = _corners((low, high))
    quads: list[Quad] = []
    whole: dict[str, bool] = {}
    for instance in (*job.scene.instances, *job.scene.lamps):
        if instance.object_name == job.reflector.object_name or not instance.visible_glossy:
            continue
        flat, complete = _flat(job, instance, contains(job.scene, instance, center))
        quads += [q for q in flat if q.faces(corners)]
        if not complete and not _encloses(job, instance, center):
            # The flat parts of a thing that stands as one quad would be seen twice.
            quads = [q for q in quads if q.instance != instance.name]
            quads.append(volume_quad(job.scene, instance, center))
            complete = True
        # Every dupli of an object is hidden with it, so all of them must have quads.
        whole[instance.object_name] = whole.get(instance.object_name, True) and complete
    return quads, tuple(name for name, complete in whole.items() if complete)


def _flat(job: BakeJob, instance: Instance, inside: bool) -> tuple[list[Quad], bool]:
    """flat_quads of an instance, found once for all reflectors of the bake."""
    key = ("flat", instance.name, inside)
    if key not in job.shared:
        job.shared[key] = flat_quads(job.scene, instance, inside)
    return job.shared[key]


def _encloses(job: BakeJob, instance: Instance, point: np.ndarray) -> bool:
    low, high = job.scene.bounds([instance])
    return bool(np.all(low < point) and np.all(point < high))


def _capture(job: BakeJob, quads: list[Quad]) -> list[np.ndarray]:
    """Per quad (h, w, 4) float32: premultiplied radiance and alpha, row 0 at its low v."""
    texels = int(job.settings["texels"])
    least = LIFT * max(job.scene.diagonal(), 1e-30)
    by_name = {i.name: i for i in (*job.scene.instances, *job.scene.lamps)}
    images = [job.shared.get((q, texels)) for q in quads]
    starts, directions, owners = [], [], []
    for index, quad in enumerate(quads):
        if images[index] is not None:
            continue
        rays = quad.rays(texels)
        distance = job.intersect(by_name[quad.instance], rays)
        solid = np.isfinite(distance) & (distance <= quad.reach)
        # Computed in float64: float32 positions far from the origin would lose the lift.
        surface = rays.origin.astype(np.float64) + rays.direction * np.where(solid, distance, 0.0)[:, None]
        lift = np.maximum(least, LIFT_ROUNDING * np.abs(surface).max(-1, keepdims=True))
        start = surface - rays.direction * lift
        images[index] = np.zeros((*quad.size(texels), 4), np.float32)
        starts.append(start[solid])
        directions.append(rays.direction[solid])
        owners.append((index, solid))
    if sum(len(s) for s in starts):
        bundle = Rays(np.concatenate(starts).astype(np.float32), np.concatenate(directions).astype(np.float32))
        hits = job.trace(bundle, hide=(job.reflector.object_name,), samples=int(job.settings["samples"]))
        at = 0
        corners = _corners(job.scene.bounds([job.reflector]))
        for (index, solid), start in zip(owners, starts, strict=True):
            rows = slice(at, at + len(start))
            at += len(start)
            image = images[index].reshape(-1, 4)
            image[solid, :3] = hits.radiance[rows]
            image[solid, 3] = 1.0
            seen = np.zeros(len(image), bool)
            if quads[index].shared:
                seen[solid] = ~_covered(job, quads[index], start)
            else:
                seen[solid] = _faces_any(hits.position[rows], hits.normal[rows], corners)
            fill_unseen(images[index], seen.reshape(images[index].shape[:2]))
    for quad, image in zip(quads, images, strict=True):
        if quad.shared:
            job.shared[(quad, texels)] = image
    return images


def _corners(bounds: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
    """(8, 3) of a box given by its low and high corner."""
    return np.array([[bounds[i >> a & 1][a] for a in range(3)] for i in range(8)])


def _faces_any(points: np.ndarray, normals: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """(N,) bool: whether the surface at a point can be seen from any of the corners."""
    height = np.einsum("nx,cx->nc", normals, corners) - np.einsum("nx,nx->n", normals, points)[:, None]
    return (height > 0).any(1)


def _covered(job: BakeJob, quad: Quad, points: np.ndarray) -> np.ndarray:
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


def trace(k, asset, ray) -> Hit:
    """The nearest billboard that the ray meets, else the environment."""
    if not asset.options["count"]:  # a scene without other objects has no loop
        return environment.answer(k, asset, ray.direction, ray.spread, spaces.STATUS_FELL_BACK)
    start = k.name("start", ray.origin - asset.uniforms["center"])
    k.cite("popescu-2006 3.1 step 2: intersect r with all billboards")
    distance, row, u, v = k.loop(
        asset.options["count"],
        (spaces.FAR, 0.0, 0.0, 0.0),
        lambda i, distance, row, u, v: (_meet(k, asset, ray, start, i, (distance, row, u, v)), None),
    )

    def billboard():
        k.cite("popescu-2006 3.1 step 4: return the intersection texel")
        place, detail = _fetch(k, asset, "place", row), _fetch(k, asset, "detail", row)
        level = _level(k, ray, distance, detail)
        texel = blend_levels(k, level, detail.x, lambda i: _sample(k, asset, place, i, u, v))
        radiance = texel.xyz * (asset.uniforms["billboard_scale"] / k.max(texel.w, LEAST_ALPHA))
        return k.name("billboard_radiance", radiance), ray.origin + ray.direction * distance, spaces.STATUS_HIT

    def backdrop():
        k.cite("popescu-2006 3.1 step 3: if no intersection return EM(r)")
        hit = environment.answer(k, asset, ray.direction, ray.spread, spaces.STATUS_FELL_BACK)
        return hit.radiance, hit.position, spaces.STATUS_FELL_BACK

    radiance, position, status = k.branch(distance < spaces.FAR, billboard, backdrop)
    return Hit(radiance=radiance, position=position, coverage=1.0, status=status)


def _meet(k, asset, ray, start, i, before):
    """One step of the loop: (distance, row, u, v) of the nearest billboard so far, this one being row i.

    One fetch for a quad that cannot be met, three for one that is met; more only at a contour.
    """
    distance = before[0]
    plane = k.name("plane", _fetch(k, asset, "plane", i))
    facing = k.name("facing", k.dot(ray.direction, plane.xyz))
    # One-sided: a ray from behind, or along the plane, does not see it.
    t = k.name("t", (k.dot(start, plane.xyz) - plane.w) / k.max(-facing, 1e-20))

    def in_plane():
        axis_u, axis_v = _fetch(k, asset, "u", i), _fetch(k, asset, "v", i)
        p = k.name("in_plane", start + ray.direction * t)
        u, v = k.name("u", k.dot(p, axis_u.xyz) + axis_u.w), k.name("v", k.dot(p, axis_v.xyz) + axis_v.w)
        inside = (k.abs(u) <= 1.0) & (k.abs(v) <= 1.0)
        met = (t, i, u, v)
        if not asset.options["contours"]:
            return tuple(k.select(inside, new, old) for new, old in zip(met, before, strict=True))
        return k.branch(inside, lambda: _within_contour(k, asset, ray, i, met, before), lambda: before)

    return k.branch((facing < 0.0) & (t > 0.0) & (t < distance), in_plane, lambda: before)


def _within_contour(k, asset, ray, i, met, before):
    """`met` where the billboard's alpha says that the object is there, else `before`."""
    t, _, u, v = met
    detail = k.name("detail", _fetch(k, asset, "detail", i))

    def alpha():
        place = _fetch(k, asset, "place", i)
        # The finer of the two levels that its colour is blended from.
        level = k.floor(_level(k, ray, t, detail))
        return (_sample(k, asset, place, level, u, v).w,)

    solid = k.branch(detail.z > 0.5, lambda: (1.0,), alpha)[0] >= SOLID
    return tuple(k.select(solid, new, old) for new, old in zip(met, before, strict=True))


def _fetch(k, asset, field: str, row):
    return k.fetch(asset.images["billboard_buf"], float(ROW[field]), row)


def _level(k, ray, distance, detail):
    """Level whose texels are as wide as the ray's footprint."""
    footprint = (ray.width + ray.spread * distance) * detail.y
    return k.name("level", k.min(k.log2(k.max(footprint, 1.0)), detail.x))


def _sample(k, asset, place, level, u, v):
    """Bilinear texel of one level of one billboard; see billboard_atlas for where levels lie."""
    image = asset.images["billboard_tx"]
    width, height = place.z, place.w
    across, up = (u * 0.5 + 0.5) * width, (v * 0.5 + 0.5) * height
    if level is None:
        return k.sample(image, place.x + across, place.y + up)
    scale = k.name("level_scale", k.exp2(-level))
    above = level >= 1.0
    x = place.x + k.select(above, width + 2.0, 0.0)
    y = place.y + k.select(above, height * (1.0 - 2.0 * scale) + 2.0 * (level - 1.0), 0.0)
    return k.sample(image, x + across * scale, y + up * scale)
