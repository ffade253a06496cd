"""What the targets on depth maps are measured on: one scene, its rays and assets of it.

As in the paper's Fig 3 a matt object touches a mirror of the same shape, and one depth map of it faces the mirror; the
object is the Stanford bunny where it is at hand, else Suzanne. Hit errors are judged by the mesh itself.
"""

import os
from dataclasses import replace
from pathlib import Path

import bpy
import numpy as np
from mathutils import Matrix, Vector

from ..core.billboard_atlas import ROW
from ..core.job import BakeJob
from ..core.kernel import Hit, record, run_numpy
from ..core.methods import depth_maps
from ..core.rays import Rays
from ..core.row_search import ALL
from ..core.spaces import FAR, STATUS_HIT
from ..scene.camera import camera_of
from ..scene.intersect import intersector
from ..scene.raytrace import trace

SIZE = (256, 256)
BAKE = {**depth_maps.DEFAULTS, "resolution": 64, "samples": 1, "texels": 256, "maps": 1}
BAKE |= {"sky_error": 0, "self_reflections": False}  # one map in all


class Bench:
    """The scene, its rays, and assets of it with any settings, baked once each."""

    def __init__(self, scene: bpy.types.Scene, snapshot):
        self.scene, self.snapshot = scene, snapshot
        self.reflector = snapshot.named()["Mirror"]
        self.object = snapshot.named()["Object"]
        self.intersect = intersector(snapshot)
        self.camera = camera_of(scene, scene.camera, *SIZE)
        self._traced: dict[bytes, object] = {}
        self._assets: dict[tuple, object] = {}
        from ..gpu.renderer import Renderer

        renderer = Renderer(snapshot, {})
        self.ray_map = renderer.ray_map(self.camera)
        renderer.free()
        rays = self.ray_map.rays()
        self.distance = self.intersect(self.object, rays)  # (N,) m, inf = the ray passes the object
        self.rays = rays

    def crossing(self, points: int = 64) -> np.ndarray:
        """(N,) bool: rays that pass through the depth camera's frustum, told by points on them; others cost nobody anything."""
        vertices = self.snapshot.world_positions(self.object)
        low, high = vertices.min(0), vertices.max(0)
        along = ((low + high) / 2 - self.rays.origin) * self.rays.direction
        row = self.asset().images["billboard_buf"][0].astype(np.float64)
        found = np.zeros(len(self.rays), bool)
        for step in np.linspace(-1, 1, points) * np.linalg.norm(high - low) / 2:
            t = np.maximum(along.sum(1) + step, 0)[:, None]
            p = self.rays.origin + self.rays.direction * t - self.asset().uniforms["center"]
            z, x, y = (p @ row[ROW[name], :3] + row[ROW[name], 3] for name in ("plane", "u", "v"))
            hither, yon = row[ROW["limits"], :2]
            found |= (hither < z) & (z < yon) & (np.abs(x) < z) & (np.abs(y) < z)
        return found

    def asset(self, method=depth_maps, **settings):
        """The method's asset of the mirror; settings over BAKE."""
        key = (method.NAME, *sorted(settings.items()))
        if key not in self._assets:
            job = BakeJob(self.snapshot, self.reflector, self._trace, self.intersect, {**method.DEFAULTS, **BAKE, **settings})
            self._assets[key] = method.bake(job)
        return self._assets[key]

    def _trace(self, rays, hide=(), samples=1):
        key = np.float32(rays.origin).tobytes() + np.float32(rays.direction).tobytes() + repr((hide, samples)).encode()
        if key not in self._traced:
            self._traced[key] = trace(rays, hide, samples, scene=self.scene)
        return self._traced[key]

    def frame(self, asset):
        """The whole frame with this asset, to be timed."""
        from ..gpu.renderer import Renderer

        return Renderer(self.snapshot, {"": asset}).work(self.camera)

    def errors(self, kernel, asset, chosen: np.ndarray) -> np.ndarray:
        """Hit errors over the scene's diagonal of the chosen rays that meet the object, as method and mesh say."""
        rays = part(self.rays, chosen)
        answer = run_numpy(record(kernel, asset), asset, rays)
        both = (answer.status == STATUS_HIT) & np.isfinite(self.distance[chosen])
        found = np.linalg.norm(answer.position.astype(np.float64) - rays.origin, axis=1)
        return np.abs(found - self.distance[chosen])[both] / self.snapshot.diagonal()

    def edge_error(self, asset) -> float:
        """Mean distance in pixels between the outlines of the object's reflection by the method and by the mesh."""
        answer = run_numpy(record(depth_maps.trace, asset), asset, self.rays)
        mask = self.ray_map.covered()
        shown, true = (np.zeros(mask.shape, bool) for _ in range(2))
        shown[mask], true[mask] = answer.status == STATUS_HIT, np.isfinite(self.distance)
        return outline_error(shown, true)


