"""A plan for the open scene: who sees which rays of each reflector, what they meet, and which stand-in each gets (core/planning/).

Nothing is rendered, so that a plan takes seconds where its bake takes minutes. Views are the scene's camera over its frames; without one, reflectors are
seen from anywhere around them.
"""

import math
import time
from collections.abc import Iterator, Sequence
from dataclasses import replace

import bpy
import numpy as np

from ..core import methods
from ..core.camera import Camera
from ..core.errors import ReflectError
from ..core.job import BakeJob
from ..core.planning.candidates import Trial
from ..core.planning.choose import Choice, choose
from ..core.planning.goal import Goal
from ..core.planning.leave_out import left_out
from ..core.planning.plan import Plan, row_of, words
from ..core.planning.samples import seen_around, seen_by_cameras
from ..core.progress import Progress
from ..core.rays import RayMap
from ..core.snapshot import Instance, SceneSnapshot
from .camera import camera_of
from .freshness import settings_for
from .geometric_trace import geometric_tracer
from .intersect import first_hits
from .properties import stand_in_of
from .raymap_numpy import ray_mapper
from .ways import camera_way, may_move, ways

SIDE = 160  # px across a view
VIEWS = 6  # frames that a camera that moves is looked through
FEW, FINER = 800, 12  # a reflector of fewer pixels in all views is looked at again, up to so many times finer


def plan(
    scene: bpy.types.Scene, snapshot: SceneSnapshot, goal: Goal, settings: dict[str, object], say: Progress, reflectors: Sequence[Instance] | None = None
) -> tuple[Plan, list[Choice]]:
    """settings: of the bakes, over the methods' defaults. reflectors: those that it is made for, all by default. Returns it with what its rows were chosen by."""
    began = time.perf_counter()
    reflectors = snapshot.reflectors() if reflectors is None else reflectors
    first = first_hits(snapshot)
    trace, shared, bounds = geometric_tracer(snapshot, first), {}, ways(snapshot)
    intersect = lambda instance, bundle, slots=None: first(instance, bundle, slots)[0]

    def job_of(reflector) -> BakeJob:
        return BakeJob(snapshot, reflector, trace, intersect, {}, shared=shared, bounds=bounds, camera_bounds=lambda: camera_way(snapshot))

    chosen = by_hand(scene, reflectors)
    say(0.0, "what is seen of each reflector")
    maps, closer = _ray_maps(scene, snapshot)
    seen = seen_by_cameras(maps, closer, job_of, reflectors) if maps else seen_around(job_of, reflectors)
    asked = lambda kind: settings_for(kind, settings)
    trials = [Trial(one, job_of(one.reflector), asked, goal, chosen.get(one.reflector.object_name, "")) for one in seen]
    found = []
    for number, trial in enumerate(trials):
        tell = lambda method, n=number, name=trial.seen.reflector.name: say(0.1 + 0.8 * n / len(trials), f"trying {method} for {name}")
        found.append(tuple(trial.candidates(tell)))
    choices, warnings = choose(seen, found, goal)
    say(0.9, "what is left out")
    choices = [replace(choice, left_out=left_out(trial, choice.taken)) for choice, trial in zip(choices, trials, strict=True)]
    seconds = time.perf_counter() - began
    return Plan(goal, snapshot.geometry_hash, words(settings) + words(chosen), bool(maps), seconds, tuple(map(row_of, choices)), tuple(warnings)), choices


def by_hand(scene: bpy.types.Scene, reflectors: Sequence[Instance]) -> dict[str, str]:
    """Object -> method that a user chose for it; without those that are left to the plan."""
    objects = (scene.objects.get(name) for name in dict.fromkeys(r.object_name for r in reflectors))
    return {obj.name: stand_in_of(obj) for obj in objects if obj is not None and stand_in_of(obj) in methods.gathering()}


def _ray_maps(scene: bpy.types.Scene, snapshot: SceneSnapshot) -> tuple[list[RayMap], list[RayMap]]:
    """(what the scene's camera sees, closer looks at what has few pixels there); none where it has no camera that makes pictures."""
    cameras = _cameras(scene)
    if not cameras:
        return [], []
    look = ray_mapper(snapshot)
    maps = [look(camera) for camera in cameras]
    return maps, [look(part) for part in _closer(maps, cameras)]


def _closer(maps: list[RayMap], cameras: list[Camera]) -> Iterator[Camera]:
    """Finer views of the reflectors that have few pixels, each where it is seen largest."""
    for index in range(len(maps[0].reflector_names)):
        counts = [int((m.reflector == index).sum()) for m in maps]
        if not 0 < sum(counts) < FEW:
            continue
        k = int(np.argmax(counts))
        y, x = np.nonzero(maps[k].reflector == index)
        part = cameras[k].part(int(x.min()), int(y.min()), int(np.ptp(x)) + 1, int(np.ptp(y)) + 1)
        yield part.finer(min(math.ceil(math.sqrt(2 * FEW / sum(counts))), FINER))


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
