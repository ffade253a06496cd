"""`virtual_objects`: the reflected scene itself, drawn where curved reflectors show it [estalella-2005].

Problem. Stand-ins show what was captured; what is near, large or moving they show from the wrong side.
Idea. Of every vertex of the scene the reflection point R on the reflector is searched, in maps of the reflector's own positions
and normals (4.1 reflector_map.py, 4.2 and 4.3 reflection_search.py). Mirrored about the tangent plane at R it is a virtual vertex,
behind the reflector on the line of sight, and the virtual triangles are drawn like any others (3; gpu/virtual.py).
  * The maps know nothing of eye and scene: what moves rigidly, reflector, objects or eye, needs no bake.
  * Searches are done for the nodes of a grid around each mesh where that is asked for, vertices are interpolated (5, virtual_grid.py;
    option `grid_share` as in the paper, `grid_tolerance` in levels).
  * Vertices behind the reflector are placed by the inverse search, so that triangles end at its silhouette (6.1).
  * Reflectors fall into parts that are convex or concave, each with its own map (6.2, reflector_parts.py).
Where we depart. A second-order search that ends on its residual (option `paper`: theirs). Triangles that are wide as seen from the
reflectors are split, so that straight edges bend. Each pixel's own ray meets the triangle that was drawn there (option
`finish`), so that no wrong triangle is shown. Where none is, `layered_distance` answers: the sky, and what could not be handled.
Limits. Colours are surface radiance: what is glossy looks the same from everywhere. A reflector that deforms needs a bake.
"""

from dataclasses import dataclass, replace

import numpy as np

from .. import reflected_surfaces, reflector_map
from ..asset import Asset
from ..job import BakeJob
from ..kernel import Hit
from ..part_pieces import half_angle, pieces_of
from ..rays import Rays
from ..reflector_parts import left_out, part_surface, parts_of
from ..remake import REFLECTOR, is_rigid, motion, part_of
from ..scene_items import OWN, Items
from ..settings import Setting
from ..snapshot import Instance, SceneSnapshot
from ..spaces import STATUS_FELL_BACK
from . import layered_distance

NAME = "virtual_objects"
LABEL = "Virtual Objects"
REQUIRES = (layered_distance.NAME,)
BAKE_EFFORT = 2.0
SURFACES = reflected_surfaces.SETTINGS
SETTINGS = {
    "map_texels": Setting("Map Texels", "Texels along an edge of the maps of a reflector's own shape. More place reflections on finer "
                          "shapes", low=16, high=1024, power_of_two=True),
    "parts": Setting("Parts", "Most parts that a reflector is taken apart into, where it is not all round. Each is searched and drawn "
                     "by itself; what is left out is answered by distance maps", soft_high=32, advanced=True),
    "search_steps": Setting("Search Steps", "Most steps of a search for a point of reflection", soft_high=64, advanced=True, drawn=True),
    "paper": Setting("First-Order Search", "The search as it was published, following bisectors. Slower", advanced=True, drawn=True),
    "second_order": Setting("Mirrors in Mirrors", "Let mirrors that are seen in the reflector reflect too, by its distance maps",
                            advanced=True, drawn=True),
    "grid_share": Setting("Grid Share", "Share of the scene's vertices that is searched, as nodes of a grid; the others are "
                          "interpolated. 0: all are searched", high=1.0, advanced=True, drawn=True),
    "grid_tolerance": Setting("Grid Tolerance", "Pixels that an interpolated vertex may be off by: grids are as fine as that needs, and Grid "
                         "Share means nothing. 0: none are", soft_high=4.0, advanced=True, drawn=True),
    "finish": Setting("Finish", "Let each pixel's own ray meet the triangle that is drawn there. Without it pictures are as published: "
                      "what lies between vertices is interpolated", advanced=True, drawn=True),
}  # fmt: skip
DEFAULTS = {
    "map_texels": 128, "parts": 16, "search_steps": 16, "paper": False, "finish": True, "second_order": True, "grid_share": 0.0,
    "grid_tolerance": 0.0,
}  # fmt: skip
# Columns of the table, a row for each piece of a part that is searched by itself: the map's block and which side mirrors; the map's
# centre and size; the ball around the piece, in map space; the axis of its normals and the cosine of the farthest; where to start.
PLACE, CENTER, BALL, CONE, START, COLUMNS = range(6)
# Pieces of a part that is not convex, and of all.
MOST_PIECES, MOST = 8, 24
# Of the texels asked for: what a flat part's map has, and texels that every map has.
FLAT_SHARE, LEAST = 0.25, 32
# Triangles from whose other side rays are sent, four each, and the share of them that must meet the reflector.
PROBES, ENCLOSED = 48, 0.9
# Radians that are added to a cone of normals: a triangle of the scene is drawn where all its vertices are found, and turns normals by
# half of what it is wide (virtual_mesh.WIDEST).
MARGIN = 0.12
# Triangles whose planes are looked at, and how far before one, in sizes, a convex surface's own rounding may lie.
PLANES, BULGE = 512, 1e-4


