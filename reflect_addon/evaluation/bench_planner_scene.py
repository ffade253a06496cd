"""What the planner is measured on: rooms that a script makes at random, and models of interiors with something shiny put into them.

Everything glows or mirrors: what a plan is judged by is where things are seen, and that needs no light.
"""

import os
from collections.abc import Callable
from pathlib import Path

import bpy
import numpy as np
from mathutils import Vector

from ..scene.camera import camera_of
from ..scene.raymap_numpy import ray_mapper
from ..scene.snapshot import take_snapshot
from .bench_mirrors_scene import look, material, new_file
from .bench_yu_scene import SAMPLES

MODELS = ("cornell-box", "vr-gallery.glb")
LEAST_ROOM, LARGEST_ROOM = 2.5, 8.0  # m, a side
MOST_THINGS, MOST_MIRRORS = 12, 4
TURNS, LEAST_SEEN = 20, 8  # rooms that are tried; pixels of 64 x 64


def _cube(**place):
    bpy.ops.mesh.primitive_cube_add(size=1.0, **place)


def _ball(**place):
    bpy.ops.mesh.primitive_uv_sphere_add(segments=32, ring_count=16, radius=0.5, **place)


def _tube(**place):
    bpy.ops.mesh.primitive_cylinder_add(vertices=32, radius=0.5, depth=1.0, **place)


def _cone(**place):
    bpy.ops.mesh.primitive_cone_add(vertices=32, radius1=0.5, depth=1.0, **place)


def _ring(**place):
    bpy.ops.mesh.primitive_torus_add(major_segments=32, minor_segments=12, major_radius=0.4, minor_radius=0.12, **place)


def _monkey(**place):
    bpy.ops.mesh.primitive_monkey_add(size=0.8, **place)


def _pane(**place):
    bpy.ops.mesh.primitive_plane_add(size=1.0, **place)


THINGS: tuple[Callable, ...] = (_cube, _ball, _tube, _cone, _ring, _monkey)
SHINY: tuple[Callable, ...] = (_ball, _ball, _tube, _ring, _monkey, _pane)


def random_room(seed: int) -> bpy.types.Scene:
    """A closed room of any size, things that stand, hang or lie about in it, one to four of them mirrors, and a camera in a corner that sees one."""
    for turn in range(TURNS):
        rng = np.random.default_rng((seed, turn))
        scene = _room(rng, rng.uniform(LEAST_ROOM, LARGEST_ROOM), int(rng.integers(1, MOST_MIRRORS + 1)), int(rng.integers(2, MOST_THINGS + 1)))
        if _seen(scene):
            return scene
    raise AssertionError(f"no mirror is seen in {TURNS} rooms")


def _seen(scene: bpy.types.Scene) -> bool:
    """Whether the camera sees LEAST_SEEN pixels of mirrors."""
    camera = camera_of(scene, scene.camera, 64, 64)
    layer = scene.view_layers[0]
    layer.update()
    return int((ray_mapper(take_snapshot(layer.depsgraph, visibility="RENDER"))(camera).reflector >= 0).sum()) >= LEAST_SEEN


def crowd(seed: int = 3) -> bpy.types.Scene:
    """A hall of ten mirrors among forty things, without a camera: all ten are seen, from anywhere."""
    scene = _room(np.random.default_rng(seed), 2 * LARGEST_ROOM, 10, 40)
    scene.camera = None
    return scene


def _room(rng, size: float, mirrors: int, things: int) -> bpy.types.Scene:
    """size: m, of a side, more or less."""
    scene = new_file()
    room = size * rng.uniform(0.8, 1.2, 3) * (1, 1, 0.6)
    walls = material("Walls", glow=(0.6, 0.5, 0.4))
    for axis in range(3):
        for side in (-1, 1):
            normal = np.zeros(3)
            normal[axis] = -side
            _pane(location=tuple(side * room / 2 * np.eye(3)[axis]), rotation=Vector(normal).to_track_quat("Z", "Y").to_euler())
            sides = np.abs(np.array(bpy.context.object.rotation_euler.to_matrix()).T @ room)
            bpy.context.object.name, bpy.context.object.scale = f"Wall {axis}{side}", (*sides[:2], 1)
            bpy.context.object.data.materials.append(walls)
    mirror = material("Mirror", metallic=1.0)
    for number in range(mirrors):
        _place(rng, room, SHINY, f"Mirror {number}", mirror)
    first = bpy.data.objects["Mirror 0"]
    for number in range(things):
        _place(rng, room, THINGS, f"Thing {number}", material(f"Thing {number}", glow=tuple(rng.random(3))), beside=first if rng.random() < 0.2 else None)
    from_corner = room / 2 * 0.85 * rng.choice([-1, 1], 3)
    look(scene, from_corner, (0, 0, 0), 18)
    return scene


def _place(rng, room, kinds, name: str, surface, beside=None) -> None:
    """beside: an object that it touches, more or less."""
    size = rng.uniform(0.08, 0.3) * room.min()
    at = rng.uniform(-0.5, 0.5, 3) * (room - size)
    if rng.random() < 0.6:
        at[2] = (size - room[2]) / 2  # on the floor
    if beside is not None:
        away = rng.normal(size=3)
        at = np.array(beside.location) + away / np.linalg.norm(away) * 0.5 * (size + max(beside.dimensions))
        at = np.clip(at, (size - room) / 2, (room - size) / 2)
    kinds[rng.integers(len(kinds))](location=tuple(at), rotation=tuple(rng.uniform(0, 2 * np.pi, 3)))
    made = bpy.context.object
    made.name, made.scale = name, (size,) * 3
    made.data.materials.append(surface)
    if len(made.data.polygons) > 6:
        bpy.ops.object.shade_smooth_by_angle()


def interiors() -> tuple[list[Path], list[str]]:
    """(models of interiors that are beside the checkout or in REFLECT_SHARED, names of those that are not)."""
    folders = [Path(f) / "models" for f in (os.environ.get("REFLECT_SHARED"), SAMPLES.parents[1] / "shared") if f]
    found = {name: next((f / name for f in folders if (f / name).exists()), None) for name in MODELS}
    return [path for path in found.values() if path], [name for name, path in found.items() if not path]


def interior(path: Path) -> bpy.types.Scene:
    """A model of an interior, a file or a folder of parts, with a mirror ball in its middle, seen from beside."""
    scene = new_file()
    for part in sorted(path.glob("*.obj")) if path.is_dir() else [path]:
        if part.suffix == ".obj":
            bpy.ops.wm.obj_import(filepath=str(part))
        else:
            bpy.ops.import_scene.gltf(filepath=str(part))
    bpy.context.view_layer.update()
    corners = np.array([o.matrix_world @ Vector(c) for o in scene.objects if o.type == "MESH" for c in o.bound_box])
    low, high = corners.min(0), corners.max(0)
    middle, size = (low + high) / 2, high - low
    _ball(location=tuple(middle))
    bpy.context.object.name, bpy.context.object.scale = "Mirror", (0.25 * size.min(),) * 3
    bpy.context.object.data.materials.append(material("Mirror", metallic=1.0))
    bpy.ops.object.shade_smooth()
    look(scene, middle + (0.3, -0.35, 0.1) * size, middle, 35)
    return scene
