"""`light_field`: six slabs of views around a cell show the scene from wherever the reflector stands in it [yu-2005].

Problem. An environment map has no parallax: what is near is at the wrong place, and nothing moves when the reflector does.
Idea. The reflector stays in a box, the cell; six light-field slabs around it (core/light_field.py) hold every ray that leaves
it. A reflected ray is looked up in the four views around it and blended (core/light_field_kernel.py), at a price that does not
depend on the scene; the reflector moves in its cell without a new bake.
  * With `depth` every view also stores how far it sees, and each ray is looked up in each view where that view sees what the
    ray meets: 8 x 8 views with depths show more than 32 x 32 without.
    (A slab's focal plane is then no more than the first guess.)
  * Without, all views of a slab share one focal plane, found from the views themselves (core/light_field_focus.py).
  * A camera in the cell (`cameras`) sees its background from the same slabs: its own rays take the reflected ones' place.
Contact. The paper has none: near things seen through four views float. Where depth maps or billboards of the reflector are
baked as well (COMPANIONS), they answer rays that end within the reflector's own size, and fade into the slabs beyond.
Where we depart. Per-view depth; the camera planes (core/light_field.py); only texels that some reflected ray can reach are
traced, only slabs that one reaches are stored (core/light_field_reach.py); after a change in the scene only the views that saw
it are traced again (core/light_field_change.py).
Limits. What is in the cell beside the reflector is seen from the cell's middle outward. Rough reflectors send several rays
(core/lobe_rays.py): views have no coarser levels.
"""

from dataclasses import replace

import numpy as np

from .. import spaces
from ..asset import Asset
from ..errors import ReflectError
from ..job import BakeJob
from ..kernel import Hit
from ..light_field import SLABS, Cell, cell_of
from ..light_field_change import changed_boxes, seen_parts, views_that_saw
from ..light_field_focus import FEW, PROBES, focus
from ..light_field_kernel import answer
from ..light_field_reach import Reach, reach_of
from ..light_field_refocus import distance_of, focused  # noqa: F401  the method's own (methods/__init__.py)
from ..light_field_slab import bake_slab, filled
from ..light_field_stored import compressed, finish_slab, finished_slab, slab_before
from ..light_field_trace import SlabTracer
from ..outlines import Outlines, of_box, of_rectangle
from ..remake import REFLECTOR, SAME_PLACE, parts_of
from ..scene_items import PAINT, PLACE, RAYS, Items, radiance, without
from ..settings import Setting
from ..snapshot import Instance, SceneSnapshot
from . import billboards, depth_maps

NAME = "light_field"
LABEL = "Light Field"
REQUIRES = ()
BAKE_EFFORT = 2.0
EFFORT = 7.0
GOES_ON = True
COMPANIONS = ("depth_maps", "billboards")
# Hits of the companions count whole up to this share of the reflector's size, and not at all from its whole on.
CONTACT = 0.5
SETTINGS = {
    "views": Setting("Views", "Views along a side of each of the six slabs. Twice as many need four times the memory and bake time",
                     low=2, high=64, soft_high=32),
    "view_texels": Setting("View Texels", "Texels along a side of each view. Twice as many need four times the memory and bake time",
                           low=16, high=512, power_of_two=True),
    "depth": Setting("Depth per View", "Each view also stores how far it sees, so that few views show sharply what is near and what is "
                     "far. Without it all are focused on one distance"),
    "whole_path": Setting("Whole Path", "The cell holds the reflector's way over all frames of the scene, so that it moves without "
                          "another bake. Without it, its place at this frame alone"),
    "room": Setting("Room", "How much wider the cell is than what it holds, on every side, as a share of its size: room for the "
                    "reflector to be moved about in", high=10.0, soft_high=1.0),
    "cameras": Setting("Camera in Cell", "The cell also holds the scene's camera (with Whole Path, its way over all frames), so that "
                       "the background can be shown from the light field, too"),
    "contact": Setting("Contact", "What is near the reflector is shown by its depth maps, or else its billboards, where these are baked too. "
                       "Costs what they cost", drawn=True),
    "compressed": Setting("Compressed", "Radiance in 4 bits a ray instead of 48, as the paper stores it: a few percent less exact. "
                          "Depths stay half floats"),
    "shared": Setting("One Cell for All", "One cell around all reflectors that are baked together, instead of one for each. They do not "
                      "see each other"),
}  # fmt: skip
DEFAULTS = {
    "views": 8, "view_texels": 128, "samples": 4, "depth": True, "whole_path": True, "room": 0.0, "cameras": False, "contact": True,
    "compressed": False, "shared": False,
}  # fmt: skip


