"""Billboards that follow what moves: from an asset and the scene as it is, the table to show and the captures to make.

remake.py says which stand-ins; this module says how for quads. What only moves is the row of its capture, moved (not the
row shown last: a thousand small steps must not add up their roundings). What is made again is the quad that the bake
itself would fit, looked at by the bake's own camera, and drawn into the block of the atlas that its row has: the block
keeps its size. A depth map moves with its object; when that deforms its camera keeps its direction and is fitted again, and
depths and simplified rows are made anew where they lie. Mirrors have normals, the world's, so what shows one is captured
whenever it moves. Nothing here touches a GPU: gpu/follow.py draws the shots.
Limits. A row is never added: a flat thing that turns a side to the mirror which the bake left out does not show it; nor is
a depth map's direction chosen anew. Light is not followed. What should be made again and has no surface radiance is named
in `stale`; its stand-in then goes along with it as it is, a volume's turned to the reflector (moved_rows.py).
"""

from dataclasses import dataclass, replace
from itertools import groupby

import numpy as np

from .asset import Asset, Part
from .billboard_atlas import ROW, Placed, hidden_row, moved_row, placed_of, table_row, write_mirror
from .billboard_fit import Quad, flat_quads, quad_around
from .camera import Camera
from .capture_camera import map_camera, quad_camera
from .depth_atlas import fill_rows, hidden_map_row, moved_map_row, sphere_around
from .depth_camera import DepthCamera, fit
from .depth_fit import DepthView
from .flat_parts import contains
from .mirrors import mirror_of
from .remake import REFLECTOR, is_rigid, motion, part_of, remake_set, same_triangles
from .row_motion import FACES, FOLLOWS, faced
from .snapshot import Instance, SceneSnapshot, corners_of
from .surface_asset import SurfaceMesh

# Kinds of remake.RULES whose light at the hit a bake alone makes: they move along and are named in `stale`.
BAKED = {"glossy", "flat_glossy", "glossy_map"}
KINDS = ("flat", "volume", "mirror", "flat_mirror", "map", "mirror_map", *sorted(BAKED))
FLAT = {"flat", "flat_mirror"}
MAPS = {"map", "mirror_map", "glossy_map"}
MIRRORS = {"mirror", "flat_mirror", "mirror_map"}


@dataclass(frozen=True)
class Shot:
    """One capture: a surface, seen by a stand-in's camera, into its blocks of the asset's images."""

    surface: SurfaceMesh
    instance: Instance
    share: np.ndarray  # (V,) float32: which vertices mirror
    camera: Camera
    placed: Placed  # in billboard_tx
    normals: Placed | None = None  # in normal_tx
    # A mirror's height above its quad, in half widths, is relief[0] * depth + relief[1], depth in m along the camera's axis.
    relief: tuple[float, float] = (0.0, 0.0)
    map: "MapPlace | None" = None


@dataclass(frozen=True)
class MapPlace:
    """Of a depth map: its camera, and where its tables lie."""

    camera: DepthCamera
    rows: tuple[int, int]  # lowest left texel in srdm_tx or srdm_buf
    depths: tuple[int, int]  # in depth_tx, or in mirror_depth_buf
    mirrors: bool  # it is a mirror's, whose depths are floats


@dataclass(frozen=True)
class State:
    """What a follower knows of its asset between two steps."""

    asset: Asset  # its parts, and the table's rows, are as they were when each was last captured
    stale: frozenset[str] = frozenset()  # instances that should have been made again and could not


@dataclass(frozen=True)
class Step:
    """What one look at the scene asks for."""

    state: State  # after the shots
    table: np.ndarray  # (count, 5, 4) float32: what to show
    shots: tuple[Shot, ...]
    moved: int  # rows that were only placed anew


def can_follow(asset: Asset) -> bool:
    """Whether the asset has billboards and says what each of them stands for."""
    table, rows = asset.images.get("billboard_buf"), [p.row for p in asset.parts if p.kind in KINDS]
    reflectors = [p for p in asset.parts if p.kind == REFLECTOR]
    return bool(
        table is not None
        and "billboard_tx" in asset.images
        and rows
        and len(reflectors) == 1
        and 0 <= min(rows) <= max(rows) < len(table)
    )


