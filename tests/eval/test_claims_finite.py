"""Issue 2: nothing that is not a finite number in any buffer: every sample, every method, at scales from a millimetre
to ten kilometres, with the camera inside the reflector, on an edge of it, a million diagonals away, and orthographic.

Bakes are tiny: what counts here is that numbers stay numbers, not that they are right. By default each scale is tried, the
smallest and the largest both in the open and between walls; every sample at every scale, and MANY at all, is slow.
"""

import itertools
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import bpy
import numpy as np
import pytest
from mathutils import Matrix

from reflect_addon.core import methods as registry
from reflect_addon.core.camera import Camera
from reflect_addon.core.look import Look
from reflect_addon.core.metrics import nonfinite
from reflect_addon.core.snapshot import SceneSnapshot
from reflect_addon.evaluation.backends import GpuBackend, NumpyBackend
from reflect_addon.evaluation.frame import open_frame
from reflect_addon.gpu.renderer import Renderer
from reflect_addon.scene.bake import bake_assets
from reflect_addon.scene.camera import camera_of
from reflect_addon.scene.load import load_assets
from reflect_addon.scene.look import read_look
from reflect_addon.scene.raytrace import trace

SAMPLES = Path(__file__).resolve().parents[2] / "sample_blends"
NAMES = ("teapots", "columns", "contact", "kitchen")
OPEN = ("teapots", "contact")
MANY = "kitchen"  # of 34 reflectors
SCALES = (1e-3, 1.0, 1e4)
COVERING = {("teapots", 1e4), ("contact", 1e-3), ("columns", 1e4), ("columns", 1e-3), ("columns", 1.0)}
SETTINGS = {"resolution": 16, "samples": 1, "texels": 8, "sky_error": 0, "maps": 1, "turns": 6,
            "views": 4, "view_texels": 16, "map_texels": 16, "surface_samples": 1, "surface_tolerance": 0.5, "surface_levels": 2,
            "surface_triangles": 4000, "surface_noise": 0.0}
WIDTH, HEIGHT = 32, 24
# Reflectors that are baked; the first one's assets answer for the others. Each costs three traces.
BAKED = 2
# Cameras whose rays NumPy finds itself, and answers. Those of the others it answers as the GPU found them.
WITHOUT_GPU = ("inside", "on an edge", "at infinity, through a telescope", "orthographic")


@dataclass(frozen=True)
class Baked:
    snapshot: SceneSnapshot
    cameras: dict[str, Camera]
    open: bool  # no walls: what is far away sees the reflectors
    assets: dict[str, dict]  # method -> reflector -> asset
    look: Look


def every_scene() -> list:
    marks = {case: () if case in COVERING else pytest.mark.slow for case in itertools.product(NAMES, SCALES)}
    return [pytest.param(case, marks=mark, id=f"{case[0]}-{case[1]:g}") for case, mark in marks.items()]


@pytest.fixture(scope="module", params=every_scene())
def baked(request, device, tmp_path_factory):
    name, scale = request.param
    bpy.ops.wm.open_mainfile(filepath=str(SAMPLES / f"{name}.blend"))
    scene = bpy.context.scene
    scale_scene(scene, scale)
    folder = tmp_path_factory.mktemp("finite")
    with open_frame(scene, None) as snapshot:
        by_size = sorted(snapshot.reflectors(), key=lambda i: float(np.ptp(snapshot.world_positions(i), axis=0).max()))
        chosen = [by_size[-1].name, by_size[0].name][:BAKED]
        bake_assets(
            snapshot, registry.names(), folder, reflectors=chosen, settings=SETTINGS, tracer=partial(trace, scene=scene)
        )
        assets = {}
        for method in registry.names():
            assets[method] = load_assets(snapshot, method, folder)
            assert set(assets[method]) == set(chosen)
            assets[method][""] = assets[method][chosen[0]]
        cameras = {"scene": camera_of(scene, None, WIDTH, HEIGHT), **cameras_about(snapshot, by_size[-1])}
        scene.camera.data.type, scene.camera.data.ortho_scale = "ORTHO", 0.5 * snapshot.diagonal()
        cameras["orthographic"] = camera_of(scene, None, WIDTH, HEIGHT)
        return Baked(snapshot, cameras, name in OPEN, assets, read_look(scene))


def scale_scene(scene, scale: float) -> None:
    """The same picture of a scene of another size: objects, what the camera clips, lamps' power."""
    for thing in scene.objects:
        thing.animation_data_clear()
    bpy.context.view_layer.update()
    for thing in [o for o in scene.objects if o.parent is None]:
        thing.matrix_world = Matrix.Scale(scale, 4) @ thing.matrix_world
        if thing.type == "LIGHT":
            thing.data.energy *= scale**2
        if thing.type == "CAMERA":
            thing.data.clip_start *= scale
            thing.data.clip_end *= scale
    bpy.context.view_layer.update()


