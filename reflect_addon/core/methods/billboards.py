"""`billboards`: objects near the reflector stand as textured quads [popescu-2006 section 3].

Problem. The environment map shows near objects at the wrong place and without parallax.
Idea. Every other object becomes a quad with an alpha contour; a reflected ray takes the nearest quad it meets and the
environment map, captured without these objects, where it meets none (3.1, steps 2 to 4).
  * What is flat (a floor, a picture, a wall of the room) lies on its own fitted plane; it is captured once and serves
    all reflectors (section 3, second paragraph).
  * What has volume stands through its centroid B, perpendicular to the line from B to the reflector's centroid, seen
    by a camera with a field of view of 10 degrees: one quad for each reflector.
  * What mirrors has texels with normals, for second-order reflections (second_order.py); what is glossy, too, where the
    setting view_dependent asks for shading at the hit (view_dependent.py).
Rays that come off mirrors meet what the reflector cannot see: what faces one of them has quads too, and so has a reflector that is flat
all over, as lit (its own rays start on these quads and never meet them). Without them such rays would look through to the empty map.
A ground that goes on into the distance is no quad but a box over the environment map (ground_box.py, 3.2).
Where we depart. No limit on how many (the paper: 17): quads are rows of a table that a loop fetches. Texels are not
rendered by a camera but traced from just above the object's own surface, so that all objects of a bake are one bundle
and nothing in front of an object can stand in its way. The texture's level follows the ray's footprint.
When something moves, its quads do (remake.py, billboard_follow.py), where `live` had the surfaces baked as well.
Limits. A volume is flat once reflected; objects that touch the reflector need depth maps. Meshes that enclose the
reflector (a room) lend their large flat parts only; the rest of them stays in the environment map.
"""

from dataclasses import replace

import numpy as np

from .. import billboard_kernel, ground_box, ground_fit, ground_map, second_order, spaces
from ..asset import Asset, half_with_scale
from ..billboard_atlas import pack, table_rows, write_mirror
from ..billboard_capture import Texels, capture
from ..billboard_fit import Quad, flat_quads, volume_quad
from ..billboard_mirrors import mirror_rows, stand_off
from ..clear_center import clear_center
from ..flat_parts import contains
from ..glossy import glossy_of, is_on
from ..job import BakeJob
from ..kernel import Hit
from ..mirrors import mirror_of
from ..outlines import of_table as outlines  # noqa: F401  the method's own (methods/__init__.py)
from ..remake import parts_of
from ..row_search import Among, spans
from ..scene_items import MIRRORS, Items, mirrors, radiance
from ..snapshot import Instance, SceneSnapshot, corners_of
from ..view_dependent import arranged, images_of
from . import environment

NAME = "billboards"
LABEL = "Billboards"
REQUIRES = ()
TOGETHER, BAKE_EFFORT = "flat", 0.5
EFFORT = 3.0
DEFAULTS = {
    "resolution": 128, "samples": 16, "texels": 128, "sky_error": environment.DEFAULTS["sky_error"], "live": False,
    "view_dependent": False,  # highlights of glossy things where the reflected ray sees them
    "without": (),  # names of objects that are left out
    **ground_fit.DEFAULTS,
}  # fmt: skip



def bake(job: BakeJob) -> Asset:
    """Quads for every other object, their texels in one bundle, and the environment without those objects."""
    quads, backdrop = with_backdrop(job, NAME)
    captured = capture(job, quads)
    # What is only lit comes first: the tertiary ray looks among these rows alone.
    glossy = arranged(job, quads, captured, backdrop)
    quads, captured = [quads[i] for i in glossy.order], glossy.captured
    images = [texels.radiance for texels in captured]
    atlas, placed = pack(images)
    half, scale = half_with_scale(atlas[..., :3])
    atlas[..., :3] = half
    opaque = [bool(image[..., 3].min() == 1.0) for image in images]
    mirrors, normal_images, options = mirror_rows(job, quads, captured)
    center = backdrop.uniforms["center"]
    rows = table_rows(quads, placed, opaque, center)
    first = len(quads) - len(mirrors)
    for row, quad, (material, where) in zip(rows[first:], quads[first:], mirrors, strict=False):
        write_mirror(row, material, where, quad, center)
    stand_off(job, rows, quads, captured)
    shading_images, shading_uniforms, shading_options = images_of(job, glossy, quads, captured, scale, center)
    return Asset(
        kind=NAME,
        reflector=job.reflector.name,
        images={**backdrop.images, "billboard_tx": atlas.astype(np.float16), "billboard_buf": rows, **normal_images, **shading_images},
        uniforms={**backdrop.uniforms, "billboard_scale": scale, **shading_uniforms},
        options={
            **backdrop.options,
            "count": sum(glossy.counts[:3]),
            "mirrors": glossy.counts[3],
            # A volume that moves may get a contour that it had not.
            "contours": not all(q.shared and o for q, o in zip(quads, opaque, strict=True)),
            **options,
            **shading_options,
        },
        settings=dict(job.settings),
        parts=parts_of(job.scene, job.reflector, [(q.instance, kind_of(q, t)) for q, t in zip(quads, captured, strict=True)]),
        light_hash=job.scene.light_hash,
    )