@dataclass(frozen=True)
class TablePart:
    """A piece of a reflector as its asset holds it."""

    block: np.ndarray  # (4,) x, y, side of its map in the atlas, texels; 1 or -1: which side of the surface mirrors
    center: np.ndarray  # (3,) float64, of the map, world at the bake, m
    size: float  # m
    ball: np.ndarray  # (4,) map space: middle and radius
    cone: np.ndarray  # (4,) axis of its normals (of side 1) and cosine of the farthest from it
    start: np.ndarray  # (4,) as the search kernel takes it (reflection_search.py)


def bake(job: BakeJob) -> Asset:
    """The maps of the reflector's parts."""
    positions, triangles, normals = mirroring(job.scene, job.reflector)
    found = parts_of(positions, triangles, normals, most=int(job.settings["parts"]))
    side, largest = int(job.settings["map_texels"]), max((part.size for part in found), default=1.0)
    maps = [
        reflector_map.build(p.center, p.size, _side(p, side, largest), part_surface(p, positions, triangles, normals), p.kind == "convex") for p in found
    ]
    images, blocks = reflector_map.atlas(maps) if maps else ({name: np.zeros((1, 1, 4), np.float32) for name in reflector_map.IMAGES}, [])
    rows = []
    for part, block in zip(found, blocks, strict=True):
        both = part.two_sided and not _is_inside(job, part, positions, triangles)
        rows += piece_rows(part, block, both, positions, triangles, normals)
    table = np.zeros((max(len(rows[:MOST]), 1), COLUMNS, 4), np.float32)
    for row, (_, values) in zip(table, sorted(rows, key=lambda r: -r[0]), strict=False):
        row[:] = values
    return Asset(
        NAME,
        job.reflector.name,
        {**images, "reflector_parts_buf": table},
        uniforms={"left_out": left_out(found, positions, triangles)},
        options={name: job.settings[name] for name in ("search_steps", "paper", "finish", "second_order", "grid_share", "grid_tolerance")}
        | {"sees_itself": bool((table[:, PLACE, 3] < 0).any()) or not _is_convex(positions, triangles)},
        settings=dict(job.settings),
        parts=(part_of(job.scene, job.reflector, REFLECTOR, -1), *reflected_surfaces.parts(job.scene)),
        light_hash=job.scene.light_hash,
    )


def mirroring(scene: SceneSnapshot, reflector: Instance) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(positions (V, 3), triangles (T, 3), corner normals (T, 3, 3)) in world space, float64, of the surface that gets rays: what
    has a shiny material, or all of it when nothing has."""
    mesh, slots = scene.meshes[reflector.mesh], scene.slots(reflector)
    shiny = np.array([scene.materials[m].is_reflector for m in reflector.materials], bool)[slots]
    chosen = shiny if shiny.any() else np.ones(len(slots), bool)
    linear = np.asarray(reflector.world_from_object, np.float64)[:3, :3]
    cofactors = np.stack([np.cross(linear[:, (k + 1) % 3], linear[:, (k + 2) % 3]) for k in range(3)], -1)
    normals = mesh.corner_normals[chosen].astype(np.float64) @ cofactors.T
    if np.linalg.det(linear) < 0:
        normals = -normals
    length = np.linalg.norm(normals, axis=-1, keepdims=True)
    return scene.world_positions(reflector), mesh.triangles[chosen], normals / np.where(length > 0, length, 1.0)


def _side(part, side: int, largest: float) -> int:
    """Texels of a part's map: fewer for a smaller part and for a flat one, to a power of two."""
    wanted = side * min(part.size / max(largest, 1e-300), FLAT_SHARE if part.kind == "flat" else 1.0)
    return int(2 ** np.clip(np.ceil(np.log2(max(wanted, 1.0))), np.log2(min(LEAST, side)), np.log2(side)))


def _is_inside(job: BakeJob, part, positions, triangles) -> bool:
    """Whether nobody sees a part's other side: what it faces is the reflector itself, from within. An open mesh may have only a hole
    that is never looked into."""
    own = part.triangles[part.own]
    own = own[:: max(len(own) // PROBES, 1)]
    corners = positions[triangles[own]]
    middle, normal = corners.mean(1), np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=-1, keepdims=True), 1e-300)
    inwards = np.where(((middle - part.center) * normal).sum(-1) > 0, -1.0, 1.0) * (-1.0 if part.reverse else 1.0)
    normal = normal * inwards[:, None]
    spread = np.random.default_rng(len(own)).normal(size=(4, *normal.shape))
    directions = normal + 0.6 * spread / np.linalg.norm(spread, axis=-1, keepdims=True)
    directions /= np.linalg.norm(directions, axis=-1, keepdims=True)
    starts = np.broadcast_to(middle + 1e-4 * part.size * normal, directions.shape)
    rays = Rays(starts.reshape(-1, 3).astype(np.float32), directions.reshape(-1, 3).astype(np.float32))
    return bool(np.isfinite(job.intersect(job.reflector, rays)).mean() > ENCLOSED)


