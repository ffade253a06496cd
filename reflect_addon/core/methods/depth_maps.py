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

from dataclasses import replace
from functools import partial

import numpy as np

from .. import billboard_kernel, depth_kernel, depth_start, second_order, srdm
from ..asset import Asset, half_with_scale
from ..billboard_atlas import ROW, pack, table_row, write_mirror
from ..billboard_capture import Texels, capture
from ..billboard_mirrors import mirror_rows, stand_off
from ..depth_atlas import TALLEST
from ..depth_choice import views_for
from ..depth_fit import DepthView
from ..depth_tables import write_maps
from ..errors import ReflectError
from ..job import BakeJob
from ..kernel import Hit
from ..outlines import of_table as outlines  # noqa: F401  the method's own (methods/__init__.py)
from ..pull_push import continued
from ..remake import parts_of
from ..row_search import Among, spans
from ..settings import COMMON, Setting
from ..view_dependent import arranged, images_of
from . import billboards
from .billboards import inputs  # noqa: F401  the method's own (methods/__init__.py)

NAME = "depth_maps"
LABEL = "Depth Maps"
REQUIRES = ()
TOGETHER, BAKE_EFFORT = billboards.TOGETHER, 4.0
EFFORT, SHOWS_ITSELF = 60.0, "self_reflections"
# Settings that a plan tries, too, from cheap to dear: (effort, what differs).
VARIANTS = (
    (6.0, {"self_reflections": False, "maps": 1, "points": 8, "order": 2, "refine": False}),
    (25.0, {"self_detail": 1, "maps": 2, "points": 8, "order": 2, "refine": False}),
)
SETTINGS = {
    "texels": replace(COMMON["texels"], high=srdm.MAX_SIDE),
    "maps": Setting("Maps", "Most depth maps of one object. Fewer are taken where fewer see all that is reflected", soft_high=16),
    "self_reflections": Setting(
        "Self Reflections", "Depth maps of the reflector itself where its own reflected rays meet it (a handle, a spout)"
    ),
    "self_detail": Setting("Self Detail", "How many times the texels of other maps those of the reflector itself have. Its rays start "
                           "on it, and what they meet there is near", high=8, soft_high=4, advanced=True),
    "order": Setting("Order", "Reflections in a row that are followed where mirrors see mirrors or themselves. 2: a mirror in a "
                     "mirror shows no third one", low=2, high=8, advanced=True),
    "turns": Setting("Turns", "Directions for which a depth map is simplified. More find edges better and need memory",
                     soft_high=180, advanced=True),
    "points": Setting("Points", "Points that are left of each row of a simplified depth map. More follow finer shapes and "
                      "cost time for each pixel", low=2, high=srdm.MAX_SIDE, soft_high=64, advanced=True),
    "rows": Setting("Rows", "Rows of a simplified depth map that a ray looks up. 2: sharper edges at twice the cost",
                    high=2, advanced=True),
    "optimal": Setting("Optimal", "The best simplified rows instead of good ones. Takes longer to bake", advanced=True),
    "half": Setting("Half Precision", "Half the memory for the simplified rows, with coarser points", advanced=True),
    "quads": Setting("As Quads", "Names of objects that stand as quads though they are round", advanced=True),
    "refine": Setting("Refine", "Move each hit from the simplified row onto the depth map itself. Without it only those on mirrors and "
                      "glossy things, and all where glossy things have depth maps; drawn faster and a little less exactly", advanced=True),
}  # fmt: skip
DEFAULTS = {
    **billboards.DEFAULTS,
    "texels": 256,
    "maps": 4,  # most maps of one object
    "self_reflections": True,  # maps of the reflector itself, where its rays meet it
    "self_detail": 2,  # maps of the reflector itself have so many times the texels a side: what its rays meet there is near
    "order": 3,  # of reflections, where a mirror's rays may meet mirrors
    "turns": 60,  # n of the paper: 3 degrees
    "points": 16,  # m of the paper
    "rows": 1,  # 2: the two best rows say where the projection's own row is looked up
    "optimal": False,  # optimal poly-lines instead of greedy ones
    "half": False,  # points as half floats
    "quads": (),  # names of objects that stand as quads though they are round
    "refine": True,  # hits on what is only lit too, from the poly-line to the map itself
}


