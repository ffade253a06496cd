"""Reflectors that the paper could not take or took apart by hand: a torus, a bowl, a Suzanne, a teapot with spout and handle.

Each stands in `columns` where the mirror ball does and is baked like any other: nobody says where it is cut. Told are the pieces that it
falls into, what is in none of them, what its pixels show and how its searches ended. Of the pixels that show virtual objects, those are
`elsewhere` whose surface point is farther than ELSEWHERE of the scene's diagonal from where Cycles' ray ends; a part of them should show
the reflector itself. The pictures are for the eye: a triangle that is torn is a patch of wrong colour with straight edges in the
difference.
"""

from dataclasses import dataclass
from functools import partial

import bpy
import numpy as np

from ..core import metrics
from ..core.methods import virtual_objects
from ..core.processes import temporary_folder
from ..core.spaces import FAR, STATUS_HIT
from ..scene.bake import bake_assets
from ..scene.raytrace import trace
from .assets import baked_in
from .bench_estalella_flicker import drawing
from .bench_row import row
from .bench_yu_scene import BALL, columns, teapot, with_mirror
from .exhibit import Exhibit
from .frame import open_frame
from .judged import judge
from .maps import difference_map
from .pictures import placed
from .stability_scene import grid, torus

SIZE, PATHS = (200, 150), 32  # px; Cycles' paths a ray
# Over the defaults: a room for four shapes in minutes, and shades that are as noisy as the pictures' own.
BAKE = {"samples": 4, "surface_samples": 4, "surface_angle": 0.06, "surface_levels": 7}
ELSEWHERE = 0.01
TORN = 0.05  # share of the pixels drawn that may be: more is seen as speckles or torn triangles
TILT = 0.9  # rad towards the camera, of what has an inside
BENT = 2  # subdivisions of the Suzanne


@dataclass(frozen=True)
class Seen:
    """What one reflector came to. Shares are of its pixels."""

    name: str
    pieces: int
    maps: int
    left_out: float  # share of its surface
    pixels: int
    drawn: float
    sky: float
    fell_back: float
    elsewhere: float  # of those that are drawn
    itself: float  # of those that are elsewhere: rays that meet the reflector again
    searches: dict[str, int]
    rmse: float
    pictures: tuple[tuple[str, np.ndarray], ...] = ()


def measure(progress) -> list:
    """A row for targets.json, and an Exhibit of the table and the pictures."""
    found = []
    for number, (name, made) in enumerate(REFLECTORS.items()):
        progress(number / len(REFLECTORS), f"reflectors: {name}")
        found.append(seen(name, *made()))
    return [*_rows(found), _shown(found)]


def bowl(steps: int = 32) -> tuple[np.ndarray, list]:
    """Half a ball with a wall: inside, rim and outside."""
    inner, outer = np.linspace(np.pi, np.pi / 2, steps), np.linspace(np.pi / 2, np.pi, steps)
    down = np.concatenate([inner, outer])[:, None]
    radius = np.concatenate([np.full(steps, 0.92), np.ones(steps)])[:, None]
    around = np.arange(2 * steps) * np.pi / steps
    points = np.stack([np.sin(down) * np.cos(around), np.sin(down) * np.sin(around), np.broadcast_to(np.cos(down), (2 * steps, 2 * steps))], -1)
    points, faces = grid(radius[..., None] * points, closed=True)
    return tilted(points), _clean(points, faces[:, ::-1])


def ring() -> tuple[np.ndarray, list]:
    points, faces = torus(1.0, 0.38, steps=36)
    return tilted(points[:, [0, 2, 1]] * (1, -1, 1)), _clean(points, faces[:, ::-1])


def suzanne() -> tuple[np.ndarray, list]:
    """Blender's own, subdivided."""
    columns()
    bpy.ops.mesh.primitive_monkey_add()
    model = bpy.context.object
    model.modifiers.new("Smooth", "SUBSURF").levels = BENT
    mesh = model.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    return np.array([v.co[:] for v in mesh.vertices]), [tuple(p.vertices) for p in mesh.polygons]


def tilted(points: np.ndarray) -> np.ndarray:
    """What opens upwards, opening towards the camera."""
    c, s = np.cos(TILT), np.sin(TILT)
    return points @ np.array([[1.0, 0, 0], [0, c, -s], [0, s, c]]).T


def _clean(points: np.ndarray, faces: np.ndarray) -> list:
    """Without triangles that have no area, which poles have."""
    corners = points[faces]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=-1)
    return faces[area > 1e-9].tolist()