def start(asset: Asset, scene: SceneSnapshot) -> State:
    """Begin to follow. A bake reads meshes as renders see them: what has other triangles in this scene is the same mesh with
    another subdivision, not a deformed one."""
    named = scene.named()

    def known(part: Part) -> Part:
        instance = named.get(part.instance)
        key = scene.meshes[instance.mesh].key if instance else part.mesh
        return part if same_triangles(key, part.mesh) else replace(part, mesh=key)

    return State(replace(asset, parts=tuple(known(part) for part in asset.parts)))


def follow(state: State, scene: SceneSnapshot, surfaces: dict[str, SurfaceMesh]) -> Step:
    """The step from a state to the scene. surfaces: by instance's name, made under the light of the asset."""
    asset, named, stale = state.asset, scene.named(), set(state.stale)
    rows = asset.images["billboard_buf"].copy()
    # Light cannot be captured, so only shapes and places count.
    changes = remake_set(replace(asset, light_hash=scene.light_hash), scene)
    own = next(part for part in asset.parts if part.kind == REFLECTOR)
    parts = {part.row: part for part in asset.parts}
    if own.instance in named:
        parts[own.row] = part_of(scene, named[own.instance], REFLECTOR, own.row)
    shots: list[Shot] = []
    remade = [part for part in changes.remade if part.kind in KINDS]
    for name, group in groupby(sorted(remade, key=lambda p: (p.instance, p.row)), key=lambda p: p.instance):
        mine, instance = list(group), named[name]
        surface = _surface_on(surfaces.get(name), scene, instance, mine[0])
        share = surface.share(scene, instance) if surface is not None else None
        if share is None or own.instance not in named or any(part.kind in BAKED for part in mine):
            stale.add(name)
            continue
        stale.discard(name)
        seen = _Seen(scene, instance, surface, share, _world(surface, instance), asset.uniforms["center"])
        quads = _quads(seen, mine, rows, named[own.instance])
        for part in mine:
            parts[part.row] = part_of(scene, instance, part.kind, part.row)
            if part.kind in MAPS:
                rows[part.row], shot = _map_shot(seen, part, rows[part.row])
            elif part.row in quads:
                rows[part.row], shot = _quad_shot(seen, part, rows[part.row], quads[part.row])
            else:  # it has fewer sides than it had
                rows[part.row] = hidden_row(rows[part.row])
                continue
            shots.append(shot)
    table = rows.copy()
    center = asset.uniforms["center"]
    for part in (*changes.moved, *_carried(asset, named, stale)):
        move = moved_map_row if part.kind in MAPS else moved_row
        by = motion(part, named[part.instance])
        if FOLLOWS[part.kind] == FACES and own.instance in named:
            by = faced(rows[part.row], by, np.mean(scene.bounds([named[own.instance]]), axis=0), center)
        table[part.row] = move(rows[part.row], by, center)
    for part in changes.gone:
        hide = hidden_map_row if part.kind in MAPS else hidden_row
        table[part.row] = hide(rows[part.row])
    source = "capture" if shots else asset.source
    after = replace(
        asset,
        parts=tuple(parts[part.row] for part in asset.parts),
        images={**asset.images, "billboard_buf": rows},
        source=source,
    )
    return Step(State(after, frozenset(stale)), table, tuple(shots), len(changes.moved))


def _carried(asset: Asset, named: dict[str, Instance], stale: set[str]) -> list[Part]:
    """What should be made again and cannot: it goes along as it is, where that keeps its shape."""
    found = [p for p in asset.parts if p.kind in FOLLOWS and p.instance in stale and p.instance in named and np.linalg.det(p.matrix())]
    return [p for p in found if is_rigid(motion(p, named[p.instance]))]


def _surface_on(surface: SurfaceMesh | None, scene: SceneSnapshot, instance: Instance, part: Part) -> SurfaceMesh | None:
    """The surface as the instance's mesh is now; None when it is not known or cannot be told."""
    mesh = scene.meshes[instance.mesh]
    if surface is None:
        return None
    if part.mesh == mesh.key and not same_triangles(surface.mesh, mesh.key):
        return surface  # the same mesh, in another subdivision
    return surface.on(mesh)