def bake(job: BakeJob) -> Asset:
    """The slabs that the reflectors' rays reach, traced where they can be looked up; slabs that an interrupted bake finished,
    and views of an earlier bake that saw nothing of what changed, are taken as they are."""
    cell, reach = plan(job)
    boxes = changed_boxes(job, cell, job.earlier)
    finished = {face: finished_slab(job, face) for face in cell.slabs}
    before = {face: slab_before(job.earlier, cell, face) for face in cell.slabs} if boxes is not None else {}
    wanted = {face: reach.of(face) for face, slab in finished.items() if slab is None}
    for face in wanted.keys() & before.keys():
        wanted[face] = views_that_saw(cell, face, boxes, before[face].traced(), wanted[face])
    traced = SlabTracer(job, cell, wanted)
    atlas, scale, planes, made = np.zeros((*cell.shape(), 4), np.float16), 1.0, np.zeros(SLABS), np.zeros(2, int)
    for face in cell.slabs:
        slab = finished.pop(face)
        if slab is None:
            slab, count = bake_slab(cell, face, wanted[face], traced, before.get(face))
            made += count
            finish_slab(job, face, slab)
        slab, side, (x, y) = filled(slab, cell), cell.slab_side(), cell.origin(face)
        planes[face] = focus(cell, face, slab, FEW if job.settings["depth"] else PROBES)
        if slab.scale > scale:
            atlas[..., :3] *= np.float16(scale / slab.scale)
            scale = slab.scale
        atlas[y : y + side, x : x + side] = slab.texels
        atlas[y : y + side, x : x + side, :3] *= np.float16(slab.scale / scale)
    used = atlas[..., 3] >= 0
    views = used.reshape(-1, cell.texels, used.shape[1] // cell.texels, cell.texels).any((1, 3)).sum()
    reflectors = job.reflectors()
    images, code = compressed(cell, atlas, bool(job.settings["depth"])) if job.settings["compressed"] else ({"light_field_tx": atlas}, {})
    return Asset(
        kind=NAME,
        reflector="" if job.together else job.reflector.name,
        images=images,
        uniforms={
            **cell.uniforms(), "light_scale": scale, "focus": tuple(planes[0::2]), "focus_back": tuple(planes[1::2]),
            **code, "contact": float(np.linalg.norm(np.subtract(*job.scene.bounds(reflectors)))),
            **{"rays": float(used.sum()), "views_used": float(views), "views_made": float(made[1]), "rays_made": float(made[0])},
            "everywhere": float(reach.is_everything()),
        },
        options={"views": cell.views, "texels": cell.texels, "columns": cell.columns(), "depth": bool(job.settings["depth"]), "coded": bool(code)},
        settings=dict(job.settings),
        parts=(*(p for r in reflectors for p in parts_of(job.scene, r, ())), *seen_parts(job.scene, reflectors)),
        light_hash=job.scene.light_hash,
    )  # fmt: skip


def plan(job: BakeJob) -> tuple[Cell, Reach]:
    """The cell of the job's reflectors and what of it they reach; nothing is traced for it."""
    asked = job.settings
    ways = [job.way(r) if asked["whole_path"] else job.scene.bounds([r]) for r in job.reflectors()]
    if asked["cameras"]:
        ways.append(_camera_way(job))
    low, high = np.min([w[0] for w in ways], 0), np.max([w[1] for w in ways], 0)
    moves = not np.allclose([low, high], job.scene.bounds(job.reflectors()), atol=1e-4 * np.linalg.norm(high - low))
    room = float(asked["room"]) * (high - low)
    cell = Cell.around(low - room, high + room, int(asked["views"]), int(asked["view_texels"]))
    reach = reach_of(job, moves or asked["room"] > 0 or bool(asked["cameras"]))
    return Cell(cell.center, cell.half, cell.views, cell.texels, slabs=reach.slabs()), reach


def _camera_way(job: BakeJob) -> tuple[np.ndarray, np.ndarray]:
    way = job.camera_way() if job.settings["whole_path"] else job.camera_now()
    if way is None:
        raise ReflectError(
            f"The scene {job.scene.scene_name} has no camera for a cell that holds the camera.", "Add one, or leave Camera in Cell off."
        )
    return way


def predicted_bytes(job: BakeJob) -> int:
    """Memory of the asset on the GPU, known before the bake."""
    cell = plan(job)[0]
    texels = len(cell.slabs) * cell.slab_side() ** 2
    if not job.settings["compressed"]:
        return cell.shape()[0] * cell.shape()[1] * 8
    return texels // 2 + (cell.shape()[0] * cell.shape()[1] * 2 if job.settings["depth"] else 0)


def inputs(scene: SceneSnapshot, reflectors: tuple[Instance, ...]) -> Items:
    """Light and what it falls on, but not where in its cell the reflector is. Its shape decides which rays were traced."""
    return without(radiance(scene), (PAINT, PLACE, RAYS), {r.name for r in reflectors})


def remark(asset: Asset, scene: SceneSnapshot, reflector: Instance) -> str:
    """A sentence when a reflector, or the camera that the cell was made for, has left its cell, else ""."""
    cell, left = cell_of(asset), "has left its light field's cell: bake again, with Room or Whole Path if it is to move."
    if not cell.contains(scene.world_positions(reflector)).all():
        return f"{reflector.name} {left}"
    if not holds(asset, cell.center[None])[0] and _has_turned(asset, reflector):
        return f"{reflector.name} was turned, and now sees where its light field has no rays: bake again."
    if asset.settings.get("cameras") and scene.camera is not None and not cell.contains(scene.camera):
        return f"The camera {left}"
    return ""


def _has_turned(asset: Asset, reflector: Instance) -> bool:
    own = next((part for part in asset.parts if part.kind == REFLECTOR and part.instance == reflector.name), None)
    return own is not None and not np.allclose(own.matrix()[:3, :3], reflector.world_from_object[:3, :3], atol=SAME_PLACE * np.abs(own.matrix()[:3, :3]).max())


def holds(asset: Asset, points: np.ndarray) -> np.ndarray:
    """(N,) bool: (N, 3) world points from which any ray is answered: those in the cell, when all directions were traced
    ("as long as the viewpoint does not move out of the bounding slabs", yu-2005 section 6)."""
    return cell_of(asset).contains(points) & bool(asset.uniforms.get("everywhere"))


def report(asset: Asset) -> str:
    """What was left out, and what a ray takes, as a sentence."""
    cell, u = cell_of(asset), asset.uniforms
    texels = SLABS * cell.slab_side() ** 2
    near = f"; what is near by {_companion(asset).LABEL}" if "count" in asset.options else ""
    own = replace(asset, images={name: image for name, image in asset.images.items() if name.startswith("light_")})
    return (
        f"Light field: {len(cell.slabs)} of {SLABS} slabs, {u['views_used']:.0f} of {SLABS * cell.views**2} views, "
        f"{u['rays'] / texels:.0%} of {texels:,} rays traced; {8 * own.bytes() / (cell.shape()[0] * cell.shape()[1]):.3g} bits a ray"
        f"{', block-compressed' if asset.options['coded'] else ''}{near}."
    )


def outlines(asset: Asset) -> Outlines:
    """The cell, the slabs' camera planes, and what shows what is near."""
    cell = cell_of(asset)
    found = of_box(-cell.half, cell.half, center=cell.center)
    for face in cell.slabs:
        axis, sign = face // 2, 1 - 2 * (face % 2)
        plane = cell.center - sign * cell.half[axis] * np.eye(3)[axis]
        found += of_rectangle(plane, *(side * np.eye(3)[(axis + n) % 3] for n, side in enumerate(cell.side(axis), 1)))
    return found + (_companion(asset).outlines(asset) if "count" in asset.options else Outlines())


def trace(k, asset, ray) -> Hit:
    """Four views of the ray's slab; no answer where that slab was left out. What is near, from the companion that was joined."""
    if "count" not in asset.options:
        return trace_background(k, asset, ray)
    near = _companion(asset).trace(k, asset, ray)
    size = asset.uniforms["contact"]
    distance = k.name("near_distance", k.dot(near.position - ray.origin, ray.direction))
    fades = k.clamp((distance - CONTACT * size) / k.max((1.0 - CONTACT) * size, 1e-20), 0.0, 1.0)
    far = k.name("far", k.select(k.equal(near.status, spaces.STATUS_HIT), fades, 1.0))

    def slabs():
        hit = trace_background(k, asset, ray)
        kept = hit.coverage * far
        return (
            k.mix(near.radiance, hit.radiance, kept), k.select(kept > 0.5, hit.position, near.position),
            k.select(kept > 0.5, hit.status, near.status),
        )  # fmt: skip

    radiance, position, status = k.branch(far > 0.0, slabs, lambda: (near.radiance, near.position, near.status))
    return Hit(radiance, position, near.coverage, status)


def trace_background(k, asset, ray) -> Hit:
    """The slabs alone: what is near the reflector is not what is near a camera."""
    radiance, position, coverage = answer(k, asset, ray)
    return Hit(radiance, position, coverage, k.select(coverage > 0.0, spaces.STATUS_HIT, spaces.STATUS_NONE))


def _companion(asset):
    """The method that was joined for what is near."""
    return depth_maps if "maps" in asset.options else billboards
