"""What billboards that follow are captured from again: the stand-in that a bake would fit now, and the shot of it into the blocks that its row has."""

from dataclasses import dataclass, replace

import numpy as np

from .asset import Part
from .billboard_atlas import ROW, Placed, placed_of, table_row, write_mirror
from .billboard_fit import Quad, flat_quads, quad_around
from .camera import Camera
from .capture_camera import map_camera, quad_camera
from .depth_atlas import fill_rows, sphere_around
from .depth_camera import DepthCamera, fit
from .depth_fit import DepthView
from .flat_parts import contains
from .mirrors import mirror_of
from .remake import motion
from .snapshot import Instance, SceneSnapshot, corners_of
from .surface_asset import SurfaceMesh

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
class SeenAgain:
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


def quads_of(seen: SeenAgain, parts: list[Part], rows: np.ndarray, reflector: Instance) -> dict[int, Quad]:
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


def quad_shot(seen: SeenAgain, part: Part, row: np.ndarray, quad: Quad) -> tuple[np.ndarray, Shot]:
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


def map_shot(seen: SeenAgain, part: Part, row: np.ndarray) -> tuple[np.ndarray, Shot]:
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


def world_positions(surface: SurfaceMesh, instance: Instance) -> np.ndarray:
    matrix = instance.world_from_object
    return surface.positions.astype(np.float64) @ matrix[:3, :3].T + matrix[:3, 3]
