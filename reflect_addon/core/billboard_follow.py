"""Billboards that follow what moves: from an asset and the scene as it is, the table to show and the captures to make.

remake.py says which stand-ins; this module says how for quads, follow_shots.py what is looked at again. What only moves is the row of its capture, moved (not the
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
from .billboard_atlas import hidden_row, moved_row
from .depth_atlas import hidden_map_row, moved_map_row
from .follow_shots import MAPS, SeenAgain, Shot, map_shot, quad_shot, quads_of, world_positions
from .remake import REFLECTOR, is_rigid, motion, part_of, remake_set, same_triangles
from .row_motion import FACES, FOLLOWS, faced
from .snapshot import Instance, SceneSnapshot
from .surface_asset import SurfaceMesh

# Kinds of remake.RULES whose light at the hit a bake alone makes: they move along and are named in `stale`.
BAKED = {"glossy", "flat_glossy", "glossy_map"}
KINDS = ("flat", "volume", "mirror", "flat_mirror", "map", "mirror_map", *sorted(BAKED))


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
        seen = SeenAgain(scene, instance, surface, share, world_positions(surface, instance), asset.uniforms["center"])
        quads = quads_of(seen, mine, rows, named[own.instance])
        for part in mine:
            parts[part.row] = part_of(scene, instance, part.kind, part.row)
            if part.kind in MAPS:
                rows[part.row], shot = map_shot(seen, part, rows[part.row])
            elif part.row in quads:
                rows[part.row], shot = quad_shot(seen, part, rows[part.row], quads[part.row])
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
