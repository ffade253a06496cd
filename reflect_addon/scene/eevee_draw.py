"""EEVEE's pictures of a frame, its own and those with our node groups: a process of its own, on a copy of the file that nobody saves.

All pictures of a job come from one process, so that their times can be compared. Each is drawn three times: a sample with what it compiles, a
sample again, and the frame itself, which is timed and kept (where groups of ours are drawn, too, it is drawn TURNS times: what others take
of the machine only adds, so the least time counts). Times are of the wall and of the process's own work: on a
software device that others share only the latter says much. A frame includes what EEVEE does once for each (syncing, capturing probes, fetching
compiled shaders); `sample` is the rest, for each of its samples.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import bpy

from ..core.errors import ReflectError
from .eevee_job import Job
from .native_draw import Native
from .native_materials import remove_from_materials, use_in_materials
from .peer_materials import straighten
from .peer_probes import add_probe, add_volume
from .properties import object_properties
from .ray_scene import plain_output
from .snapshot import render_visibility, take_snapshot

ENGINE = "BLENDER_EEVEE"
TURNS = 2  # draws of a frame that is compared with others
SPECULAR_LIGHT = "use_pass_glossy_direct"  # EEVEE has one pass for direct and indirect light
SWITCHES = {"sphere_probe": "SPHERE", "box_probe": "BOX", "plane_probe": "PLANE"}  # a setting and the kind of probe that it shows


@dataclass(frozen=True)
class Timed:
    """One picture's time, s."""

    compile: float  # CPU seconds that its first sample takes longer than its second
    seconds: float  # the frame
    busy: float  # the frame, CPU seconds of the process with the threads of a software device
    sample: float  # CPU seconds a sample, without what a frame takes once


def render(job: Job, folder: Path, say: Callable[[float, str], object]) -> dict:
    """Writes folder/picture<k>.exr for each of EEVEE's settings and folder/group<k>.exr for each method of ours; returns what is to be told.

    Changes the open file at will: call it in a process that ends after it.
    """
    scene = bpy.data.scenes[job.scene]
    scene.frame_set(job.frame)
    scene.camera = bpy.data.objects[job.camera]
    count = len(job.settings) + len(job.groups)
    layer = next((layer for layer in scene.view_layers if layer.use), scene.view_layers[0])
    with render_visibility(layer):
        snapshot = take_snapshot(layer.depsgraph, visibility="RENDER")
    settings(scene, job)
    said = {"replaced": [], "times": [], "set_up": 0.0, "groups": []}
    if not job.shown:
        draw(scene, 1)  # what is compiled once for all is nobody's
    for number, groups in enumerate(job.groups):
        say(number / count, f"EEVEE draws picture {number + 1} of {count}: {groups.method}")
        said["groups"].append(_group(scene, job, Native(groups, snapshot), folder / f"group{number}.exr"))
    if job.settings:  # last: the reflectors' materials change
        done = len(job.groups)
        said |= _peers(scene, job, snapshot, folder, lambda k: say((done + k) / count, f"EEVEE draws picture {done + k + 1} of {count}"))
    return said


def _peers(scene, job: Job, snapshot, folder: Path, say: Callable[[int], object]) -> dict:
    replaced = straighten(job.materials, job.marked)
    hidden = [o for o in bpy.data.objects if o.name in job.hidden and not o.hide_probe_sphere]
    for obj in hidden:
        obj.hide_probe_sphere = True
    start = time.perf_counter()
    if job.volume:
        add_volume(scene, *snapshot.bounds())
    set_up = time.perf_counter() - start
    probes = [(p.kind, add_probe(scene, p)) for p in job.probes]
    draw(scene, 1)
    times = []
    for number, setting in enumerate(job.settings):
        say(number)
        scene.eevee.use_raytracing = bool(setting["screen_tracing"])
        shown = {kind for name, kind in SWITCHES.items() if setting[name]}
        for kind, probe in probes:
            probe.hide_render = kind not in shown
        times.append(vars(timed(scene, job.samples, TURNS if job.groups else 1, folder / f"picture{number}.exr")))
    for _, probe in probes:
        bpy.data.objects.remove(probe)
    return {"replaced": replaced, "times": times, "set_up": set_up}


