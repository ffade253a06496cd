"""What the targets on depth maps are measured on: one scene, its rays and assets of it.

One object stands close to a mirror ball, one depth map of it faces the mirror; the object is the Stanford bunny where it
is at hand, as in the paper, else Suzanne. Hit errors are judged by the mesh itself.
"""

import os
from pathlib import Path

import bpy
import numpy as np

from ..core.job import BakeJob
from ..core.kernel import Hit, record, run_numpy
from ..core.methods import depth_maps
from ..core.rays import Rays
from ..core.spaces import FAR, STATUS_HIT
from ..scene.camera import camera_of
from ..scene.intersect import intersector
from ..scene.raytrace import trace

SIZE = (256, 256)
BAKE = {**depth_maps.DEFAULTS, "resolution": 64, "samples": 1, "texels": 256, "maps": 1, "sky_error": 0}


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

    def near(self) -> np.ndarray:
        """(N,) bool: rays that pass through the object's bounding sphere; all others cost nobody anything."""
        low, high = self.snapshot.bounds([self.object])
        to = (low + high) / 2 - self.rays.origin
        along = (to * self.rays.direction).sum(1)
        beside = np.linalg.norm(to - self.rays.direction * along[:, None], axis=1)
        radius = np.linalg.norm(high - low) / 2
        return (beside < radius) & (along + radius > 0)

    def asset(self, method=depth_maps, **settings):
        """The method's asset of the mirror; settings over BAKE."""
        key = (method.NAME, *sorted(settings.items()))
        if key not in self._assets:
            job = BakeJob(self.snapshot, self.reflector, self._trace, self.intersect, {**BAKE, **settings})
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
        # A digital outline is 4 / pi as long as the curve, in the mean over directions.
        outline = sum(np.count_nonzero(np.diff(true, axis=a)) for a in (0, 1)) * np.pi / 4
        return float(np.count_nonzero(shown != true) / outline)


def part(rays: Rays, chosen: np.ndarray) -> Rays:
    return Rays(rays.origin[chosen], rays.direction[chosen])


def search_only(search=None):
    """A kernel that says where the ray ends and looks nothing up: what a search alone costs."""

    def kernel(k, asset, ray):
        distance, _, u, v = depth_maps.nearest(k, asset, ray, ray.origin - asset.uniforms["center"], search)
        return Hit(k.vec3(u, v, 0.0), ray.origin + ray.direction * distance, 1.0, k.select(distance < FAR, 1.0, 2.0))

    return kernel


def depth_scene() -> tuple[bpy.types.Scene, str]:
    """(a new file: mirror ball, object beside it, lamp, camera; what the object is)."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    bpy.ops.mesh.primitive_uv_sphere_add(segments=64, ring_count=32, location=(-1.75, 0, 0))
    ball = bpy.context.object
    ball.name = "Mirror"
    bpy.ops.object.shade_smooth()
    mirror = bpy.data.materials.new("Mirror")
    shader = mirror.node_tree.nodes["Principled BSDF"]
    shader.inputs["Metallic"].default_value, shader.inputs["Roughness"].default_value = 1.0, 0.0
    ball.data.materials.append(mirror)
    thing, name = _object()
    thing.name = "Object"
    matt = bpy.data.materials.new("Matt")
    matt.node_tree.nodes["Principled BSDF"].inputs["Roughness"].default_value = 1.0
    matt.node_tree.nodes["Principled BSDF"].inputs["Specular IOR Level"].default_value = 0.0
    thing.data.materials.clear()
    thing.data.materials.append(matt)
    world = bpy.data.worlds.new("World")
    scene.world = world
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.collection.objects.link(camera)
    camera.location, camera.rotation_euler = (1.6, -4.6, 0.6), (np.radians(83), 0, np.radians(36))
    camera.data.lens = 85
    scene.camera = camera
    return scene, name


def _object() -> tuple[bpy.types.Object, str]:
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
    found.location = tuple(-size * (corners.min(0) + corners.max(0)) / 2)
    found.scale = tuple(size * s for s in found.scale)
    return found, name

