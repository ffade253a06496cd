"""Targets of popescu-2006 that today's methods can meet: what a box and billboards cost over an environment map.

One mirror sphere fills the view; flat emissive squares stand around it. All figures are ratios within this run.
"""

from functools import partial
from pathlib import Path

import bpy
import numpy as np

from ..core.processes import temporary_folder
from ..scene.bake import bake_assets
from ..scene.camera import camera_of
from ..scene.load import load_assets
from ..scene.raytrace import trace
from .bench_row import row
from .frame import open_frame

QUADS = (5, 10, 20, 40)
ROOM = "room"
SIZE = (256, 256)
BAKE = {"resolution": 64, "samples": 1, "texels": 32}
TURNS, FRAMES = 15, 3
CLOSE_TURNS = 40  # where a tenth is asked for
STRAIGHT = 0.15  # largest departure from the line, as a share of the largest time


def measure(progress) -> list[dict]:
    """Rows for targets.json."""
    from ..gpu.timing import close_ratio, processor_clock, time_in_turns

    names, works = [], []
    with temporary_folder("reflect-bench-") as folder:
        for number, quads in enumerate(QUADS):
            progress(0.8 * number / len(QUADS), f"popescu: {quads} squares around a mirror sphere")
            for method in ("environment", "billboards") if quads == QUADS[0] else ("billboards",):
                names.append((method, quads))
                works.append(_work(mirror_scene(quads), method, folder / str(quads)))
        for method in ("environment", "box_proxy"):
            names.append((method, ROOM))
            works.append(_work(mirror_scene(0, room=True), method, folder / ROOM))
    progress(0.8, "popescu: timing")
    clock = processor_clock()
    times = time_in_turns(works, TURNS, FRAMES, clock)
    base = names.index(("environment", QUADS[0]))
    box = close_ratio(*(works[names.index((name, ROOM))] for name in ("box_proxy", "environment")), CLOSE_TURNS, FRAMES, clock)
    five = times.ratio(names.index(("billboards", QUADS[0])), base)
    # In units of `environment` in the same turn: what slows the machine for a while bends no line.
    series = np.array([times.ratio(names.index(("billboards", n)), base) for n in QUADS])
    slope, start = np.polyfit(QUADS, series, 1)
    bend = float(np.abs(series - (start + slope * np.array(QUADS))).max() / series.max())
    size = f"{SIZE[0]}x{SIZE[1]}"
    progress(1.0, "popescu: done")
    return [
        row("I2-box", box, 1.1, box <= 1.1, f"Time of box_proxy over environment, mirror sphere in a room, {size}, median of {CLOSE_TURNS} pairs of runs."),
        row("I2-billboards", five, 1.6, five <= 1.6, f"Time of billboards with {QUADS[0]} squares over environment, same frame."),
        row(
            "I2-linear",
            bend,
            STRAIGHT,
            bend <= STRAIGHT,
            f"Largest departure from a line of the time over {', '.join(map(str, QUADS))} squares, share of the largest time.",
        ),
    ]


def _work(scene: bpy.types.Scene, method: str, folder: Path):
    """One frame of the scene with a method, ready to be timed; it outlives the file."""
    from ..gpu.renderer import Renderer

    with open_frame(scene, None) as snapshot:
        bake_assets(snapshot, (method,), folder, settings=BAKE, tracer=partial(trace, scene=scene))
        return Renderer(snapshot, load_assets(snapshot, method, folder)).work(camera_of(scene, scene.camera, *SIZE))


def mirror_scene(quads: int, room: bool = False) -> bpy.types.Scene:
    """A new file: the sphere, `quads` squares on a ring around it, walls on request, a camera that looks at it."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    bpy.ops.mesh.primitive_uv_sphere_add(segments=48, ring_count=24)
    ball = bpy.context.object
    bpy.ops.object.shade_smooth()
    mirror = bpy.data.materials.new("Mirror")
    shader = mirror.node_tree.nodes["Principled BSDF"]
    shader.inputs["Metallic"].default_value, shader.inputs["Roughness"].default_value = 1.0, 0.0
    ball.data.materials.append(mirror)
    if room:
        bpy.ops.mesh.primitive_cube_add(size=12.0, location=(1.0, 0.5, 0.0))
    for i in range(quads):
        angle = 2 * np.pi * i / quads
        ring = 3.0 + 0.5 * (i % 3)
        place = (ring * np.cos(angle), ring * np.sin(angle), 0.4 * (i % 4) - 0.6)
        bpy.ops.mesh.primitive_plane_add(size=0.6, location=place, rotation=(np.pi / 2, 0, angle + np.pi / 2))
        glow = bpy.data.materials.new(f"Glow {i}")
        shader = glow.node_tree.nodes["Principled BSDF"]
        shader.inputs["Emission Color"].default_value = (i % 2, i % 3 / 2, 1.0, 1.0)
        shader.inputs["Emission Strength"].default_value = 1.0
        shader.inputs["Roughness"].default_value = 1.0
        bpy.context.object.data.materials.append(glow)
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.collection.objects.link(camera)
    camera.location = (0.0, 0.0, 4.5)
    camera.data.lens = 60
    scene.camera = camera
    return scene
