"""Scenes of several mirrors for the targets of popescu-2006 on reflective billboards, and frames of them.

Balls on a ground as in Fig 5, "enabled one by one", among flat glowing squares that stand for D; teapots on a ground as
in Fig 1, Newell's where the checkout has them, else Suzannes. Baked once, a scene outlives its file.
"""

import importlib.util
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from types import ModuleType

import bpy
import numpy as np
from mathutils import Vector

from ..core.asset import Asset
from ..core.camera import Camera
from ..core.job import BakeJob
from ..core.methods import billboards
from ..core.rays import Rays
from ..core.snapshot import SceneSnapshot
from ..scene.camera import camera_of
from ..scene.intersect import intersector
from ..scene.raytrace import trace
from .frame import open_frame

BAKE = {"resolution": 32, "samples": 1, "texels": 32, "sky_error": 0}
SIZE = (256, 256)
GAP = 2.6  # m between the middles of neighbouring balls of radius 1
# Places of the nine balls in the order in which they are enabled: the middle first, then those beside it.
PLACES = ((0, 0), (1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (-1, -1), (1, -1), (-1, 1))
TEAPOTS = ((0.0, -4.2, 200), (-6.2, 0.2, 25), (6.2, 0.8, 150), (0.2, 5.5, -40))  # x, y (teapot units), degrees


@dataclass(frozen=True)
class Frame:
    """A snapshot with cameras and one asset a reflector for each of several methods."""

    snapshot: SceneSnapshot
    cameras: tuple[Camera, ...]
    assets: dict[str, dict[str, Asset]]  # method -> reflector -> asset

    def renderer(self, method: str = billboards.NAME, **options):
        from ..gpu.renderer import Renderer

        return Renderer(self.snapshot, self.assets[method], **options)

    def work(self, method: str = billboards.NAME, camera: int = 0, **options):
        """The whole frame, to be timed."""
        return self.renderer(method, **options).work(self.cameras[camera])

    def covered(self, camera: int = 0) -> int:
        """Pixels that show a reflector."""
        return int(self._ray_map(camera).covered().sum())

    def rays_of(self, reflector: str, camera: int = 0) -> Rays:
        """The rays of one reflector's pixels."""
        seen = self._ray_map(camera)
        mask = seen.reflector == seen.reflector_names.index(reflector)
        return Rays(seen.origin[mask], seen.direction[mask])

    def _ray_map(self, camera: int):
        from ..gpu.renderer import Renderer

        renderer = Renderer(self.snapshot, {})
        seen = renderer.ray_map(self.cameras[camera])
        renderer.free()
        return seen


def baked(
    scene: bpy.types.Scene,
    methods: Sequence[ModuleType] = (billboards,),
    sizes: Sequence[tuple[int, int]] = (SIZE,),
    only: str | None = None,
) -> Frame:
    """Every reflector's assets, or one reflector's; sizes: of the cameras, px."""
    with open_frame(scene, None) as snapshot:
        intersect, shared = intersector(snapshot), {}
        assets = {
            method.NAME: {
                r.name: method.bake(
                    BakeJob(snapshot, r, partial(trace, scene=scene), intersect, {**method.DEFAULTS, **BAKE}, shared=shared)
                )
                for r in snapshot.reflectors()
                if only in (None, r.name)
            }
            for method in methods
        }
        return Frame(snapshot, tuple(camera_of(scene, scene.camera, *size) for size in sizes), assets)


def balls(count: int, things: int = 1) -> bpy.types.Scene:
    """A new file: `count` mirror balls (Ball 0, ...) on a ground, seen from above, and `things` - 1 flat glowing squares on
    a ring around all of them: D = things."""
    scene = new_file()
    mirror = material("Mirror", metallic=1.0)
    bpy.ops.mesh.primitive_uv_sphere_add(segments=32, ring_count=16)
    bpy.ops.object.shade_smooth()
    first = bpy.context.object
    first.data.materials.append(mirror)
    for i in range(count):
        made = first if i == 0 else first.copy()
        made.name = f"Ball {i}"
        made.location = (GAP * PLACES[i][0], GAP * PLACES[i][1], 0.0)
        if i:
            scene.collection.objects.link(made)
    if things:
        _ground(14.0, -1.02)
    for i in range(things - 1):
        angle = 2 * np.pi * (i + 0.3) / (things - 1)
        square(i, (7.5 * np.cos(angle), 7.5 * np.sin(angle), 0.4 * (i % 3)), angle, 1.2)
    look(scene, (0.0, -6.5, 12.0), (0.0, -0.2, 0.0), 50)
    return scene


def teapots(steps: int = 4) -> tuple[bpy.types.Scene, str]:
    """(a new file with four mirrors on a ground as in Fig 1, what they are)."""
    scene = new_file()
    path = Path(__file__).resolve().parents[2] / "sample_blends" / "teapot_data.py"
    if path.is_file():
        spec = importlib.util.spec_from_file_location("teapot_data", path)
        data = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(data)
        vertices, faces = data.tessellate(steps)
        mesh, name = bpy.data.meshes.new("Teapot"), "teapots"
        mesh.from_pydata(vertices.tolist(), [], faces)
    else:
        bpy.ops.mesh.primitive_monkey_add(size=4.0)
        made = bpy.context.object
        mesh, name = made.data, "Suzannes (no teapots at hand)"
        bpy.data.objects.remove(made)
    mesh.polygons.foreach_set("use_smooth", [True] * len(mesh.polygons))
    mesh.materials.append(material("Mirror", metallic=1.0))
    for i, (x, y, degrees) in enumerate(TEAPOTS):
        made = bpy.data.objects.new(f"Teapot {i}", mesh)
        made.location, made.rotation_euler = (x, y, 0.0), (0, 0, np.radians(degrees))
        scene.collection.objects.link(made)
    _ground(30.0, -0.02)
    look(scene, (1.2, -17.5, 7.2), (0.0, -0.2, 1.3), 42)
    return scene, name


def square(number: int, place, angle: float, size: float) -> None:
    """A flat square that glows, turned about the vertical to face the origin."""
    bpy.ops.mesh.primitive_plane_add(size=size, location=place, rotation=(np.pi / 2, 0, angle + np.pi / 2))
    bpy.context.object.data.materials.append(material(f"Glow {number}", glow=(number % 2, number % 3 / 2, 1.0)))


def new_file() -> bpy.types.Scene:
    """An empty file's scene, with a world."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.world = bpy.data.worlds.new("World")
    return scene


def material(name: str, metallic: float = 0.0, glow=None) -> bpy.types.Material:
    """A mirror (metallic 1) or something dull, which sends out the colour `glow`."""
    made = bpy.data.materials.new(name)
    shader = made.node_tree.nodes["Principled BSDF"]
    shader.inputs["Metallic"].default_value, shader.inputs["Roughness"].default_value = metallic, 1.0 - metallic
    if glow:
        shader.inputs["Emission Color"].default_value, shader.inputs["Emission Strength"].default_value = (*glow, 1.0), 1.0
    return made


def _ground(size: float, height: float) -> None:
    bpy.ops.mesh.primitive_plane_add(size=size, location=(0, 0, height))
    bpy.context.object.name = "Ground"
    bpy.context.object.data.materials.append(material("Ground", glow=(0.3, 0.25, 0.2)))


def look(scene: bpy.types.Scene, place, at, lens: float) -> None:
    """The scene's camera at a place, towards a point; lens in mm."""
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.collection.objects.link(camera)
    camera.location = place
    camera.rotation_euler = (Vector(at) - camera.location).to_track_quat("-Z", "Y").to_euler()
    camera.data.lens = lens
    scene.camera = camera
    bpy.context.view_layer.update()
