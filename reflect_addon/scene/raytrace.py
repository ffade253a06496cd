"""The one primitive: any bundle of rays, traced exactly by Cycles (design, "One primitive: trace(rays)").

Problem: truth, cube maps, billboards and light fields all ask "what does this ray see, and where does it end".
Idea: an OSL camera reads one ray per pixel from a float image, so one ordinary render answers up to a million of them
without UVs, material edits or the bake operator. Rays go in bundles: between two of them the caller hears of the
progress and may stop.

Limits: shaders that ask the Light Path node still learn that they are seen by a camera. Lamps are seen where a glossy
ray would see them, but are no objects: their ray reports the surface behind. Sample clamping, bounces and simplify are
the user's. A surface counts as hit from 0.1 % opacity on. From the 32,767th object on all share the last one's name.
"""

import os
import shutil
from dataclasses import dataclass, replace
from pathlib import Path

import bpy
import numpy as np
from mathutils import Color

from ..core.processes import NO_ROOM, temporary_folder
from ..core.progress import Progress, teller
from ..core.rays import Hits, Rays
from ..core.spaces import FAR
from .exr import read_exr, stacked, write_exr
from .ray_scene import CLIP_START, ray_scene

# Camera paths per render. About a second's work on two cores in a lit scene: how long a cancel may wait. Fixed, not
# measured, so that the same call gives the same noise.
PATHS_PER_RENDER = 1 << 19
FEWEST_RAYS = 256  # per render, however many samples: below this the start of a render costs more than its rays
COLUMNS = 1024  # of the ray image
ROOM = 1 << 28  # bytes that a RAM disk must have free to be used
LEAST_SIDE = 4  # px, of a picture that Blender renders
GLOSSY = ("glossy_direct", "glossy_indirect", "glossy_color")  # passes that together are what glossy lobes reflect
SEED_STEP = 7919  # between the caller's seeds: parts of one bundle count up from there and must not share their noise


@dataclass(frozen=True)
class Primary:
    """What a camera sees through its pixel centres, row 0 at the bottom, linear Rec.709, before film exposure."""

    combined: np.ndarray  # (H, W, 3) float32, radiance with everything
    glossy: np.ndarray  # (H, W, 3) float32, the part of it that glossy lobes reflect: (direct + indirect) * colour
    position: np.ndarray  # (H, W, 3) float32, world, m; origin + FAR * direction where nothing was hit
    normal: np.ndarray  # (H, W, 3) float32, world, unit; 0 where nothing was hit
    object: np.ndarray  # (H, W) int32, index into object_names; -1 where nothing was hit
    object_names: tuple[str, ...]


def trace(
    rays: Rays,
    hide=(),
    samples: int = 1,
    *,
    seed: int = 0,
    scene: bpy.types.Scene | None = None,
    as_reflection: bool = True,
    glossy: bool = False,
    progress: Progress | None = None,
) -> Hits:
    """Radiance, position, normal and object that each ray of the bundle sees.

    hide: names of objects that the rays pass through; they still cast shadows and light. samples: paths per ray.
    as_reflection: see what a mirror would see (objects, lamps and world by their glossy visibility, no holdouts);
    otherwise what a camera would. glossy: say apart what glossy lobes reflect.
    Positions are float32 world coordinates: 1e-7 of the distance to the world's origin.
    Raises ValueError for rays that are not finite or have no direction and for unknown names, Cancelled when progress
    returns False, ReflectError when Cycles, OSL or OpenImageIO is missing or the disk is full. The file is as before in
    every case.
    """
    passes = GLOSSY if glossy else ()
    channels, names = _render(rays, frozenset(hide), samples, seed, scene, as_reflection, progress, passes)
    hits = _hits(rays, channels, names)
    return replace(hits, glossy=_glossy(channels)) if glossy else hits


def primary(
    camera,
    samples: int = 1,
    *,
    seed: int = 0,
    scene: bpy.types.Scene | None = None,
    progress: Progress | None = None,
) -> Primary:
    """The picture of a core.camera.Camera, its glossy part apart, so that a reflection can be put in its place."""
    rays = camera.primary_rays()
    channels, names = _render(rays, frozenset(), samples, seed, scene, False, progress, GLOSSY)
    hits = _hits(rays, channels, names)
    shape = (camera.height, camera.width)
    return Primary(
        hits.radiance.reshape(*shape, 3),
        _glossy(channels).reshape(*shape, 3),
        hits.position.reshape(*shape, 3),
        hits.normal.reshape(*shape, 3),
        hits.object.reshape(shape),
        names,
    )


def memory_folder() -> str | None:
    """Where a render's rays and results (some 60 MB) go: a RAM disk with room, else None, the system's place.

    REFLECT_TEMP names another folder: who starts a bake as a process of its own can so remove what a kill -9 leaves.
    """
    if chosen := os.environ.get("REFLECT_TEMP"):
        return chosen
    ram = "/dev/shm"
    return ram if os.access(ram, os.W_OK) and shutil.disk_usage(ram).free > ROOM else None


