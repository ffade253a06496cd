"""Billboards that follow what moves: from an asset and the scene as it is, the table to show and the captures to make.

remake.py says which stand-ins; this module says how for quads. What only moves is the row of its capture, moved (not the
row shown last: a thousand small steps must not add up their roundings). What is made again is the quad that the bake
itself would fit, looked at by the bake's own camera, and drawn into the block of the atlas that its row has: the block
keeps its size. A depth map moves with its object, and nothing else of it changes. Nothing here touches a GPU: gpu/follow.py draws the shots.
Limits. A row is never added: a flat thing that turns a side to the mirror which the bake left out does not show it. Light is
not followed; what should be made again and cannot be (a deformed object's depth map, a mirror) is named in `stale`, and a mirror's
quad goes along with it as it is.
"""

from dataclasses import dataclass, replace
from itertools import groupby

import numpy as np

from .asset import Asset, Part
from .billboard_atlas import Placed, hidden_row, moved_row, placed_of, table_row
from .billboard_fit import Quad, flat_quads, quad_around
from .camera import Camera
from .capture_camera import quad_camera
from .depth_atlas import hidden_map_row, moved_map_row
from .flat_parts import contains
from .remake import REFLECTOR, is_rigid, motion, part_of, remake_set, same_triangles
from .snapshot import Instance, SceneSnapshot, corners_of
from .surface_asset import SurfaceMesh

KINDS = ("flat", "volume", "mirror", "map", "mirror_map")
MAPS = {"map", "mirror_map"}
BAKED = {"mirror", *MAPS}  # what no capture makes again


@dataclass(frozen=True)
class Shot:
    """One capture: a surface, seen by a billboard's camera, into a block of the atlas."""

    surface: SurfaceMesh
    instance: Instance
    camera: Camera
    placed: Placed


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
        if surface is None or own.instance not in named or mine[0].kind in BAKED:
            stale.add(name)
            continue
        stale.discard(name)
        quads = _quads(scene, instance, mine[0].kind, surface, named[own.instance])
        for part, quad in zip(mine, [*quads, *[None] * len(mine)], strict=False):
            parts[part.row] = part_of(scene, instance, part.kind, part.row)
            if quad is None:  # it has fewer sides than it had
                rows[part.row] = hidden_row(rows[part.row])
                continue
            placed = placed_of(rows[part.row])
            rows[part.row] = table_row(quad, placed, False, asset.uniforms["center"])
            points = _world(surface, instance)
            shots.append(Shot(surface, instance, quad_camera(quad, placed.width, placed.height, points), placed))
    table = rows.copy()
    mirrors = [p for p in changes.remade if p.kind in {"mirror", "mirror_map"} and np.linalg.det(p.matrix())]
    mirrors = [p for p in mirrors if is_rigid(motion(p, named[p.instance]))]
    for part in (*changes.moved, *mirrors):
        move = moved_map_row if part.kind in MAPS else moved_row
        table[part.row] = move(rows[part.row], motion(part, named[part.instance]), asset.uniforms["center"])
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


def _surface_on(surface: SurfaceMesh | None, scene: SceneSnapshot, instance: Instance, part: Part) -> SurfaceMesh | None:
    """The surface as the instance's mesh is now; None when it is not known or cannot be told."""
    mesh = scene.meshes[instance.mesh]
    if surface is None:
        return None
    if part.mesh == mesh.key and not same_triangles(surface.mesh, mesh.key):
        return surface  # the same mesh, in another subdivision
    return surface.on(mesh)


def _quads(scene: SceneSnapshot, instance: Instance, kind: str, surface: SurfaceMesh, reflector: Instance) -> list[Quad]:
    low, high = scene.bounds([reflector])
    center = (low + high) / 2
    if kind == "volume":
        return [quad_around(instance.name, _world(surface, instance), center)]
    corners = corners_of((low, high))
    return [q for q in flat_quads(scene, instance, contains(scene, instance, center))[0] if q.faces(corners)]


def _world(surface: SurfaceMesh, instance: Instance) -> np.ndarray:
    matrix = instance.world_from_object
    return surface.positions.astype(np.float64) @ matrix[:3, :3].T + matrix[:3, 3]
