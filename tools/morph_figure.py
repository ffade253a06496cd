"""The ground's morph in pictures (popescu-2006, Figs. 6 and 7): a mirror teapot on a chequered ground that goes on.

    ./dev python tools/morph_figure.py OUT_FOLDER [--size WxH] [--ground METRES]

Writes without.png (the ground's quad ends in the environment map), with.png (the morph), automatic.png (the box's size
from the parallax), truth.png (Cycles), and prints each one's error.
"""

import argparse
import math
import sys
import tempfile
from functools import partial
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))


import bpy  # noqa: E402, F401  the pip module makes mathutils known

from reflect_addon.core import metrics  # noqa: E402
from reflect_addon.core.kernel import record, run_numpy  # noqa: E402
from reflect_addon.core.methods import billboards, environment  # noqa: E402
from reflect_addon.evaluation import ground_quads  # noqa: E402
from reflect_addon.evaluation.backends import GpuBackend  # noqa: E402
from reflect_addon.evaluation.frame import open_frame  # noqa: E402
from reflect_addon.evaluation.png import write_png  # noqa: E402
from reflect_addon.evaluation.truth import lifted  # noqa: E402
from reflect_addon.scene.bake import bake_assets, load_assets  # noqa: E402
from reflect_addon.scene.camera import camera_of  # noqa: E402
from reflect_addon.scene.look import read_look  # noqa: E402
from reflect_addon.scene.raytrace import trace  # noqa: E402
from sample_blends import build_teapots, scene_parts as parts  # noqa: E402

HALF = 100.0  # m, of the ground: beyond it the world's own


def build():
    """The teapots' ground and world, one teapot, and posts that stay in the environment map's distance."""
    scene = parts.start("morph")
    parts.set_world_image(scene, build_teapots.small_world(build_teapots.WORLD), turn=math.radians(200))
    vertices, faces = build_teapots.tessellate(8)
    surface = parts.checker("Chequered ground", (0.75, 0.72, 0.66), (0.12, 0.2, 0.3), 0.25)
    corners = [(-HALF, -HALF, 0), (HALF, -HALF, 0), (HALF, HALF, 0), (-HALF, HALF, 0)]
    parts.mesh("Ground", corners, [(0, 1, 2, 3)], surface, smooth=False)
    silver = parts.mirror("Silver", (0.93, 0.93, 0.92))
    parts.mesh("Teapot", vertices * build_teapots.SCALE, faces, silver, rotation=(0, 0, math.radians(200)))
    parts.camera((0.1, -0.85, 0.36), (0.0, 0.0, 0.14), lens=45)
    return scene


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("out", type=Path)
    parser.add_argument("--size", default="480x360")
    parser.add_argument("--ground", type=float, default=1.2, help="width of the small box, m")
    arguments = parser.parse_args()
    size = tuple(int(part) for part in arguments.size.split("x"))
    scene = build()
    with tempfile.TemporaryDirectory(prefix="reflect-morph-") as folder, open_frame(scene, None) as snapshot:
        camera, look = camera_of(scene, None, *size), read_look(scene)
        assets = {}
        for name, width in (("small", arguments.ground), ("automatic", 0.0)):
            settings = {"samples": 16, "resolution": 512, "ground_size": width}
            bake_assets(snapshot, ("billboards",), Path(folder) / name, settings=settings, tracer=partial(trace, scene=scene))
            ((_, assets[name]),) = load_assets(snapshot, "billboards", Path(folder) / name).items()
        ray_map = GpuBackend.ray_map(snapshot, camera)
        rays = lifted(ray_map, snapshot.diagonal())
        truth = trace(rays, samples=64, seed=1, scene=scene)
        frame = trace(camera.primary_rays(), samples=64, seed=1, scene=scene).radiance.reshape(*size[::-1], 3)
    small, automatic = ground_quads.alone(assets["small"]), ground_quads.alone(assets["automatic"])
    only = ground_quads.ground_alone(assets["small"])
    mask = ray_map.covered()
    arguments.out.mkdir(parents=True, exist_ok=True)
    for name, asset, kernel in (
        ("environment", small, environment.trace), ("without", only, ground_quads.trace),
        ("with", small, billboards.trace), ("automatic", automatic, billboards.trace), ("truth", None, None),
    ):  # fmt: skip
        answer = run_numpy(record(kernel, asset), asset, rays) if asset else None
        radiance = answer.radiance if asset else truth.radiance
        picture = frame.copy()
        picture[mask] = radiance * 0.93
        write_png(arguments.out / f"{name}.png", look.apply(picture))
        if asset:
            found = metrics.hit_errors(answer, truth, rays, 1.0)
            print(f"{name}: relmse {metrics.relmse(radiance, truth.radiance):.4f}, angle p50 {found.angle_p50:.3f} p95 {found.angle_p95:.3f} degrees")


if __name__ == "__main__":
    main()
