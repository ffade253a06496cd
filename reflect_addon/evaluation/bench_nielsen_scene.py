"""The four scenes of nielsen-2002 Fig 7 and Table 1, as far as its numbers tell: planar and curved reflectors, depth, triangles.

The pictures are not to be had, but the counts of reflections say more than the table's first rows. With back-face culling alone, (a)'s static
count of 26 and view-dependent count of 38 are 5 + 21 and 6 + 21 + 5 + 6: from the camera one of six mirrors is seen from behind, and
so it is through four of the other five. That is a box of mirrors looked into past its front, through a side of which the eye stays in front.
(d)'s 15 = 3 + 6 + 6 and 46 = 28 + 2 * 6 + 6 say that through two mirrors the first is always behind: three at right angles, a corner.
(b) is a floor under three balls and (c) two walls that see each other. The objects' shapes and all places are ours.
A mirror is the front of a thin panel, so that it has one side as the paper's have; everything dull glows, as their light was baked.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import bpy
import numpy as np
from mathutils import Vector

from ..core.camera import Camera
from ..core.curved_views import CurvedMirror, curved_of
from ..core.mirror_planes import MirrorPlane, planes_of
from ..scene.camera import camera_of
from .bench_mirrors_scene import look, material, new_file
from .frame import open_frame

SIZE = (640, 480)
THICK = 0.04  # m, of a panel
GLOSSY = 0.15  # roughness of (b)'s floor: "simulates a glossy floor"
COLOURS = ((0.6, 0.2, 0.15), (0.2, 0.45, 0.2), (0.2, 0.25, 0.6), (0.6, 0.55, 0.3), (0.45, 0.45, 0.45), (0.7, 0.4, 0.6))


@dataclass(frozen=True)
class Mirrors:
    """A scene as the schedule sees it."""

    camera: Camera
    planes: tuple[MirrorPlane, ...]
    curved: tuple[CurvedMirror, ...]
    objects: int
    triangles: int
    depth: int


def mirrors_a() -> bpy.types.Scene:
    """A box of six mirrors around a ball, seen through the opening beside the one in front."""
    scene = new_file()
    for place, normal, sides in (
        ((0, 3, 0), (0, 0, 1), (5.6, 5.6)), ((0, 3, 3), (0, 0, -1), (4, 4)), ((-3, 3, 1.5), (1, 0, 0), (5.6, 2.8)),
        ((3, 3, 1.5), (-1, 0, 0), (5.6, 2.8)), ((0, 6, 1.5), (0, -1, 0), (5.6, 2.8)), ((-1.8, 0, 1.5), (0, 1, 0), (2.0, 2.6)),
    ):  # fmt: skip
        panel(place, normal, sides)
    for number, (place, normal, sides) in enumerate((
        ((0, 3, -0.1), (0, 0, 1), (6.2, 6.2)), ((0, 3, 3.1), (0, 0, -1), (6.2, 6.2)), ((-3.1, 3, 1.5), (1, 0, 0), (6.2, 3.2)),
        ((3.1, 3, 1.5), (-1, 0, 0), (6.2, 3.2)), ((0, 6.1, 1.5), (0, -1, 0), (6.2, 3.2)), ((-2, -0.1, 1.5), (0, 1, 0), (2.2, 3.2)),
        ((2.7, -0.1, 1.5), (0, 1, 0), (0.8, 3.2)), ((0.7, -0.1, 2.9), (0, 1, 0), (3.2, 0.4)),
        ((-1.5, 5.9, 1.6), (0, -1, 0), (0.8, 1.0)), ((1.5, 5.9, 1.6), (0, -1, 0), (0.8, 1.0)), ((0.4, 2.6, 0.02), (0, 0, 1), (2, 2)),
    )):  # fmt: skip
        quad(place, normal, sides, number)
    block((0.4, 3.2, 0.2), (0.8, 0.8, 0.4), 3)
    block((-1.6, 4.4, 0.5), (0.5, 0.5, 1.0), 5)
    ball((0.4, 3.2, 1.0), 0.6)
    look(scene, (1.2, -3.2, 1.7), (0.0, 3.4, 1.2), 32)
    return scene


def mirrors_b() -> bpy.types.Scene:
    """Three balls on a glossy floor."""
    scene = new_file()
    panel((0, 0, 0), (0, 0, 1), (9, 9), GLOSSY)
    for place in ((-1.7, 0.2, 0.8), (0.1, 1.5, 0.9), (1.8, -0.1, 0.7)):
        ball(place, 0.65, (20, 10))
    block((0.2, -0.9, 0.35), (0.7, 0.7, 0.7), 0)
    quad((0, 4.5, 2.0), (0, -1, 0), (9, 4), 2)
    look(scene, (0.6, -6.0, 2.6), (0.0, 0.4, 0.6), 38)
    return scene


def mirrors_c() -> bpy.types.Scene:
    """A ball and a ring between two walls that see each other."""
    scene = new_file()
    panel((-2.6, 0, 1.5), (1, 0, 0), (5, 3))
    panel((2.6, 0, 1.5), (-1, 0, 0), (5, 3))
    ball((-0.9, 0.4, 1.2), 0.6)
    bpy.ops.mesh.primitive_torus_add(major_segments=48, minor_segments=30, major_radius=0.6, minor_radius=0.22, location=(0.9, 0.2, 1.2), rotation=(1.2, 0.4, 0))
    _shiny(bpy.context.object)
    block((0.0, 0.3, 0.25), (2.8, 0.9, 0.5), 1)
    for number, (place, normal, sides) in enumerate((
        ((0, 0, 0), (0, 0, 1), (6, 6)), ((0, 3, 1.5), (0, -1, 0), (6, 3)), ((0, 0, 3.05), (0, 0, -1), (6, 6)), ((0, -6, 1.5), (0, 1, 0), (6, 3)),
        ((-1.6, 2.95, 1.7), (0, -1, 0), (0.9, 1.2)), ((0.2, 2.95, 1.7), (0, -1, 0), (1.4, 0.9)), ((1.9, 2.95, 1.7), (0, -1, 0), (0.9, 1.2)),
    )):  # fmt: skip
        quad(place, normal, sides, number)
    look(scene, (0.7, -5.2, 1.9), (0.0, 0.0, 1.2), 30)
    return scene


def mirrors_d() -> bpy.types.Scene:
    """A ball in a corner of three mirrors."""
    scene = new_file()
    panel((2, 2, 0), (0, 0, 1), (3.9, 3.9))
    panel((0, 2, 1.5), (1, 0, 0), (3.9, 2.9))
    panel((2, 0, 1.5), (0, 1, 0), (3.9, 2.9))
    ball((1.3, 1.2, 0.9), 0.6)
    for number, (place, normal, sides) in enumerate((((2, 2, -0.3), (0, 0, 1), (9, 9)), ((6, 2, 1.5), (-1, 0, 0), (5, 3)), ((2, 6, 1.5), (0, -1, 0), (5, 3)))):
        quad(place, normal, sides, number)
    look(scene, (4.6, 5.0, 2.6), (1.0, 1.0, 0.8), 32)
    return scene


# name -> (what builds it, Table 1: recursion depth, planar and curved objects, triangles).
SCENES: dict[str, tuple[Callable[[], bpy.types.Scene], int, int, int, int]] = {
    "mirrors_a": (mirrors_a, 2, 6, 1, 1078),
    "mirrors_b": (mirrors_b, 2, 1, 3, 1106),
    "mirrors_c": (mirrors_c, 2, 2, 2, 3890),
    "mirrors_d": (mirrors_d, 3, 3, 1, 1002),
}


def mirrors_of(name: str, size: tuple[int, int] = SIZE) -> Mirrors:
    """A scene of SCENES, built and read as any other."""
    build, depth = SCENES[name][:2]
    scene = build()
    with open_frame(scene, None) as snapshot:
        planes = planes_of(snapshot)
        triangles = sum(len(snapshot.meshes[i.mesh].triangles) for i in snapshot.instances)
        return Mirrors(camera_of(scene, None, *size), planes, curved_of(snapshot, planes), len(snapshot.instances), triangles, depth)


def panel(place, normal, sides, roughness: float = 0.0) -> None:
    """A thin panel whose front, through place towards normal, is a mirror."""
    x, y, z = np.array(sides[0]) / 2, np.array(sides[1]) / 2, -THICK
    corners = [(-x, -y, z), (x, -y, z), (x, y, z), (-x, y, z), (-x, -y, 0), (x, -y, 0), (x, y, 0), (-x, y, 0)]
    made = _object("Panel", corners, [(4, 5, 6, 7), (3, 2, 1, 0), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)], place, normal)
    mirror = material("Mirror", metallic=1.0)
    mirror.node_tree.nodes["Principled BSDF"].inputs["Roughness"].default_value = roughness
    made.data.materials.append(mirror)
    made.data.materials.append(material("Frame", glow=(0.05, 0.04, 0.03)))
    made.data.polygons.foreach_set("material_index", [0, 1, 1, 1, 1, 1])


def quad(place, normal, sides, colour: int) -> None:
    x, y = sides[0] / 2, sides[1] / 2
    made = _object("Wall", [(-x, -y, 0), (x, -y, 0), (x, y, 0), (-x, y, 0)], [(0, 1, 2, 3)], place, normal)
    made.data.materials.append(material("Glow", glow=COLOURS[colour % len(COLOURS)]))


def block(place, sides: Sequence[float], colour: int) -> None:
    bpy.ops.mesh.primitive_cube_add(size=1, location=place)
    bpy.context.object.scale = sides
    bpy.context.object.data.materials.append(material("Glow", glow=COLOURS[colour % len(COLOURS)]))


def ball(place, radius: float, mesh: tuple[int, int] = (32, 16)) -> None:
    bpy.ops.mesh.primitive_uv_sphere_add(segments=mesh[0], ring_count=mesh[1], radius=radius, location=place)
    _shiny(bpy.context.object)


def _shiny(made: bpy.types.Object) -> None:
    made.data.polygons.foreach_set("use_smooth", [True] * len(made.data.polygons))
    made.data.materials.append(material("Mirror", metallic=1.0))


def _object(name: str, corners, faces, place, normal) -> bpy.types.Object:
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(corners, [], faces)
    made = bpy.data.objects.new(name, mesh)
    made.location = place
    made.rotation_euler = Vector(normal).to_track_quat("Z", "Y").to_euler()
    bpy.context.scene.collection.objects.link(made)
    return made