REFLECTORS = {"torus": ring, "bowl": bowl, "Suzanne": suzanne, "teapot": teapot}


def seen(name: str, vertices: np.ndarray, faces: list, size: tuple[int, int] = SIZE, paths: int = PATHS) -> Seen:
    """One reflector, baked and drawn, beside its truth."""
    scene, camera = with_mirror(name, vertices, faces)
    with temporary_folder("reflect-bench-") as folder, open_frame(scene, None) as snapshot:
        bake_assets(snapshot, (virtual_objects.NAME,), folder, settings=BAKE, tracer=partial(trace, scene=scene))
        baked = baked_in(folder, snapshot, virtual_objects.NAME)
        judged = judge(scene, snapshot, size, folder, camera.name, paths, "gpu", lambda share, text: None)
        with drawing(snapshot, baked) as renderer:
            frame, searches = renderer.answer(judged.camera), renderer.virtual_statuses(judged.camera)
    mask, truth, asset = judged.ray_map.covered(), judged.truth.hits, baked.assets[BALL]
    radiance, position = frame.radiance[mask], frame.position[mask]
    drawn = frame.status[mask] == STATUS_HIT
    sky = ~drawn & (np.abs(position).max(-1, initial=0) > FAR / 2)
    off = np.linalg.norm(position.astype(np.float64) - truth.position, axis=1) > ELSEWHERE * judged.diagonal
    again = np.array([*truth.object_names, ""])[truth.object] == BALL
    parts = virtual_objects.parts_in(asset)
    picture = judged.look.apply(placed(judged.truth.frame, mask, radiance))
    pictures = (("truth", judged.truth_picture), ("virtual objects", picture), ("difference", difference_map(picture, judged.truth_picture, mask)))
    return Seen(
        name, len(parts), len({tuple(part.block[:2]) for part in parts}), float(asset.uniforms["left_out"]), int(mask.sum()),
        float(drawn.mean()), float(sky.mean()), float((~drawn & ~sky).mean()), _share(off, drawn), _share(again, drawn & off), searches,
        metrics.rmse(radiance, truth.radiance), tuple((f"{name}: {caption}", image) for caption, image in pictures),
    )  # fmt: skip


def _share(of: np.ndarray, chosen: np.ndarray) -> float:
    return float(of[chosen].mean()) if chosen.any() else 0.0


def _rows(found: list[Seen]) -> list[dict]:
    told = "; ".join(f"{one.name} {one.pieces} pieces, {one.fell_back:.1%} fell back" for one in found)
    names = ", ".join(one.name for one in found)
    return [
        row(
            "I5-reflectors", [one.drawn + one.sky for one in found], None, True,
            f"Share of the pixels that show virtual objects or the sky, of {names} in columns, cut into pieces without a click: {told}. "
            "Pictures are an exhibit.",
        ),
        row(
            "I5-elsewhere", [one.elsewhere for one in found], TORN, all(one.elsewhere <= TORN for one in found),
            f"Share of the pixels drawn that are farther than {ELSEWHERE:.0%} of the scene from where Cycles' ray ends, in the same pictures.",
        ),
    ]  # fmt: skip


def _shown(found: list[Seen]) -> Exhibit:
    names = list(dict.fromkeys(status for one in found for status in one.searches))
    heads = ("reflector", "maps", "pieces", "in none", "pixels", "drawn", "sky", "fell back", "elsewhere", "of these, itself", "RMSE", *(f"searches: {n}" for n in names))
    rows = tuple(
        (
            one.name, str(one.maps), str(one.pieces), f"{one.left_out:.1%}", f"{one.pixels:,}",
            *(f"{share:.1%}" for share in (one.drawn, one.sky, one.fell_back, one.elsewhere, one.itself)), f"{one.rmse:.3f}",
            *(f"{one.searches.get(n, 0):,}" for n in names),
        )
        for one in found
    )  # fmt: skip
    return Exhibit(
        "Reflectors that are not convex",
        "In columns, where the mirror ball stands, cut into pieces by themselves. `in none`: share of the surface that no piece has. Pixels show "
        f"virtual objects (`drawn`), the sky, or what distance maps say (`fell back`); `elsewhere`: of the drawn, farther than {ELSEWHERE:.0%} of "
        "the scene from where Cycles' ray ends; `itself`: of these, rays that meet the reflector again.",
        heads, rows, tuple(picture for one in found for picture in one.pictures),
    )  # fmt: skip