def _render(rays, hide, samples, seed, scene, as_reflection, progress, passes):
    """(pass name -> (N, channels) float32, object names). The ray bundle goes through in parts of fixed size."""
    origin, direction = _checked(rays)
    origin = _before_the_clip(origin, direction)
    if samples < 1:
        raise ValueError(f"samples must be at least 1, not {samples}")
    scene = scene or bpy.context.scene
    count = len(origin)
    tell = teller(progress, "Tracing rays")
    wanted = {"Combined": "RGB", "Position": "XYZ", "Normal": "XYZ", "Object Index": "X"}
    wanted |= {name.title().replace("_", " "): "RGB" for name in passes}
    out = {name: np.zeros((count, len(letters)), np.float32) for name, letters in wanted.items()}
    per_render = max(PATHS_PER_RENDER // samples, FEWEST_RAYS)
    with temporary_folder("reflect-rays-", memory_folder()) as folder:
        with ray_scene(scene, folder, hide, samples, as_reflection) as (temporary, names):
            for name in passes:
                setattr(next(layer for layer in temporary.view_layers if layer.use), f"use_pass_{name}", True)
            for part, start in enumerate(range(0, count, per_render)):
                tell(start / count, f"traced {start:,} of {count:,} rays")
                rows = slice(start, min(start + per_render, count))
                temporary.cycles.seed = (seed * SEED_STEP + part) % (1 << 31)
                channels = _render_part(temporary, folder, part, origin[rows], direction[rows])
                for name, letters in wanted.items():
                    values = stacked(channels, name, letters)
                    out[name][rows] = values.reshape(-1, len(letters))[: rows.stop - rows.start]
    tell(1.0, f"traced {count:,} rays")
    return out, names


def _render_part(scene, folder: Path, part: int, origin: np.ndarray, direction: np.ndarray) -> dict[str, np.ndarray]:
    columns = max(min(COLUMNS, len(origin)), LEAST_SIDE)
    rows = max(-(-len(origin) // columns), LEAST_SIDE)
    camera = scene.camera.data
    # New names each time: the renderer's image cache is keyed by them.
    paths = {"origins": folder / f"origins{part}.exr", "directions": folder / f"directions{part}.exr"}
    for (name, path), values in zip(paths.items(), (origin, direction)):
        image = np.zeros((rows * columns, 3), np.float32)
        image[: len(values)] = values
        write_exr(path, image.reshape(rows, columns, 3), NO_ROOM)
        camera.cycles_custom[name] = str(path)
    camera.cycles_custom["columns"], camera.cycles_custom["rows"] = columns, rows
    camera.update_tag()
    scene.render.resolution_x, scene.render.resolution_y = columns, rows
    result_path = folder / f"result{part}.exr"
    scene.render.filepath = str(result_path)
    bpy.ops.render.render(write_still=True, scene=scene.name)
    channels = read_exr(result_path)
    for path in (*paths.values(), result_path):
        path.unlink()
    return channels


def _hits(rays: Rays, channels: dict[str, np.ndarray], names: tuple[str, ...]) -> Hits:
    index = np.rint(channels["Object Index"][:, 0]).astype(np.int32) - 1
    hit = index >= 0
    direction = np.asarray(rays.direction, np.float64)
    far = np.asarray(rays.origin, np.float64) + FAR * direction / np.linalg.norm(direction, axis=-1, keepdims=True)
    length = np.linalg.norm(channels["Normal"], axis=-1, keepdims=True)
    normal = np.where(hit[:, None] & (length > 0), channels["Normal"] / np.maximum(length, 1e-30), 0)
    return Hits(
        to_rec709(channels["Combined"]),
        np.where(hit[:, None], channels["Position"], far).astype(np.float32),
        normal.astype(np.float32),
        index,
        hit,
        names,
    )


def _glossy(channels: dict[str, np.ndarray]) -> np.ndarray:
    """(N, 3): the product is taken in the file's own space, where Cycles divided."""
    return to_rec709((channels["Glossy Direct"] + channels["Glossy Indirect"]) * channels["Glossy Color"])


def _checked(rays: Rays) -> tuple[np.ndarray, np.ndarray]:
    origin, direction = np.asarray(rays.origin, np.float32), np.asarray(rays.direction, np.float32)
    if origin.shape != direction.shape or origin.ndim != 2 or origin.shape[1] != 3:
        raise ValueError(f"rays need two (N, 3) arrays, not {origin.shape} and {direction.shape}")
    if not (np.isfinite(origin).all() and np.isfinite(direction).all() and direction.any(axis=1).all()):
        raise ValueError("rays must be finite and have a direction")
    return origin, direction


def _before_the_clip(origin: np.ndarray, direction: np.ndarray) -> np.ndarray:
    """Origins moved back by what Cycles' camera cuts off: in a scene of millimetres a micrometre hides what is near."""
    unit = direction / np.linalg.norm(direction.astype(np.float64), axis=-1, keepdims=True)
    return (origin - CLIP_START * unit).astype(np.float32)


def to_rec709(radiance: np.ndarray) -> np.ndarray:
    """From the file's working space (Rec.709, Rec.2020 or ACEScg) to linear Rec.709, which all of Reflect speaks."""
    if bpy.data.colorspace.working_space == "Linear Rec.709":
        return radiance
    rec709_from_scene = [Color(unit).from_scene_linear_to_rec709_linear() for unit in np.eye(3)]
    return radiance @ np.array(rec709_from_scene, np.float32)