def _group(scene, job: Job, native: Native, path: Path) -> dict:
    """Judged alone, without samples between pixels' centres; then shown or timed as an artist sees it, in the artist's materials."""
    told = {"method": native.method, "error": native.error, "notes": [], "plain": None, "fewer": None, "traced": None}
    if native.error:
        return told
    scene.eevee.use_raytracing = False
    if not job.shown:
        native.put(scene, job.diagonal)
        if native.error:  # what cannot be a group is known when it is emitted
            return {**told, "error": native.error}
        draw(scene, 1, path)
        told |= native.counts()
        native.take_away()
        if not job.timed:
            return told | {"notes": native.notes}
    with object_properties():
        try:
            done = use_in_materials(scene, native.snapshot, native.assets, native.method)
        except ReflectError as error:
            if job.shown:
                return {**told, "error": f"{error.message} {error.remedy}"}
            return {**told, "notes": [*native.notes, f"Not timed in the scene's materials: {error.message} {error.remedy}"]}
        if job.shown:
            draw(scene, job.samples, path)
        else:
            told["plain"] = vars(timed(scene, job.samples, TURNS))
            if job.fewer:
                told["fewer"] = _seconds(least(scene, job.fewer, TURNS))
            scene.eevee.use_raytracing = True
            draw(scene, 1)  # what tracing compiles
            told["traced"] = _seconds(draw(scene, job.samples))
        remove_from_materials(scene.objects)
    return {**told, "notes": [*native.notes, *done.sentences]}


def timed(scene: bpy.types.Scene, samples: int, turns: int, path: Path | None = None) -> Timed:
    first, again = draw(scene, 1)[1], draw(scene, 1)[1]
    seconds, busy = least(scene, samples, turns, path)
    return Timed(max(first - again, 0.0), seconds, busy, max(busy - again, 0.0) / max(samples - 1, 1))


def least(scene: bpy.types.Scene, samples: int, turns: int, path: Path | None = None) -> tuple[float, float]:
    """Renders the frame a few times; the least of each time."""
    return tuple(map(min, zip(*(draw(scene, samples, path) for _ in range(turns)), strict=True)))


def _seconds(times: tuple[float, float]) -> dict[str, float]:
    return dict(zip(("seconds", "busy"), times, strict=True))


def draw(scene: bpy.types.Scene, samples: int, path: Path | None = None) -> tuple[float, float]:
    """Renders the frame, into the file where one is named; (seconds, CPU seconds)."""
    scene.eevee.taa_render_samples = samples
    if path is not None:
        scene.render.filepath = str(path)
    wall, busy = time.perf_counter(), time.process_time()
    bpy.ops.render.render(write_still=path is not None, scene=scene.name)
    return time.perf_counter() - wall, time.process_time() - busy


def settings(scene: bpy.types.Scene, job: Job) -> None:
    """The best of EEVEE's screen tracing; the rest is the user's. What is judged is seen through pixels' centres, without a lens."""
    scene.animation_data_clear()
    scene.timeline_markers.clear()  # a marker would bind another camera
    plain_output(scene)
    render, eevee, tracing = scene.render, scene.eevee, scene.eevee.ray_tracing_options
    render.engine = ENGINE
    render.resolution_x, render.resolution_y = job.size
    eevee.gi_cubemap_resolution = str(job.probe_side)
    eevee.ray_tracing_method, tracing.resolution_scale, tracing.screen_trace_quality = "SCREEN", "1", 1.0
    eevee.clamp_surface_direct = eevee.clamp_surface_indirect = 0.0
    eevee.use_overscan = False
    layer = next((layer for layer in scene.view_layers if layer.use), scene.view_layers[0])
    for other in scene.view_layers:
        other.use = other == layer
    layer.samples = 0
    for name in [p.identifier for p in layer.bl_rna.properties if p.identifier.startswith("use_pass_")]:
        setattr(layer, name, False)
    layer.use_pass_combined = True
    if job.shown:
        return
    # The normals are those of the snapshot and of Cycles: fine ones (native_normals.py), and of subdivided meshes not the GPU's, which are others.
    render.use_high_quality_normals = True
    bpy.context.preferences.system.use_gpu_subdivision = False
    setattr(layer, SPECULAR_LIGHT, True)
    scene.camera.data.dof.use_dof = False
    render.filter_size = 0.0  # all samples through the pixel's centre
    for world in {scene.world, layer.world_override} - {None}:
        # Else EEVEE cuts the world at this radiance and makes a lamp of the rest, whose image in a mirror is a single pixel
        # a thousand times too bright.
        world.sun_threshold = 0.0