def bake(job: BakeJob, choose=views_for) -> Asset:
    """Quads for what is flat, depth maps for what is not, and the environment without either. choose: the maps to be taken
    of volumes, as views_for does it."""
    _check(job.settings)
    quads, backdrop = billboards.with_backdrop(job, NAME)
    as_quads = {i.name for i in (*job.scene.instances, *job.scene.lamps) if i.object_name in job.settings.get("quads", ())}
    flat = [q for q in quads if q.shared or q.instance in as_quads]
    volumes = tuple(dict.fromkeys(q.instance for q in quads if not q.shared and q.instance not in as_quads))
    stand_ins = [*flat, *choose(job, volumes)]
    captured = capture(job, stand_ins)
    # What is only lit comes first, quads before maps in each group: the tertiary ray looks among these rows alone.
    glossy = arranged(job, stand_ins, captured, backdrop)
    order = glossy.order
    maps_of = glossy.split({i for i, s in enumerate(stand_ins) if isinstance(s, DepthView)})
    stand_ins, captured = [stand_ins[i] for i in order], glossy.captured
    views = {i for i, s in enumerate(stand_ins) if isinstance(s, DepthView)}
    opaque = [bool(t.radiance[..., 3].min() == 1.0) for t in captured]
    captured = [_continued(t) if i in views else t for i, t in enumerate(captured)]
    atlas, placed = pack([t.radiance for t in captured])
    half, scale = half_with_scale(atlas[..., :3])
    atlas[..., :3] = half
    center = np.asarray(backdrop.uniforms["center"])
    rows = np.zeros((max(len(stand_ins), 1), len(ROW), 4), np.float32)
    shiny = [s for s, t in zip(stand_ins, captured, strict=True) if t.mirrors]
    # Where a mirror's rays may meet mirrors: where there are two of them, or one that sees itself.
    again = int(job.settings["order"]) > 2 and (len({s.instance for s in shiny}) > 1 or any(_is_own(s) for s in shiny))
    depth_images = write_maps(job, rows, stand_ins, captured, placed, center, again) if views else {}
    for i, stand_in in enumerate(stand_ins):
        if i not in views:
            rows[i] = table_row(stand_in, placed[i], opaque[i], center)
    mirrors, normal_images, options = mirror_rows(job, stand_ins, captured)
    for row, (material, where) in zip(rows[len(stand_ins) - len(mirrors) :], mirrors, strict=False):
        write_mirror(row, material, where, None, center)
    stand_off(job, rows, stand_ins, captured)
    shading_images, shading_uniforms, shading_options = images_of(job, glossy, stand_ins, captured, scale, center)
    images = {
        "billboard_tx": atlas.astype(np.float16), "billboard_buf": rows, **normal_images, **depth_images, **shading_images
    }  # fmt: skip
    kinds = [_map_kind(captured[i]) if i in views else billboards.kind_of(s, captured[i]) for i, s in enumerate(stand_ins)]
    return Asset(
        kind=NAME,
        reflector=job.reflector.name,
        images={**backdrop.images, **images},
        uniforms={**backdrop.uniforms, "billboard_scale": scale, **shading_uniforms},
        options={
            **backdrop.options,
            "count": sum(glossy.counts[:3]),
            "mirrors": glossy.counts[3],
            "maps": maps_of[0],
            "lamp_maps": maps_of[1],
            "glossy_maps": maps_of[2],
            "mirror_maps": maps_of[3],
            "contours": not all(o for i, o in enumerate(opaque) if i not in views),
            "turns": int(job.settings["turns"]),
            "row_texels": -(-int(job.settings["points"]) // 2),
            "rows": int(job.settings["rows"]),
            "half": bool(job.settings["half"]),
            "refine": bool(job.settings["refine"]),
            **options,
            **shading_options,
            **({"order": int(job.settings["order"]) if again else second_order.PAPERS_ORDER} if mirrors else {}),
            "starts": again or any(_is_own(s) for s in shiny),
        },
        settings=dict(job.settings),
        parts=parts_of(job.scene, job.reflector, [(s.instance, kind) for s, kind in zip(stand_ins, kinds, strict=True)]),
        light_hash=job.scene.light_hash,
    )


def needless(tried: dict[str, Asset], own: bool) -> str:
    """A plan's (methods/__init__.py)."""
    quads = tried.get(billboards.NAME)
    flat = {"flat", "flat_mirror", "flat_glossy", "reflector"}
    return "all that is met is flat, and a quad shows it as well" if quads and not own and all(p.kind in flat for p in quads.parts) else ""


def _is_own(stand_in) -> bool:
    """Whether the reflector's rays start on what this shows."""
    return isinstance(stand_in, DepthView) and stand_in.own


def _map_kind(texels: Texels) -> str:
    """remake.py's word for a depth map."""
    if texels.normals is None:
        return "map"
    return "mirror_map" if texels.mirrors else "glossy_map"


def _continued(texels: Texels) -> Texels:
    """Colours and normals beyond the outline."""
    normals, own = texels.normals, texels.own
    if normals is not None:
        solid = np.concatenate([normals[..., :3], texels.radiance[..., 3:]], -1)
        normals = np.concatenate([continued(solid)[..., :3], np.zeros_like(solid[..., 3:])], -1)
    return Texels(continued(texels.radiance), normals, texels.distance, None if own is None else continued(own))


def _check(settings: dict) -> None:
    n, m = int(settings["turns"]), int(settings["points"])
    detail = int(settings["self_detail"])
    if detail < 1 or detail & (detail - 1):
        raise ReflectError(f"Maps of the reflector itself cannot have {detail} times the texels.", "Give self_detail 1, 2, 4 or 8.")
    if int(settings["order"]) < 2:
        raise ReflectError(f"Reflections of order {settings['order']} do not go on from mirrors.", "Give an order of 2 or more.")
    srdm.check(int(settings["texels"]) * detail, n, m)
    if int(settings["rows"]) > 2:
        raise ReflectError(f"A ray cannot look up {settings['rows']} rows of a depth map.", "Give 1 or 2 rows.")
    if n * -(-m // 2) > TALLEST:
        raise ReflectError(
            f"Depth maps with {n} turns of {m} points are wider than graphics cards hold.",
            f"Keep turns times points at {2 * TALLEST} or less.",
        )


def nearest(k, asset, ray, start, among: Among, search=None):
    """second_order's: the nearest quad or depth map. search: depth_kernel.nearest's."""
    options = asset.options
    quads, (*lit, mirrors) = spans(asset, among, [options[name] for name in ("maps", "lamp_maps", "glossy_maps", "mirror_maps")])
    found = billboard_kernel.nearest(k, asset, ray, start, quads)
    # Where a ray goes on from, or is shaded by its normal, a poly-line's error is magnified. What is only lit is searched by the same code.
    refined = replace(asset, options={**options, "refine": True})
    found = depth_kernel.nearest(k, refined if options["glossy_maps"] else asset, ray, start, found, lit, search)
    if not options["mirror_maps"]:
        return found
    of = replace(refined, images={**asset.images, "depth_tx": asset.images["mirror_depth_buf"]})
    return depth_kernel.nearest(k, of, ray, start, found, [mirrors], search or (depth_start.search if options["starts"] else None))


def trace(k, asset, ray, search=None) -> Hit:
    """The nearest quad or depth map that the ray meets, by way of a mirror if it is one, else the environment."""
    return second_order.answer(k, asset, ray, partial(nearest, search=search), billboards.behind)