def piece_rows(part, block, both: bool, positions, triangles, normals) -> list[tuple[float, np.ndarray]]:
    """(area, row of the table) of each piece of a part, on one of its sides or on both."""
    own = part.triangles[part.own]
    corners = (positions[triangles[own]] - part.center) / part.size
    middle = corners.mean(1)
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(cross, axis=-1)
    # The side that mirrors is the one that faces away from the centre, or the other.
    turned = normals[own]
    outside = np.einsum("tkc,tkc->t", turned, corners) > 0
    turned = np.where((outside == part.reverse)[:, None, None], -turned, turned)
    mean = turned.mean(1)
    mean /= np.maximum(np.linalg.norm(mean, axis=-1, keepdims=True), 1e-12)
    rows = []
    for side in (1.0, -1.0) if both else (1.0,):
        one_root = part.kind == "flat" or (part.kind == "convex" and side > 0)
        for piece in pieces_of(middle, mean, area, 1 if one_root else MOST_PIECES):
            axis, _ = half_angle(mean[piece], area[piece])
            points = corners[piece].reshape(-1, 3)
            center = (points.min(0) + points.max(0)) / 2
            row = np.zeros((COLUMNS, 4))
            row[PLACE] = *block, side
            row[CENTER] = *part.center, part.size
            row[BALL] = *center, np.linalg.norm(points - center, axis=1).max()
            row[CONE] = *axis, np.cos(min(np.arccos(np.clip((turned[piece] @ axis).min(), -1, 1)) + MARGIN, np.pi))
            # Half way between eye and vertex is away from a mirror that faces its centre, and what closes its map there hides nothing.
            if not one_root or side * (turned[piece].mean(1) * middle[piece]).sum() < 0:
                nearest = ((mean[piece] - axis) ** 2).sum(-1) + ((middle[piece] - center) ** 2).sum(-1)
                row[START] = *middle[piece][nearest.argmin()], 2.0
            rows.append((float(area[piece].sum()), row))
    return rows


def _is_convex(positions: np.ndarray, triangles: np.ndarray) -> bool:
    """Whether no point of a surface lies before the plane of another: such a mirror does not show itself."""
    if not len(triangles):
        return True
    corners = positions[triangles[:: max(len(triangles) // PLANES, 1)]]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=-1, keepdims=True), 1e-300)
    used = positions[np.unique(triangles)]
    above = used @ normal.T - np.einsum("tc,tc->t", normal, corners[:, 0])
    size = np.ptp(used, axis=0).max()
    return bool(above.max() <= BULGE * size or above.min() >= -BULGE * size)


def inputs(scene: SceneSnapshot, reflectors: tuple[Instance, ...]) -> Items:
    """The reflectors' shapes, where they are shiny, and whose surfaces are drawn: nothing else is in an asset."""
    shiny = {r.name: "".join(str(int(scene.materials[m].is_reflector)) for m in r.materials) for r in reflectors}
    return {**reflected_surfaces.inputs_of(scene, reflectors), OWN: shiny}


def remark(asset: Asset, scene: SceneSnapshot, reflector: Instance) -> str:
    """What keeps the maps from fitting the reflector as it is now."""
    own = next((part for part in asset.parts if part.kind == REFLECTOR), None)
    if own is None or is_rigid(motion(own, reflector)):
        return ""
    return f"{reflector.name} has been squeezed or mirrored since its reflector maps were baked. Bake it again."


def parts_in(asset: Asset) -> tuple[TablePart, ...]:
    """The pieces of a reflector's asset, largest first."""
    rows = asset.images["reflector_parts_buf"].astype(np.float64)
    return tuple(
        TablePart(row[PLACE], row[CENTER, :3], float(row[CENTER, 3]), row[BALL], row[CONE], row[START])
        for row in rows
        if row[CENTER, 3] > 0
    )


def report(asset: Asset) -> str:
    """What a reflector was taken apart into."""
    count, share = len(parts_in(asset)), asset.uniforms["left_out"]
    if not count:
        return "Nothing of its surface can be searched: distance maps answer alone."
    pieces = "Searched in one piece" if count == 1 else f"Searched in {count} pieces"
    return pieces + (f"; {share:.1%} of the surface is in none, where distance maps answer." if share > 5e-4 else ".")


def trace(k, asset, ray) -> Hit:
    """What is not drawn: the sky, and surfaces that no virtual triangle showed (STATUS_FELL_BACK)."""
    return replace(layered_distance.trace(k, asset, ray), status=STATUS_FELL_BACK)
