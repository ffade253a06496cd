"""Which rays of a scene's reflectors are seen: by its camera over its frames and by whoever looks beside it, or, where it has none, from anywhere
around them (what a 3D view shows at the moment is no reason to leave out what it shows a moment later)."""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import bpy
import numpy as np

from ..core.camera import Camera
from ..core.errors import ReflectError
from ..core.job import BakeJob
from ..core.planning.samples import Seen, seen_around, seen_by_cameras
from ..core.rays import RayMap
from ..core.snapshot import Instance, SceneSnapshot
from .camera import camera_of
from .geometric_trace import geometric_tracer
from .intersect import first_hits
from .raymap_numpy import ray_mapper
from .ways import camera_way, may_move, ways

SIDE = 160  # px across a view
VIEWS = 6  # frames that a camera that moves is looked through
FEW, FINER = 800, 12  # a reflector of fewer pixels in all views is looked at again, up to so many times finer


def jobs_without_light(snapshot: SceneSnapshot) -> Callable[[Instance], BakeJob]:
    """A reflector's job, without settings, whose rays meet meshes and bring no light."""
    first = first_hits(snapshot)
    trace, shared, bounds = geometric_tracer(snapshot, first), {}, ways(snapshot)

    def job_of(reflector: Instance) -> BakeJob:
        return BakeJob(
            snapshot, reflector, trace, lambda instance, rays, slots=None: first(instance, rays, slots)[0], {}, shared=shared, bounds=bounds,
            camera_bounds=lambda: camera_way(snapshot),
        )  # fmt: skip

    return job_of


def views_of(
    scene: bpy.types.Scene, snapshot: SceneSnapshot, reflectors: Sequence[Instance], job_of: Callable[[Instance], BakeJob], beside: Sequence[Camera] = ()
) -> tuple[list[Seen], bool]:
    """(one for each reflector, whether cameras say what is seen). job_of: jobs_without_light's; beside: 3D views, with the pixels that they have."""
    cameras = _cameras(scene)
    if not cameras:
        return seen_around(job_of, reflectors), False
    look = ray_mapper(snapshot)
    pixels = [SIDE / (scene.render.resolution_x * scene.render.resolution_percentage / 100)] * len(cameras) + [SIDE / view.width for view in beside]
    cameras += [replace(view, width=SIDE, height=min(max(round(SIDE * view.height / view.width), 1), 4 * SIDE)) for view in beside]
    maps = [look(camera) for camera in cameras]
    closer = list(_closer(maps, cameras))
    scales = pixels + [pixels[k] * finer for _, finer, k in closer]
    return seen_by_cameras(maps, [look(part) for part, *_ in closer], scales, job_of, reflectors), True


def _closer(maps: list[RayMap], cameras: list[Camera]) -> Iterator[tuple[Camera, int, int]]:
    """Finer views of the reflectors that have few pixels, each where it is seen largest, how many times finer they are, and of which camera."""
    for index in range(len(maps[0].reflector_names)):
        counts = [int((m.reflector == index).sum()) for m in maps]
        if not 0 < sum(counts) < FEW:
            continue
        k = int(np.argmax(counts))
        y, x = np.nonzero(maps[k].reflector == index)
        part = cameras[k].part(int(x.min()), int(y.min()), int(np.ptp(x)) + 1, int(np.ptp(y)) + 1)
        finer = min(math.ceil(math.sqrt(2 * FEW / sum(counts))), FINER)
        yield part.finer(finer), finer, k


def _cameras(scene: bpy.types.Scene) -> list[Camera]:
    if scene.camera is None:
        return []
    render = scene.render
    height = max(int(SIDE * render.resolution_y * render.pixel_aspect_y / (render.resolution_x * render.pixel_aspect_x)), 1)
    moves = may_move(scene.camera) or any(m.camera for m in scene.timeline_markers)
    before, part = scene.frame_current, scene.frame_subframe
    frames = np.unique(np.linspace(scene.frame_start, scene.frame_end, VIEWS).astype(int)).tolist() if moves else [before]
    try:
        found = []
        for frame in frames:
            if frame != scene.frame_current:
                scene.frame_set(frame)
            found.append(camera_of(scene, scene.camera, SIDE, min(height, 4 * SIDE)))
        return found
    except ReflectError:
        return []
    finally:
        if scene.frame_current != before:
            scene.frame_set(before, subframe=part)