def outline_error(shown: np.ndarray, true: np.ndarray) -> float:
    """Mean distance in pixels between the outlines of two shapes, (H, W) bool each."""
    # A digital outline is 4 / pi as long as the curve, in the mean over directions.
    outline = sum(np.count_nonzero(np.diff(true, axis=a)) for a in (0, 1)) * np.pi / 4
    return float(np.count_nonzero(shown != true) / max(outline, 1.0))


def part(rays: Rays, chosen: np.ndarray) -> Rays:
    return Rays(rays.origin[chosen], rays.direction[chosen])


def search_only(search=None):
    """A kernel that says where the ray ends and looks nothing up: what a search alone costs."""

    def kernel(k, asset, ray):
        distance, _, u, v = depth_maps.nearest(k, asset, ray, ray.origin - asset.uniforms["center"], replace(ALL, mirrors=False), search)
        return Hit(k.vec3(u, v, 0.0), ray.origin + ray.direction * distance, 1.0, k.select(distance < FAR, 1.0, 2.0))

    return kernel


def depth_scene() -> tuple[bpy.types.Scene, str]:
    """(a new file, what the object is): the object and a mirror of the same shape that faces it and just touches it, as in
    the paper's Fig 3, seen from the side."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    thing, name = bunny()
    thing.name = "Object"
    for made, metallic in ((thing, 0.0), (thing.copy(), 1.0)):
        material = bpy.data.materials.new("Mirror" if metallic else "Matt")
        shader = material.node_tree.nodes["Principled BSDF"]
        shader.inputs["Metallic"].default_value, shader.inputs["Roughness"].default_value = metallic, 1.0 - metallic
        shader.inputs["Specular IOR Level"].default_value = 0.0
        made.data = made.data.copy()
        made.data.materials.clear()
        made.data.materials.append(material)
        made.data.polygons.foreach_set("use_smooth", [True] * len(made.data.polygons))
        if metallic:
            made.name = "Mirror"
            scene.collection.objects.link(made)
            made.matrix_world = Matrix.Translation((0.2, -1.35, 0.0)) @ Matrix.Rotation(np.pi, 4, "Z") @ thing.matrix_world
    scene.world = bpy.data.worlds.new("World")
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.collection.objects.link(camera)
    camera.location = (4.5, 1.2, 0.8)
    camera.rotation_euler = (Vector((0.3, -1.2, 0.0)) - camera.location).to_track_quat("-Z", "Y").to_euler()
    camera.data.lens = 70
    scene.camera = camera
    bpy.context.view_layer.update()
    return scene, name


def bunny() -> tuple[bpy.types.Object, str]:
    """The bunny from REFLECT_SHARED or the folder beside the checkout, else Suzanne; two metres wide, at the origin."""
    beside = Path(__file__).resolve().parents[3] / "shared"
    for folder in (os.environ.get("REFLECT_SHARED"), beside):
        path = Path(folder or "") / "models" / "stanford-bunny.obj"
        if folder and path.is_file():
            bpy.ops.wm.obj_import(filepath=str(path))
            found, name = bpy.context.object, "the Stanford bunny"
            break
    else:
        bpy.ops.mesh.primitive_monkey_add()
        found, name = bpy.context.object, "Suzanne (no Stanford bunny at hand)"
        found.modifiers.new("Subdivision", "SUBSURF").render_levels = 2
        found.modifiers["Subdivision"].levels = 2
    corners = np.array([found.matrix_world @ c.co for c in found.data.vertices])
    size = 2.0 / np.ptp(corners, axis=0).max()
    middle = Matrix.Translation(tuple(-(corners.min(0) + corners.max(0)) / 2))
    found.matrix_world = Matrix.Scale(size, 4) @ middle @ found.matrix_world
    return found, name

