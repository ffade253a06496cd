"""What issue 7 is measured on: the sample scenes and a box room, what is asked of each, and with which bakes.

A bench that a person waits for: pictures are small, and bakes are the demo's, below the methods' defaults. Against EEVEE's own pictures stand the
methods that are cheap to bake and, where those do not reach a third, depth maps, in the settings of somebody who wants EEVEE's frame time:
self reflections only where they are needed, fewer points, no refinement, and texels of more paths, which cost a frame nothing. `kitchen`, of 34
reflectors, has these and `box_proxy` alone, since each further method is minutes of baking; EEVEE's best takes a minute for a frame there, so
its depth maps are nearly the method's own, and its two large mirrors, most of the reflectors' pixels, have more and better texels. The box
room is baked in as many texels as EEVEE's probes have. Group and overlay are compared with all methods (bench_eevee_overlay.py).
"""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path

import bpy
import numpy as np
from mathutils import Vector

from ..core.errors import ReflectError
from ..core.methods import (
    billboards,
    box_proxy,
    depth_maps,
    distance_map,
    environment,
    layered_distance,
    light_field,
    sphere_proxy,
)
from ..core.snapshot import SceneSnapshot
from ..scene.bake import bake_assets
from ..scene.eevee_job import Groups, Job
from ..scene.raytrace import trace
from . import peer
from .assets import Baked, assets_for, baked_in
from .bench_mirrors_scene import look, material, new_file
from .bench_yu_scene import SAMPLES
from .frame import open_frame
from .judged import Judged, judge

PATHS = 256  # Cycles' a ray: by 16 an error-free picture of `kitchen` has a FLIP of 0.086, more than is asked of ours
ALL = tuple(m.NAME for m in (environment, sphere_proxy, box_proxy, distance_map, layered_distance, billboards, depth_maps, light_field))
CHEAP = (box_proxy.NAME, layered_distance.NAME, billboards.NAME)
BAKE = {"resolution": 128, "samples": 8, "view_texels": 64}
BAKE_OF_MANY = {"resolution": 64, "samples": 8, "texels": 64}
LEAN = {"points": 8, "refine": False, "samples": 32}  # depth maps as fast as they get, with little noise
ROOM, TILES = (4.0, 3.0, 2.6), 6  # m; tiles across a wall


@dataclass(frozen=True)
class Case:
    name: str
    methods: tuple[str, ...]
    bake: dict = field(default_factory=lambda: BAKE)
    fast: dict = field(default_factory=dict)  # further settings where frames are timed
    large: tuple[str, ...] = ()  # reflectors that fill much of the picture ...
    finer: dict = field(default_factory=dict)  # ... and further settings of theirs


CASES = (
    Case("contact", (*CHEAP, depth_maps.NAME), fast=LEAN | {"self_reflections": False}),
    Case("columns", CHEAP),
    Case("teapots", (*CHEAP, depth_maps.NAME), fast=LEAN | {"self_detail": 1, "maps": 2, "order": 2}),
    Case(
        "kitchen", (box_proxy.NAME, depth_maps.NAME), BAKE_OF_MANY,
        {"samples": 32, "view_dependent": True, "self_reflections": False, "maps": 3, "turns": 30, "order": 2},
        large=("Splashback", "Table top"), finer={"samples": 64, "texels": 128},
    ),  # fmt: skip
    Case("box room", (environment.NAME, *CHEAP), fast={"resolution": peer.PROBE_SIDE}),
)


@contextmanager
def baked_case(case: Case, size: tuple[int, int], folder: Path, say) -> Iterator[tuple[Judged, dict[str, Baked], Job]]:
    """For the length of a block the case's scene with its truth, its methods' assets, and the job that lets EEVEE draw them as node groups."""
    scene = open_case(case, folder)
    with open_frame(scene, None) as snapshot:
        judged = judge(scene, snapshot, size, folder, None, PATHS, "gpu", lambda share, text: say(0.2 * share, text))
        baked = {}
        for number, name in enumerate(case.methods):
            share, part = 0.2 + 0.8 * number / len(case.methods), 0.8 / len(case.methods)
            baked[name] = _baked(scene, snapshot, case, name, folder, lambda s, t, share=share, part=part: say(share + part * s, t))
        job = peer.job_of(scene, judged.camera_name, judged.camera, snapshot, judged.ray_map)
        yield judged, baked, replace(job, groups=tuple(Groups(name, str(b.folder)) for name, b in baked.items()))


