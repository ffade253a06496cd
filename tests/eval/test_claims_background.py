"""The background from light-field slabs against Cycles' own picture, beside what an environment map asked the same way shows."""

import bpy
import pytest
import scenes
from tolerances import BACKGROUND_RMSE

from reflect_addon.core import metrics
from reflect_addon.core.rays import Rays


@pytest.mark.parametrize("depth", [True, False])
def test_a_room_seen_from_inside_it(fresh_file, device, tmp_path, depth):
    """Sides that only glow: one path is the truth. The environment is captured at the ball, where the camera is not."""
    from reflect_addon.evaluation.frame import open_frame
    from reflect_addon.gpu.renderer import Renderer
    from reflect_addon.scene.bake import bake_assets
    from reflect_addon.scene.camera import camera_of
    from reflect_addon.scene.load import load_assets
    from reflect_addon.scene.raytrace import trace

    scenes.sphere_in_box_room()
    scene = bpy.context.scene
    asked = {"views": 8, "view_texels": 64, "samples": 1, "depth": depth, "cameras": True, "resolution": 256}
    with open_frame(scene, None) as snapshot:
        bake_assets(snapshot, ("environment", "light_field"), tmp_path, settings=asked)
        camera = camera_of(scene, None, 96, 72)
        answers = {}
        for method in ("environment", "light_field"):
            assets = load_assets(snapshot, method, tmp_path)
            renderer = Renderer(snapshot, assets)
            answers[method] = renderer.answer(camera, False, next(iter(assets.values())))
            behind = ~renderer.ray_map(camera).covered()
            renderer.free()
        rays = camera.primary_rays()
        rays = Rays(*(v.reshape(72, 96, 3)[behind] for v in (rays.origin, rays.direction)))
        truth = trace(rays, hide=("Mirror",), samples=1).radiance
    error = {method: metrics.rmse(found.radiance[behind], truth) for method, found in answers.items()}
    assert behind.mean() > 0.5 and (answers["light_field"].coverage[behind] == 1).all()
    assert error["light_field"] < BACKGROUND_RMSE[depth] * error["environment"], error
