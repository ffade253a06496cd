"""Rooms with planar mirrors for the targets of nielsen-2002 on errors: 5 m, closed, a lamp below the ceiling, a few dull things.

The mirrors are panels before the walls: one; two that face each other; two at a right angle that meet in a corner, almost. Walls and things
have different colours, so that what is shown at a wrong place shows. Light from mirrors onto walls (caustics) is off: walls are then
lit the same whatever the limit of glossy bounces, and depths can be compared with Cycles at the same limit.
"""

import bpy
from mathutils import Vector

from .bench_mirrors_scene import look, material, new_file
from .bench_nielsen_scene import panel

SIDE, HEIGHT = 5.0, 3.0  # m
WALL, THINGS = 0.1, 0.35  # m: from a wall to the mirror's front; half a thing
ACROSS = (3.6, 2.2)  # m, a mirror
GREY, COLOURS = (0.6, 0.58, 0.55), ((0.7, 0.25, 0.2), (0.25, 0.6, 0.3), (0.25, 0.35, 0.75), (0.75, 0.7, 0.4))


def one_mirror() -> bpy.types.Scene:
    """A mirror on the far wall, all of it seen."""
    scene = _room()
    panel((0, SIDE / 2 - WALL, HEIGHT / 2), (0, -1, 0), ACROSS)
    look(scene, (0.7, -2.1, 1.6), (0.0, SIDE / 2, 1.35), 26)
    return scene


def facing() -> bpy.types.Scene:
    """Mirrors on the near and the far wall; the eye between them looks past itself."""
    scene = _room()
    for side in (1, -1):
        panel((0, side * (SIDE / 2 - WALL), HEIGHT / 2), (0, -side, 0), ACROSS)
    look(scene, (0.9, -1.6, 1.7), (-0.3, SIDE / 2, 1.3), 26)
    return scene


def angle() -> bpy.types.Scene:
    """Mirrors on two walls that meet."""
    scene = _room()
    panel((0, SIDE / 2 - WALL, HEIGHT / 2), (0, -1, 0), ACROSS)
    panel((SIDE / 2 - WALL, 0, HEIGHT / 2), (-1, 0, 0), ACROSS)
    look(scene, (-1.9, -1.7, 1.7), (2.0, 2.0, 1.3), 22)
    return scene


def _room() -> bpy.types.Scene:
    """Walls, a lamp, a ball, a block and a tall post on a floor."""
    scene = new_file()
    scene.cycles.caustics_reflective = False
    half, middle, tall, flat = SIDE / 2, HEIGHT / 2, (SIDE, HEIGHT), (SIDE, SIDE)
    walls = (
        ((0, 0, 0), (0, 0, 1), flat), ((0, 0, HEIGHT), (0, 0, -1), flat), ((0, half, middle), (0, -1, 0), tall),
        ((0, -half, middle), (0, 1, 0), tall), ((half, 0, middle), (-1, 0, 0), tall), ((-half, 0, middle), (1, 0, 0), tall),
    )  # fmt: skip
    for number, (place, normal, sides) in enumerate(walls):
        bpy.ops.mesh.primitive_plane_add(size=1, location=place, rotation=Vector(normal).to_track_quat("Z", "Y").to_euler())
        bpy.context.object.scale = (*sides, 1)
        _dull(GREY if number < 2 else COLOURS[number - 2])
    _box((-1.0, 0.4, THINGS), (2 * THINGS, 2 * THINGS, 2 * THINGS), (0.8, 0.5, 0.15))
    _box((1.3, 1.0, 0.8), (0.3, 0.3, 1.6), (0.2, 0.55, 0.7))
    bpy.ops.mesh.primitive_uv_sphere_add(segments=32, ring_count=16, radius=THINGS, location=(0.3, -0.3, THINGS))
    bpy.ops.object.shade_smooth()
    _dull((0.65, 0.2, 0.5))
    bpy.ops.object.light_add(type="POINT", location=(0.2, 0.0, HEIGHT - 0.7))
    bpy.context.object.data.energy, bpy.context.object.data.shadow_soft_size = 250.0, 0.2
    return scene


def _box(place, sides, colour) -> None:
    bpy.ops.mesh.primitive_cube_add(size=1, location=place)
    bpy.context.object.scale = sides
    _dull(colour)


def _dull(colour) -> None:
    made = material("Dull")
    shader = made.node_tree.nodes["Principled BSDF"]
    shader.inputs["Base Color"].default_value = (*colour, 1.0)
    shader.inputs["Specular IOR Level"].default_value = 0.0
    bpy.context.object.data.materials.append(made)