def _baked(scene, snapshot: SceneSnapshot, case: Case, name: str, folder: Path, say) -> Baked:
    first = 0.5 if case.large else 1.0
    baked = assets_for(scene, snapshot, name, folder, case.bake, lambda s, t: say(first * s, t))
    if not case.large:
        return baked
    bake_assets(
        snapshot, (name,), baked.folder, reflectors=case.large, settings={**case.bake, **case.finer},
        tracer=partial(trace, scene=scene), progress=lambda s, t: say(first + (1 - first) * s, t),
    )  # fmt: skip
    return baked_in(baked.folder, snapshot, name)


def open_case(case: Case, folder: Path) -> bpy.types.Scene:
    """Opens the case's scene from a copy in the folder: nothing is baked beside the samples."""
    path = folder / f"{case.name.replace(' ', '_')}.blend"
    if case.name == "box room":
        box_room()
    else:
        source = SAMPLES / path.name
        if not source.is_file():
            raise ReflectError(f"{source} is missing.", "The targets of issue 7 are measured in a checkout of the project.")
        bpy.ops.wm.open_mainfile(filepath=str(source))
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return bpy.context.scene


def box_room() -> bpy.types.Scene:
    """A mirror ball off the middle of a closed room of glowing tiles, nothing else: what `box_proxy` answers exactly."""
    scene = new_file()
    middle, half = np.array((0.0, 0.0, ROOM[2] / 2)), np.array(ROOM) / 2
    colours = ((0.8, 0.3, 0.2), (0.2, 0.5, 0.8), (0.85, 0.7, 0.25), (0.3, 0.65, 0.35), (0.6, 0.5, 0.4), (0.85, 0.85, 0.8))
    for number, colour in enumerate(colours):
        axis, side = divmod(number, 2)
        normal = np.zeros(3)
        normal[axis] = 1.0 - 2 * side
        place = middle - normal * half
        bpy.ops.mesh.primitive_plane_add(size=1, location=place, rotation=Vector(normal).to_track_quat("Z", "Y").to_euler())
        bpy.context.object.name = f"Wall {number}"
        sides = np.abs(np.array(bpy.context.object.rotation_euler.to_matrix()).T @ ROOM)
        bpy.context.object.scale = (*sides[:2], 1)
        bpy.context.object.data.materials.append(_tiles(f"Wall {number}", colour))
    bpy.ops.mesh.primitive_uv_sphere_add(segments=64, ring_count=32, radius=0.6, location=(0.35, 0.2, 1.0))
    bpy.ops.object.shade_smooth()
    bpy.context.object.name = "Mirror ball"
    bpy.context.object.data.materials.append(material("Mirror", metallic=1.0))
    look(scene, (-0.8, -1.35, 1.5), (0.3, 0.2, 1.05), 26)
    return scene


def _tiles(name: str, colour) -> bpy.types.Material:
    """Two shades of a colour in a checkerboard over the wall, which send it out: their light needs no bounce."""
    made = material(name, glow=colour)
    tree = made.node_tree
    pattern, place = tree.nodes.new("ShaderNodeTexChecker"), tree.nodes.new("ShaderNodeTexCoord")
    pattern.inputs["Scale"].default_value = TILES
    pattern.inputs["Color1"].default_value, pattern.inputs["Color2"].default_value = (*colour, 1), (*(c * 0.4 for c in colour), 1)
    shift = tree.nodes.new("ShaderNodeVectorMath")  # off the plane on which the pattern is undecided
    shift.operation, shift.inputs[1].default_value = "ADD", (0.0, 0.0, 0.5 / TILES)
    tree.links.new(place.outputs["Generated"], shift.inputs[0])
    tree.links.new(shift.outputs[0], pattern.inputs["Vector"])
    shader = tree.nodes["Principled BSDF"]
    tree.links.new(pattern.outputs["Color"], shader.inputs["Emission Color"])
    shader.inputs["Base Color"].default_value, shader.inputs["Specular IOR Level"].default_value = (0, 0, 0, 1), 0.0
    return made
