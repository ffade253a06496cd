"""`billboards`: objects near the reflector stand as textured quads [popescu-2006 section 3, diffuse billboards].

Problem. The environment map shows near objects at the wrong place and without parallax.
Idea. Every other object becomes a quad with an alpha contour; a reflected ray takes the nearest quad it meets and the
environment map, captured without these objects, where it meets none (3.1, steps 2 to 4).
  * What is flat (a floor, a picture, a wall of the room) lies on its own fitted plane; it is captured once and serves
    all reflectors (section 3, second paragraph).
  * What has volume stands through its centroid B, perpendicular to the line from B to the reflector's centroid, seen
    by a camera with a field of view of 10 degrees: one quad for each reflector.
A ground that goes on into the distance is no quad but a box over the environment map (ground_box.py, 3.2).
Where we depart. No limit on how many (the paper: 17): quads are rows of a table that a loop fetches. Texels are not
rendered by a camera but traced from just above the object's own surface, so that all objects of a bake are one bundle
and nothing in front of an object can stand in its way. The texture's level follows the ray's footprint.
Limits. A volume is flat once reflected; objects that touch the reflector need depth maps. Meshes that enclose the
reflector (a room) lend their large flat parts only; the rest of them stays in the environment map.
"""

import numpy as np

from .. import billboard_kernel, ground_box, ground_fit, ground_map, spaces
from ..asset import Asset, half_with_scale
from ..billboard_atlas import pack, table_rows
from ..billboard_capture import capture
from ..billboard_fit import Quad, flat_quads, volume_quad
from ..flat_parts import contains
from ..kernel import Hit
from ..snapshot import Instance, corners_of
from . import environment
from ..job import BakeJob

NAME = "billboards"
LABEL = "Billboards"
REQUIRES = ()
DEFAULTS = {
    "resolution": 128, "samples": 16, "texels": 128, "sky_error": environment.DEFAULTS["sky_error"], **ground_fit.DEFAULTS
}  # fmt: skip

def bake(job: BakeJob) -> Asset:
    """Quads for every other object, their texels in one bundle, and the environment without those objects."""
    quads, hidden = quads_for(job)
    ground = ground_fit.find(job, quads, hidden)
    if ground is not None:
        quads, hidden = ground_map.in_the_map(job, ground, quads, hidden)
    seen_by = job if ground is None else ground_map.mended(job, ground)
    backdrop = environment.capture(seen_by, NAME, hide=(job.reflector.object_name, *hidden))
    captured = capture(job, quads)
    atlas, placed = pack(captured)
    atlas[..., :3], scale = _scaled(atlas[..., :3])
    opaque = [bool(image[..., 3].min() == 1.0) for image in captured]
    rows = table_rows(quads, placed, opaque, backdrop.uniforms["center"])
    return Asset(
        kind=NAME,
        reflector=job.reflector.name,
        images={**backdrop.images, "billboard_tx": atlas.astype(np.float16), "billboard_buf": rows},
        uniforms={**backdrop.uniforms, "billboard_scale": scale, **(ground.uniforms() if ground else {})},
        options={"count": len(quads), "contours": not all(opaque), **(ground.options() if ground else {"ground": False})},
        settings=dict(job.settings),
    )


def _scaled(radiance: np.ndarray) -> tuple[np.ndarray, float]:
    half, scale = half_with_scale(radiance)
    return half.astype(np.float32), scale


def quads_for(job: BakeJob) -> tuple[list[Quad], tuple[str, ...]]:
    """(quads of all objects that the reflector can see, names of the objects that they stand for whole)."""
    low, high = job.scene.bounds([job.reflector])
    center = (low + high) / 2
    corners = corners_of((low, high))
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


def trace(k, asset, ray) -> Hit:
    """The nearest billboard that the ray meets, else the ground's box or the environment."""
    start = k.name("start", ray.origin - asset.uniforms["center"])
    if not asset.options["count"]:  # a scene without other objects has no loop
        radiance, position, status = behind(k, asset, ray, start)
        return Hit(radiance=radiance, position=position, coverage=1.0, status=status)
    k.cite("popescu-2006 3.1 step 2: intersect r with all billboards")
    distance, row, u, v = billboard_kernel.nearest(k, asset, ray, start)

    def billboard():
        k.cite("popescu-2006 3.1 step 4: return the intersection texel")
        radiance = billboard_kernel.radiance(k, asset, ray, distance, row, u, v)
        return radiance, ray.origin + ray.direction * distance, spaces.STATUS_HIT

    radiance, position, status = k.branch(distance < spaces.FAR, billboard, lambda: behind(k, asset, ray, start))
    return Hit(radiance=radiance, position=position, coverage=1.0, status=status)


def behind(k, asset, ray, start):
    """Kernel: (radiance, position, status) of a ray that meets no stand-in. start: vec3, its origin from the centre."""
    if asset.options["ground"]:
        return ground_box.answer(k, asset, ray, start)
    k.cite("popescu-2006 3.1 step 3: if no intersection return EM(r)")
    hit = environment.answer(k, asset, ray.direction, ray.spread, spaces.STATUS_FELL_BACK)
    return hit.radiance, hit.position, spaces.STATUS_FELL_BACK
