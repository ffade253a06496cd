"""evaluation/bench_ground.py, the tool of Figs. 6 and 7: a ground in a real file, through Cycles, the bake and the GPU."""

from functools import partial

import bpy
import numpy as np
import scenes
from claims import measure
from tolerances import GROUND_HIT

from sample_blends import scene_parts as parts


def ball_on_a_plain(half=200.0):
    scene = parts.prepare(bpy.context.scene, "plain")
    parts.set_world(scene, (0.3, 0.4, 0.6))
    corners = [(-half, -half, 0), (half, -half, 0), (half, half, 0), (-half, half, 0)]
    parts.mesh("Ground", corners, [(0, 1, 2, 3)], scenes.glowing_checker("Ground", (0.8, 0.7, 0.6), (0.1, 0.2, 0.3), 0.25), smooth=False)
    parts.sphere("Mirror", 0.3, parts.mirror(colour=(1, 1, 1)), 96, location=(0.4, -0.2, 0.3))
    parts.camera((0.4, -2.0, 0.7), (0.4, -0.2, 0.3), lens=50)


def test_a_ground_in_a_file(fresh_file, device, tmp_path):
    ball_on_a_plain()
    found = measure(("environment", "billboards"), tmp_path, settings={"samples": 1})
    on_ground = found.truth.hit & (np.linalg.norm(found.truth.position - found.rays.origin, axis=1) < 20)
    # The truth's rays start a share of the scene's diagonal off the mirror, 5 mm here; these are the methods' own rays.
    own = found.ray_map.rays()
    plane = own.origin - own.direction * (own.origin[:, 2] / own.direction[:, 2])[:, None]
    apart = {}
    for method in ("environment", "billboards"):
        apart[method] = np.median(np.linalg.norm(found.answers[method].position - plane, axis=1)[on_ground])
    assert on_ground.sum() > 400 and apart["billboards"] < GROUND_HIT * apart["environment"]
    assert found.rmse("billboards") < 0.6 * found.rmse("environment"), "checks' edges are a texel wide in either"


def test_five_quads_and_the_box_are_one_picture_on_the_gpu(fresh_file, device, tmp_path):
    """What P20 times: bench_ground's own scene."""
    from reflect_addon.core.methods import billboards
    from reflect_addon.evaluation import bench_ground, bench_popescu, ground_quads
    from reflect_addon.evaluation.frame import open_frame
    from reflect_addon.gpu.renderer import Renderer
    from reflect_addon.scene.bake import bake_assets
    from reflect_addon.scene.camera import camera_of
    from reflect_addon.scene.load import load_assets
    from reflect_addon.scene.raytrace import trace

    scene = bench_ground.plain()
    with open_frame(scene, None) as snapshot:
        bake_assets(snapshot, ("billboards",), tmp_path, settings=bench_popescu.BAKE, tracer=partial(trace, scene=scene))
        ((name, asset),) = load_assets(snapshot, "billboards", tmp_path).items()
        assert asset.options["ground"]
        camera = camera_of(scene, scene.camera, 64, 64)
        pairs = (ground_quads.alone(asset), billboards.trace), (ground_quads.five_quads(asset), ground_quads.trace)
        answers = [Renderer(snapshot, {name: a}, kernel=lambda _, kernel=kernel: kernel).answer(camera) for a, kernel in pairs]
    box, quads = answers
    assert 0.2 < np.mean(box.status == 1.0) < 0.8
    assert np.mean(np.abs(box.radiance - quads.radiance).max(-1) > 1e-3) < 1e-3