@dataclass(frozen=True)
class _Seen:
    """What is captured again, as it is now."""

    scene: SceneSnapshot
    instance: Instance
    surface: SurfaceMesh
    share: np.ndarray
    points: np.ndarray  # (V, 3) world, m
    center: tuple[float, float, float]  # of the asset

    def normals(self, row: np.ndarray, placed: Placed) -> Placed:
        """Where a mirror's normals lie: a block like that of its colours."""
        return replace(placed, x=int(row[ROW["normals"], 0]), y=int(row[ROW["normals"], 1]))


def _quads(seen: _Seen, parts: list[Part], rows: np.ndarray, reflector: Instance) -> dict[int, Quad]:
    """The quads that a bake would fit now, by the row that shows each."""
    scene, instance = seen.scene, seen.instance
    low, high = scene.bounds([reflector])
    center = (low + high) / 2
    found = {p.row: quad_around(instance.name, seen.points, center) for p in parts if p.kind in {"volume", "mirror"}}
    flat = [p for p in parts if p.kind in FLAT]
    if not flat:
        return found
    quads = [q for q in flat_quads(scene, instance, contains(scene, instance, center))[0] if q.faces(corners_of((low, high)))]
    # Who shows which: the sides that were nearest to each other, had they only moved.
    normals = [_turned(part, instance) @ rows[part.row, ROW["plane"], :3] for part in flat]
    near = sorted(
        (-float(np.dot(normal, quad.normal)), i, j) for i, normal in enumerate(normals) for j, quad in enumerate(quads)
    )
    left = set(range(len(quads)))
    for _, i, j in near:
        if flat[i].row not in found and j in left:
            found[flat[i].row] = quads[j]
            left.discard(j)
    return found


def _turned(part: Part, instance: Instance) -> np.ndarray:
    """(3, 3): how directions have turned since the part was made; unturned for a part without a place."""
    if not np.linalg.det(part.matrix()):
        return np.eye(3)
    linear = motion(part, instance)[:3, :3]
    return linear / max(float(np.abs(linear).max()), 1e-30)


def _quad_shot(seen: _Seen, part: Part, row: np.ndarray, quad: Quad) -> tuple[np.ndarray, Shot]:
    """A quad's row and capture."""
    placed = placed_of(row)
    camera = quad_camera(quad, placed.width, placed.height, seen.points)
    new = table_row(quad, placed, False, seen.center)
    if part.kind not in MIRRORS:
        return new, Shot(seen.surface, seen.instance, seen.share, camera, placed)
    normals = seen.normals(row, placed)
    write_mirror(new, mirror_of(seen.scene, seen.instance).material, normals, quad, seen.center)
    above = float((camera.world_from_camera[:3, 3] - np.asarray(quad.center)) @ np.asarray(quad.normal))
    relief = (-1 / quad.half_u, above / quad.half_u)
    return new, Shot(seen.surface, seen.instance, seen.share, camera, placed, normals, relief)


def _map_shot(seen: _Seen, part: Part, row: np.ndarray) -> tuple[np.ndarray, Shot]:
    """A depth map's row and capture: from where it was, as its object has turned."""
    placed = placed_of(row)
    towards = -_turned(part, seen.instance) @ row[ROW["plane"], :3].astype(np.float64)
    view = DepthView(seen.instance.name, fit(seen.points, towards))
    started_on = bool(row[ROW["limits"], 2] > 0)
    at = tuple(int(n) for n in row[ROW["table"]])
    new = row[None].copy()
    fill_rows(new, [view], [started_on], [placed], [at], [sphere_around(seen.points)], np.asarray(seen.center))
    normals = seen.normals(row, placed) if part.kind in MIRRORS else None
    camera = map_camera(view.camera, placed.width)
    place = MapPlace(view.camera, at[:2], at[2:], part.kind in MIRRORS)
    return new[0], Shot(seen.surface, seen.instance, seen.share, camera, placed, normals, map=place)


def _world(surface: SurfaceMesh, instance: Instance) -> np.ndarray:
    matrix = instance.world_from_object
    return surface.positions.astype(np.float64) @ matrix[:3, :3].T + matrix[:3, 3]
