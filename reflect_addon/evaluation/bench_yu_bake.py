"""What baking a light field costs beside a plain Cycles render: seconds a camera path, in this process, one after the other.

The plain render is of the same scene by its own camera, with as many paths a pixel as the slab has a texel, and as many pixels
as the slab has rays, within a row: the same sampling, without denoising, passes or files. Both are asked for in turns.
"""

from dataclasses import dataclass
from functools import partial
from time import perf_counter

import bpy
import numpy as np

from ..core.job import BakeJob
from ..core.light_field_slab import bake_slab
from ..core.light_field_trace import SlabTracer
from ..core.methods import light_field
from ..scene.intersect import intersector
from ..scene.raytrace import trace
from ..scene.ways import ways
from .bench_row import row
from .frame import open_frame

TURNS = 5
MOST = 1.3
FACE = 2  # the slab +Y: what the room's back wall with its pictures is in
# (views, texels, samples): the defaults, and one path a texel as for 32 views (a part of these: a slab of 8 views is one bundle).
KINDS = {"I4-bake": (8, 128, 4), "I4-bake-one-path": (8, 128, 1)}
ASPECT = 4 / 3


@dataclass(frozen=True)
class Pair:
    """Seconds a path of the slab's bake and of the plain render, by turn."""

    slab: np.ndarray
    plain: np.ndarray
    rays: int

    def ratio(self) -> float:
        return float(np.median(self.slab / self.plain))


def measure(scene: bpy.types.Scene) -> list[dict]:
    """Rows for targets.json."""
    rows = []
    for name, (views, texels, samples) in KINDS.items():
        pair = timed(scene, views, texels, samples)
        ratio = pair.ratio()
        rows.append(row(
            name, ratio, MOST, ratio <= MOST,
            f"Seconds a camera path of baking a slab ({pair.rays:,} rays, {samples} paths each) over a plain Cycles render of columns with as many "
            f"pixels and paths, median of {TURNS} turns: {np.median(pair.slab) * 1e6:.2f} and {np.median(pair.plain) * 1e6:.2f} us.",
        ))  # fmt: skip
    return rows


def timed(scene: bpy.types.Scene, views: int, texels: int, samples: int) -> Pair:
    """One slab of the scene's only reflector, and plain renders."""
    slab, plain, rays = [], [], 0
    asked = {**light_field.DEFAULTS, "views": views, "view_texels": texels, "samples": samples}
    with open_frame(scene, None) as snapshot:
        (reflector,) = snapshot.reflectors()
        job = BakeJob(snapshot, reflector, partial(trace, scene=scene), intersector(snapshot), asked, bounds=ways(snapshot))
        cell, reach = light_field.plan(job)
        for _ in range(TURNS):
            start = perf_counter()
            wanted = {FACE: reach.of(FACE)}
            _, made = bake_slab(cell, FACE, wanted[FACE], SlabTracer(job, cell, wanted))
            rays = int(made[0])
            slab.append((perf_counter() - start) / (rays * samples))
            plain.append(plain_render(scene, rays, samples))
    return Pair(np.array(slab), np.array(plain), rays)


def plain_render(scene: bpy.types.Scene, pixels: int, samples: int) -> float:
    """Seconds a path of a render by the scene's own camera."""
    copy = scene.copy()
    try:
        height = round((pixels / ASPECT) ** 0.5)
        copy.render.resolution_x, copy.render.resolution_y, copy.render.resolution_percentage = pixels // height, height, 100
        copy.render.engine, copy.cycles.device, copy.cycles.samples = "CYCLES", "CPU", samples
        copy.cycles.use_adaptive_sampling = copy.cycles.use_denoising = copy.cycles.use_auto_tile = False
        copy.render.use_compositing = copy.render.use_sequencer = False
        start = perf_counter()
        bpy.ops.render.render(scene=copy.name)
        return (perf_counter() - start) / (copy.render.resolution_x * copy.render.resolution_y * samples)
    finally:
        copy.render.use_persistent_data = False  # or the engine would outlive its scene, see scene/ray_scene.py
        bpy.data.scenes.remove(copy)
