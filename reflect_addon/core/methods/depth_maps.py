"""`depth_maps`: objects near the reflector stand as depth maps [popescu-2006 section 4].

Problem. A billboard is flat once reflected: it cannot touch the reflector where the object does, and has no footprint.
Idea. A depth map of the object, taken by a pinhole camera that faces the reflector, holds its shape. A reflected ray is
clipped to that camera's frustum and projected; the one row of the simplified rotated maps that contains the projection
says where the ray meets the object (4.1 to 4.3; srdm.py, depth_kernel.py).
  * What is flat stays a quad (billboards.py): no map is better than a plane, and none costs less.
  * Several maps of an object, chosen by what reflected rays meet, see what one does not; the nearest hit wins (6).
  * A reflector that its own reflected rays meet has maps of itself (6, "self-reflections").
Where we depart. Texels are traced from just above the object's own surface, as billboards' are. Beyond its outline a
map's colours are continued, so that a hit at the very edge shows the object and not its absence.
Limits. What no map sees is not there. A mesh that encloses the reflector lends its flat parts only.
"""

import numpy as np

from .. import billboard_kernel, depth_kernel, spaces, srdm, srdm_greedy, srdm_optimal
from ..asset import Asset, half_with_scale
from ..billboard_atlas import pack, table_rows
from ..billboard_capture import capture
from ..depth_atlas import TALLEST, fill_rows, stacked
from ..depth_choice import views_for
from ..depth_refine import NOTHING, corners_of
from ..errors import ReflectError
from ..job import BakeJob
from ..kernel import Hit
from ..pull_push import continued
from ..remake import parts_of
from . import billboards, environment

NAME = "depth_maps"
LABEL = "Depth Maps"
REQUIRES = ()
DEFAULTS = {
    **{name: value for name, value in billboards.DEFAULTS.items() if name != "live"},  # maps only move: no surfaces
    "texels": 256,
    "maps": 4,  # most maps of one object
    "self_reflections": True,  # maps of the reflector itself, where its rays meet it
    "turns": 60,  # n of the paper: 3 degrees
    "points": 16,  # m of the paper
    "rows": 1,  # 2: the two best rows, blended
    "optimal": False,  # optimal poly-lines instead of greedy ones
    "half": False,  # points as half floats
    "refine": True,  # from the poly-line to the map itself
}


def bake(job: BakeJob) -> Asset:
    """Quads for what is flat, depth maps for what is not, and the environment without either."""
    _check(job.settings)
    quads, hidden = billboards.quads_for(job)
    flat = [q for q in quads if q.shared]
    volumes = tuple(dict.fromkeys(q.instance for q in quads if not q.shared))
    views = views_for(job, volumes)
    backdrop = environment.capture(job, NAME, hide=(job.reflector.object_name, *hidden))
    images = capture(job, [*flat, *views])
    by_name = {i.name: i for i in job.scene.instances}
    tables, depths, spheres = [], [], []
    for index, view in enumerate(views, len(flat)):
        instance = by_name[view.instance]
        depth = view.depth(job, instance, len(images[index]))
        tables.append(_table(job, depth))
        depths.append(corners_of(depth))
        images[index] = continued(images[index])
        vertices = job.scene.world_positions(instance)
        middle = (vertices.min(0) + vertices.max(0)) / 2
        spheres.append((middle, 1.001 * float(np.linalg.norm(vertices - middle, axis=-1).max())))
    atlas, placed = pack(images)
    half, scale = half_with_scale(atlas[..., :3])
    atlas[..., :3] = half
    opaque = [bool(image[..., 3].min() == 1.0) for image in images]
    center = np.asarray(backdrop.uniforms["center"])
    rows = table_rows(flat, placed[: len(flat)], opaque[: len(flat)], center, count=len(images))
    depth_images = {}
    if views:
        image, at = stacked(tables, (-srdm.FILL, 0.0, -srdm.FILL, 0.0))
        depth_images = {"srdm_tx": image.astype(np.float16)} if job.settings["half"] else {"srdm_buf": image}
        depth_images["depth_tx"], depth_at = stacked(depths, (NOTHING,) * 4)
        corners = [(*a, *b) for a, b in zip(at, depth_at, strict=True)]
        fill_rows(rows[len(flat) :], views, placed[len(flat) :], corners, spheres, center)
    return Asset(
        kind=NAME,
        reflector=job.reflector.name,
        images={**backdrop.images, "billboard_tx": atlas.astype(np.float16), "billboard_buf": rows, **depth_images},
        uniforms={**backdrop.uniforms, "billboard_scale": scale},
        options={
            "count": len(flat),
            "contours": not all(opaque[: len(flat)]),
            "maps": len(views),
            "turns": int(job.settings["turns"]),
            "row_texels": -(-int(job.settings["points"]) // 2),
            "rows": int(job.settings["rows"]),
            "half": bool(job.settings["half"]),
            "refine": bool(job.settings["refine"]),
        },
        settings=dict(job.settings),
        parts=parts_of(job.scene, job.reflector, [(q.instance, "flat") for q in flat] + [(v.instance, "map") for v in views]),
        light_hash=job.scene.light_hash,
    )


def _check(settings: dict) -> None:
    n, m = int(settings["turns"]), int(settings["points"])
    srdm.check(int(settings["texels"]), n, m)
    if n * -(-m // 2) > TALLEST:
        raise ReflectError(
            f"Depth maps with {n} turns of {m} points are wider than graphics cards hold.",
            f"Keep turns times points at {2 * TALLEST} or less.",
        )


def _table(job: BakeJob, depth: np.ndarray) -> np.ndarray:
    n, m = int(job.settings["turns"]), int(job.settings["points"])
    simplify = srdm_optimal.simplify if job.settings["optimal"] else srdm_greedy.simplify
    return srdm.packed(simplify(srdm.with_spans(srdm.rotated_rows(depth, n), m), m).reshape(n, len(depth), m, 2))


def nearest(k, asset, ray, start, search=None):
    """(distance, row, u, v) of the nearest quad or depth map that the ray meets. search: depth_kernel.nearest's."""
    found = (spaces.FAR, 0.0, 0.0, 0.0)
    count, maps = asset.options["count"], asset.options["maps"]
    if count:
        found = billboard_kernel.nearest(k, asset, ray, start)
    if maps:
        found = depth_kernel.nearest(k, asset, ray, start, found, count, count + maps, search)
    return found


def trace(k, asset, ray, search=None) -> Hit:
    """The nearest quad or depth map that the ray meets, else the environment. search: depth_kernel.nearest's."""
    if not asset.options["count"] + asset.options["maps"]:
        return environment.answer(k, asset, ray.direction, ray.spread, spaces.STATUS_FELL_BACK)
    start = k.name("start", ray.origin - asset.uniforms["center"])
    distance, row, u, v = nearest(k, asset, ray, start, search)

    def impostor():
        k.cite("popescu-2006 4.3 step 6: look up the impostor's texture at the intersection point")
        radiance = billboard_kernel.radiance(k, asset, ray, distance, row, u, v)
        return radiance, ray.origin + ray.direction * distance, spaces.STATUS_HIT

    def backdrop():
        k.cite("popescu-2006 4.3 step 7: else environment map using the direction of r")
        hit = environment.answer(k, asset, ray.direction, ray.spread, spaces.STATUS_FELL_BACK)
        return hit.radiance, hit.position, spaces.STATUS_FELL_BACK

    radiance, position, status = k.branch(distance < spaces.FAR, impostor, backdrop)
    return Hit(radiance=radiance, position=position, coverage=1.0, status=status)