def with_backdrop(job: BakeJob, kind: str) -> tuple[list[Quad], Asset]:
    """(quads of all that the reflector can see, the environment map without it, and the ground that it holds)."""
    quads, hidden = quads_for(job)
    center = clear_center(job, hidden)
    ground = ground_fit.find(job, quads, hidden, center)
    seen_by = job
    if ground is not None:
        quads, hidden = ground_map.in_the_map(job, ground, quads, hidden)
        seen_by = ground_map.mended(job, ground)
    backdrop = environment.capture(seen_by, kind, (job.reflector.object_name, *hidden), center)
    quads = [*quads, *_own(job)]
    if ground is None:
        return quads, replace(backdrop, options={"ground": False})
    return quads, replace(backdrop, uniforms={**backdrop.uniforms, **ground.uniforms()}, options=ground.options())


def kind_of(quad: Quad, texels: Texels) -> str:
    """remake.py's word for what a quad is."""
    if texels.normals is not None:
        return ("flat_" if quad.shared else "") + ("mirror" if texels.mirrors else "glossy")
    return "flat" if quad.shared else "volume"


def quads_for(job: BakeJob) -> tuple[list[Quad], tuple[str, ...]]:
    """(quads of all objects that the reflector can see, names of the objects that they stand for whole)."""
    low, high = job.scene.bounds([job.reflector])
    center = (low + high) / 2
    viewers = [corners_of((low, high)), *(corners_of(job.scene.bounds([other])) for other in _reflective(job))]
    quads: list[Quad] = []
    whole: dict[str, bool] = {}
    for instance in (*job.scene.instances, *job.scene.lamps):
        if instance.name == job.reflector.name or not instance.visible_glossy:
            continue
        if instance.object_name in job.settings.get("without", ()):
            whole[instance.object_name] = True
            continue
        flat, complete = _flat(job, instance, contains(job.scene, instance, center))
        quads += [q for q in flat if any(map(q.faces, viewers))]
        if not complete and not _encloses(job, instance, center):
            # The flat parts of a thing that stands as one quad would be seen twice.
            quads = [q for q in quads if q.instance != instance.name]
            quads.append(volume_quad(job.scene, instance, center))
            complete = True
        # Every dupli of an object is hidden with it, so all of them must have quads.
        leaves = complete and not _is_mirror_room(job, instance, center)
        whole[instance.object_name] = whole.get(instance.object_name, True) and leaves
    whole.pop(job.reflector.object_name, None)  # other duplis of it are hidden with it as they are
    return quads, tuple(name for name, complete in whole.items() if complete)


def _reflective(job: BakeJob) -> list[Instance]:
    """The other things that rays go on from."""
    key = ("reflective", is_on(job))
    if key not in job.shared:
        glossy = glossy_of if is_on(job) else lambda *_: None
        job.shared[key] = [i for i in job.scene.instances if i.visible_glossy and (mirror_of(job.scene, i) or glossy(job.scene, i))]
    return [i for i in job.shared[key] if i.name != job.reflector.name]


def _own(job: BakeJob) -> list[Quad]:
    """Quads of a reflector that is flat all over, where rays come back to it; none of a clear one, which they are to pass."""
    if not _reflective(job) or any(job.scene.materials[m].refracts for m in job.reflector.materials):
        return []
    flat, complete = _flat(job, job.reflector, False)
    return flat if complete else []


def _flat(job: BakeJob, instance: Instance, inside: bool) -> tuple[list[Quad], bool]:
    """flat_quads of an instance, found once for all reflectors of the bake."""
    key = ("flat", instance.name, inside)
    if key not in job.shared:
        job.shared[key] = flat_quads(job.scene, instance, inside)
    return job.shared[key]


def _encloses(job: BakeJob, instance: Instance, point: np.ndarray) -> bool:
    """Whether the instance is around the reflector; what stands inside a mirror ring is not, though it holds its centre."""
    low, high = job.scene.bounds([instance])
    low_own, high_own = job.scene.bounds([job.reflector])
    larger = np.linalg.norm(high - low) > np.linalg.norm(high_own - low_own)
    return bool(larger and np.all(low < point) and np.all(point < high))


def _is_mirror_room(job: BakeJob, instance: Instance, point: np.ndarray) -> bool:
    """Whether the instance is a room of mirrors around the point. It stays in the environment map: mirrors that are seen in
    mirrors look there, and without the room they would see through its walls."""
    mirror = mirror_of(job.scene, instance) if _encloses(job, instance, point) else None
    return mirror is not None and mirror.whole


def inputs(scene: SceneSnapshot, reflectors: tuple[Instance, ...]) -> Items:
    """Light and what it falls on, and which things are mirrors to others: a mark says that, too."""
    found = radiance(scene)
    return found and {**found, MIRRORS: mirrors(scene)}


def trace(k, asset, ray) -> Hit:
    """The nearest billboard that the ray meets, by way of a mirror if it is one, else the ground's box or the environment."""
    return second_order.answer(k, asset, ray, nearest, behind)


def nearest(k, asset, ray, start, among: Among):
    """second_order's: the nearest quad."""
    return billboard_kernel.nearest(k, asset, ray, start, spans(asset, among)[0])


def behind(k, asset, ray, start):
    """Kernel: (radiance, position, status) of a ray that meets no stand-in. start: vec3, its origin from the centre."""
    if asset.options["ground"]:
        return ground_box.answer(k, asset, ray, start)
    hit = environment.answer(k, asset, ray.direction, ray.spread, spaces.STATUS_FELL_BACK)
    return hit.radiance, hit.position, spaces.STATUS_FELL_BACK