def cameras_about(snapshot: SceneSnapshot, reflector) -> dict[str, Camera]:
    low, high = snapshot.bounds([reflector])
    center, size, diagonal = (low + high) / 2, float((high - low).max()), snapshot.diagonal()
    positions = snapshot.world_positions(reflector)
    a, b, _ = positions[snapshot.meshes[reflector.mesh].triangles[0]]
    edge, away = (a + b) / 2, np.array([0.3, -1.0, 0.4])
    far = center + away / np.linalg.norm(away) * 2e6 * diagonal
    return {
        "inside": perspective(center, center + away * size, 1.0, 1e-3 * size, 10 * diagonal),
        "on an edge": perspective(edge, center + away * 0.1 * size, 1.0, 1e-3 * size, 10 * diagonal),
        "at infinity": perspective(far, center, 0.7, 1e5 * diagonal, 1e7 * diagonal),
        "at infinity, through a telescope": perspective(far, center, size / diagonal / 2e6, 1e5 * diagonal, 1e7 * diagonal),
    }


def perspective(eye, target, half_tangent: float, near: float, far: float) -> Camera:
    clip = np.zeros((4, 4))
    clip[0, 0], clip[1, 1] = 1 / half_tangent, WIDTH / HEIGHT / half_tangent
    clip[2, 2:], clip[3, 2] = (-(far + near) / (far - near), -2 * far * near / (far - near)), -1
    return Camera(looking(eye, target), clip, WIDTH, HEIGHT)


def looking(eye, target) -> np.ndarray:
    back = (np.asarray(eye) - target) / np.linalg.norm(np.asarray(eye) - target)
    right = np.cross([0, 0, 1.0], back)
    right /= np.linalg.norm(right)
    out = np.eye(4)
    out[:3, :3], out[:3, 3] = np.stack([right, np.cross(back, right), back], -1), eye
    return out


def sees(baked: Baked, name: str) -> bool:
    """Whether a view must show a reflector; from infinity the whole scene is less than a pixel."""
    return name in ("scene", "inside", "orthographic") or baked.open and name == "at infinity, through a telescope"


@pytest.mark.parametrize("method", registry.names())
def test_every_buffer_is_finite(baked, method):
    assets = baked.assets[method]
    renderer = Renderer(baked.snapshot, assets, baked.look)
    for name, camera in baked.cameras.items():
        rays = renderer.ray_map(camera)
        assert nonfinite(rays.origin, rays.direction, rays.normal, rays.width, rays.spread) == 0, name
        answer = renderer.answer(camera)
        assert nonfinite(answer.radiance, answer.coverage, answer.position, answer.status) == 0, name
        picture = renderer.picture(camera, np.full((HEIGHT, WIDTH, 3), 0.5, np.float32))
        display = renderer.picture(camera, None, "display")
        assert nonfinite(picture, display) == 0, name
        seen = rays.covered()
        assert answer.coverage[seen].min(initial=1) == 1, name
        if sees(baked, name):
            assert seen.sum() > 0, name
            if name != "inside":  # the mirror may lie against a wall, and what is behind it in the dark
                assert answer.radiance[seen].max() > 0 and display[seen][:, :3].max() > 0, name
        for backend in (GpuBackend,) if name in WITHOUT_GPU else (GpuBackend, NumpyBackend):
            single = backend(baked.snapshot, assets, baked.look, camera, rays).answer()
            assert nonfinite(single.radiance, single.coverage, single.position, single.status) == 0, (name, backend)
            assert len(single.coverage) == seen.sum() and single.coverage.min(initial=1) == 1, (name, backend)
    renderer.free()


def test_the_default_choice_covers_what_it_says():
    assert {name for name, _ in COVERING} == set(NAMES) - {MANY} and {scale for _, scale in COVERING} == set(SCALES)
    for scale in (min(SCALES), max(SCALES)):
        assert {name in OPEN for name, s in COVERING if s == scale} == {True, False}


def test_the_ray_map_without_a_gpu_is_finite(baked):
    for name in WITHOUT_GPU:
        camera = baked.cameras[name]
        rays = NumpyBackend.ray_map(baked.snapshot, camera)
        assert nonfinite(rays.origin, rays.direction, rays.normal) == 0, name
        if sees(baked, name):
            assert rays.covered().sum() > 0, name
        for method, assets in baked.assets.items():
            answer = NumpyBackend(baked.snapshot, assets, baked.look, camera, rays).answer()
            assert nonfinite(answer.radiance, answer.coverage, answer.position) == 0, (name, method)
