"""Target P10 of popescu-2006: no limit on billboards or on points a row, where the paper has 17 intersections and m = 16.

Answers are the shader's, judged by Cycles (256 flat squares around a ball) and by the mesh (a depth map with m = 64).
"""

import numpy as np

from ..core.kernel import counted
from ..core.methods import billboards, depth_maps
from ..core.rays import Rays
from ..core.spaces import STATUS_HIT
from ..scene.raytrace import trace
from . import bench_mirrors_scene as scenes
from .bench_row import row

RINGS = 8  # of squares, one above the other
SQUARES = 256
EVERY = 5  # which of the ball's pixels has its ray answered
POINTS = 64
RIGHT = 1e-3  # hit error over the diagonal, 95 %
LOST = 0.01  # share of rays that miss what is there or meet what is not: a texel at the squares' edges


def measure(progress) -> list[dict]:
    """Rows for targets.json."""
    from ..gpu.fill import RayBundle

    progress(0.0, f"popescu: {SQUARES} billboards")
    scene = many_squares()
    frame = scenes.baked(scene)
    ((_, asset),) = frame.assets[billboards.NAME].items()
    seen = frame.rays_of("Ball 0")
    rays = Rays(seen.origin[::EVERY], seen.direction[::EVERY])
    bundle = RayBundle(rays)
    truth = trace(rays, ("Ball 0",), 1, scene=scene)
    answer = bundle.answer(asset, billboards.trace)
    steps = bundle.answer(asset, counted(billboards.trace)).radiance[:, 0]
    met = answer.status == STATUS_HIT
    both = met & truth.hit
    off = np.linalg.norm(answer.position[both] - truth.position[both], axis=1) / frame.snapshot.diagonal()
    error, lost = float(np.percentile(off, 95)), float(np.mean(met != truth.hit))
    what = f"{SQUARES} squares around a mirror ball, {len(rays)} rays, {both.sum()} of them meet one"
    count = int(steps.min())
    return [
        row("P10", count, SQUARES, count == steps.max() == SQUARES,
            f"Intersections of every ray, counted by the shader: {what}. The paper: at most 17.", paper=17),
        row("P10-right", [error, lost], [RIGHT, LOST], error <= RIGHT and lost <= LOST,
            f"Hit error over the diagonal, 95 %, and share of rays that miss a square or meet none: {what}."),
    ]  # fmt: skip


def many_points(bench) -> dict:
    """The row on m; bench: bench_depth_scene.Bench."""
    from ..gpu.fill import RayBundle

    chosen = bench.crossing()
    rays = Rays(bench.rays.origin[chosen], bench.rays.direction[chosen])
    true = bench.distance[chosen]
    errors = []
    for points in (16, POINTS):
        answer = RayBundle(rays).answer(bench.asset(points=points, refine=False), depth_maps.trace)
        both = (answer.status == STATUS_HIT) & np.isfinite(true)
        found = np.linalg.norm(answer.position.astype(np.float64) - rays.origin, axis=1)
        errors.append(float(np.median(np.abs(found - true)[both]) / bench.snapshot.diagonal()))
    return row(
        "P10-points", errors[1], errors[0], errors[1] <= errors[0],
        f"Median hit error over the diagonal with m = {POINTS}, against m = 16 (the paper's most), {len(rays)} rays, by the shader.",
    )  # fmt: skip


def many_squares():
    """A new file: a mirror ball among SQUARES flat squares that face it, on RINGS rings."""
    scene = scenes.balls(1, things=0)
    each = SQUARES // RINGS
    for i in range(SQUARES):
        ring, place = i % RINGS, i // RINGS
        angle = 2 * np.pi * (place + 0.5 * (ring % 2)) / each
        scenes.square(i, (6 * np.cos(angle), 6 * np.sin(angle), 1.1 * (ring - 2)), angle, 0.9)
    scene.camera.location, scene.camera.data.lens = (0.0, -4.5, 8.0), 110
    scenes.bpy.context.view_layer.update()
    return scene
