"""Curved mirrors in planar ones and planar ones in curved: scene (d), live cube maps and one view each against an environment map, Cycles as truth.

"Every point on an environment mapped surface sees the exact same surroundings regardless of its position": here the map knows how far
everything is, and its rays are mirrored where mirrors are (core/live_maps.py). The target is the frame's as it is drawn, whose footprints blur what
is finer than a pixel, and that counts in full against single rays. Its rays without footprints, as evaluate.py has those of methods that gather and as
environment is asked here, are a row of their own: they say what geometry does, and are no substitute. Nor are pixels against pixels, both methods as drawn and
Cycles' rays averaged over each, though that is the fair measure of a picture: a frame without any error has 0.48 of environment's RMSE against single rays.
"""

from pathlib import Path

import bpy
import numpy as np

from ..core import metrics, pixel_rays
from ..core.methods import environment
from ..core.processes import temporary_folder
from ..core.spaces import STATUS_HIT
from ..scene.raytrace import trace
from .assets import baked_in
from .backends import GpuBackend
from .bench_nielsen_drawn import drawn
from .bench_row import row
from .judged import judge
from .truth import lifted

SIZE, SAMPLES = (256, 192), 8
BAKE = {"samples": 16, "resolution": 64, "surface_samples": 16, "surface_levels": 5}
HALF = 0.5
NEAR = 5e-3  # m: a hit is on a mirror's surface
SUB, SUB_SAMPLES = 4, 2  # rays of a pixel along a side, and paths of each, of pixels as Cycles averages them


def measure(progress) -> list[dict]:
    """Rows for targets.json."""
    progress(0.0, "nielsen: baking mirrors_d")
    with temporary_folder("reflect-bench-") as folder:
        scene = drawn("mirrors_d", SIZE, Path(folder), BAKE)
        progress(0.5, "nielsen: the truth of mirrors_d")
        judged = judge(bpy.context.scene, scene.snapshot, SIZE, Path(folder), None, SAMPLES, "gpu", lambda share, text: None)
        plain = baked_in(Path(folder) / scene.name, scene.snapshot, environment.NAME)
        return _errors(scene, judged, plain.assets, _pixels(scene, judged))


def _pixels(scene, judged) -> np.ndarray:
    """(N, 3) radiance of the covered pixels, the mean of Cycles' rays all over each, as far as they leave the same reflector."""
    ray_map = judged.ray_map
    fine = GpuBackend.ray_map(scene.snapshot, judged.camera.finer(SUB))
    rays = np.zeros((*fine.covered().shape, 4))
    rays[fine.covered(), :3] = trace(lifted(fine, judged.diagonal), scene=bpy.context.scene, samples=SUB_SAMPLES).radiance
    rays[..., 3] = 1.0
    rays[fine.reflector != ray_map.reflector.repeat(SUB, 0).repeat(SUB, 1)] = 0.0
    height, width = ray_map.covered().shape
    total = rays.reshape(height, SUB, width, SUB, 4).sum((1, 3))[ray_map.covered()]
    return total[:, :3] / np.maximum(total[:, 3:], 1.0)


def _errors(scene, judged, plain, pixels) -> list[dict]:
    mask, truth = judged.ray_map.covered(), judged.truth.hits
    flat = GpuBackend(scene.snapshot, plain, judged.look, judged.camera, judged.ray_map).answer().radiance
    live, gathered = scene.renderer(curved=True, maps_per_frame=100), scene.renderer(curved=False)
    live.settle(scene.camera)
    shown = [flat, *(renderer.answer(scene.camera, footprints=False).radiance[mask] for renderer in (live, gathered))]
    shown.append(live.answer(scene.camera).radiance[mask])
    curved = live.mirrors.maps.curved
    from ..gpu.renderer import Renderer

    by_direction = Renderer(scene.snapshot, plain)
    shown_flat = by_direction.answer(scene.camera).radiance[mask]
    by_direction.free()
    live.free(), gathered.free()
    viewing = scene.renderer(curved_views=True)
    viewed = viewing.answer(scene.camera, footprints=False)
    viewing.free()
    shown.append(viewed.radiance[mask])
    on_curved = np.isin(judged.ray_map.reflector[mask], [c.reflector for c in curved])
    at = truth.position.astype(np.float64)
    meets_curved = np.any([np.linalg.norm(at - c.center, axis=1) < c.radius + NEAR for c in curved], axis=0)
    meets_planar = truth.hit & (np.abs(at).min(-1) < NEAR)  # (d)'s mirrors are the planes of the axes
    chosen = {"all": np.ones(len(at), bool), "curved in planar": ~on_curved & meets_curved, "planar in curved": on_curved & meets_planar}
    errors = {name: [metrics.rmse(radiance[which], truth.radiance[which]) for radiance in shown] for name, which in chosen.items()}
    averaged = {name: [metrics.rmse(radiance[which], pixels[which]) for radiance in (shown_flat, shown[3])] for name, which in chosen.items()}
    rays_sent = pixel_rays.of_ray_map(judged.ray_map, pixel_rays.MOST)["rays"]
    noise = metrics.rmse(judged.truth.second_radiance, truth.radiance)
    frame, rays = ([e[which] / e[0] for e in errors.values()] for which in (3, 1))
    told = "; ".join(
        f"{name} {e[1]:.3f} over {e[0]:.3f}, {e[2]:.3f} by distance maps as baked, {e[3]:.3f} in the frame as drawn, {chosen[name].sum()} px"
        for name, e in errors.items()
    )
    drawn = viewed.status[mask][on_curved] == STATUS_HIT
    by_view, by_map = (metrics.rmse(one[on_curved][drawn], truth.radiance[on_curved][drawn]) for one in (shown[4], shown[1]))
    views = [e[4] / e[0] for e in errors.values()]
    return [
        row("N-curved-rmse", frame, [HALF] * len(frame), max(frame) <= HALF,
            f"RMSE of radiance in mirrors_d by live cube maps, the frame as drawn, over environment's, {SIZE[0]}x{SIZE[1]}: {told}; between two truths {noise:.3f}."),
        row("N-curved-rays", rays, None, True, f"The same of rays without footprints on both sides, {', '.join(errors)}."),
        row("N-curved-pixels", [a[1] / a[0] for a in averaged.values()], None, True,
            f"The same of pixels, both frames as drawn, against Cycles' averaged over each: {', '.join(f'{name} {a[1]:.3f} over {a[0]:.3f}' for name, a in averaged.items())}. "
            f"As a window draws: one ray a pixel. In a picture one of the ball sends {rays_sent[on_curved].mean():.2f} rays, another {rays_sent[~on_curved].mean():.2f}."),
        row("N-curved-views-rmse", views, None, True,
            f"The same by one view of each curved mirror for each picture that shows it, {', '.join(errors)}. It shows {100 * drawn.mean():.0f} % of the "
            f"ball's pixels, the rest is by distance maps as baked: RMSE there {by_view:.3f}, by live cube maps {by_map:.3f}."),
    ]  # fmt: skip
