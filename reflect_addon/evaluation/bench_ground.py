"""Target P20 of popescu-2006: the ground's box costs no more than 3 of the 5 quads that it stands for.

A mirror sphere on a plane of 2 km fills the view. The same frame is drawn with plain environment mapping, with the box,
and with its ground and walls as five quads (ground_quads.py, equal pictures); timed in turns. The cost of the box, and of
the quads, is what a frame takes more than environment mapping: ray map, look-up and resolve are in all three.
"""

from functools import partial
from pathlib import Path

import bpy
import numpy as np

from ..core.methods import billboards, environment
from ..core.processes import temporary_folder
from ..scene.bake import bake_assets
from ..scene.camera import camera_of
from ..scene.load import load_assets
from ..scene.raytrace import trace
from . import bench_popescu, ground_quads
from .bench_row import row
from .frame import open_frame

SIZE = (256, 256)
TURNS, FRAMES = 15, 4
TARGET = 0.6


def measure(progress) -> list[dict]:
    """Rows for targets.json."""
    progress(0.0, "popescu: the ground's box against five quads")
    with temporary_folder("reflect-bench-") as folder:
        found = cost(folder)
    size = f"{SIZE[0]}x{SIZE[1]}, median of {TURNS} turns"
    net, frame = found["net"], found["frame"]
    how = "What the box adds to environment mapping over what the five quads add, same picture"
    return [
        row("P20", net, TARGET, net <= TARGET, f"{how}, {size}.", paper=TARGET),
        row("P20-frame", frame, TARGET, frame <= TARGET, f"Whole frame with the box over whole frame with five quads, {size}."),
    ]


def cost(folder: Path) -> dict[str, float]:
    """{"net": the box's cost over the five quads', "frame": whole frame over whole frame, "box", "quads": each over
    environment mapping}. folder: for the assets."""
    from ..gpu.renderer import Renderer
    from ..gpu.timing import processor_clock, time_in_turns

    scene = plain()
    with open_frame(scene, None) as snapshot:
        bake_assets(snapshot, ("billboards",), folder, settings=bench_popescu.BAKE, tracer=partial(trace, scene=scene))
        ((name, asset),) = load_assets(snapshot, "billboards", folder).items()
        box = ground_quads.alone(asset)
        drawn = ((box, environment.trace), (box, billboards.trace), (ground_quads.five_quads(asset), ground_quads.trace))
        camera = camera_of(scene, scene.camera, *SIZE)
        works = [Renderer(snapshot, {name: a}, kernel=lambda _, kernel=kernel: kernel).work(camera) for a, kernel in drawn]
    times = time_in_turns(works, TURNS, FRAMES, processor_clock())
    box, quads = times.ratio(1, 0), times.ratio(2, 0)
    return {"net": max(box - 1, 0.0) / max(quads - 1, 1e-9), "frame": times.ratio(1, 2), "box": box, "quads": quads}


def plain() -> bpy.types.Scene:
    scene = bench_popescu.mirror_scene(0)
    bpy.ops.mesh.primitive_plane_add(size=2000, location=(0, 0, -1))
    scene.camera.location, scene.camera.rotation_euler = (0, -2.2, 0.3), (np.radians(84), 0, 0)
    scene.camera.data.lens = 70
    bpy.context.view_layer.update()
    return scene
