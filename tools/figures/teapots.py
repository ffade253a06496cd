"""Fig 1: four teapots that mirror each other, the sample `teapots`."""

from functools import partial
from pathlib import Path

import bpy
import numpy as np

from reflect_addon.core.mirrors import second_order_pairs

from .shot import Shot
from .studio import Figure, Studio

SAMPLES = Path(__file__).resolve().parents[2] / "sample_blends"
BAKE = {"resolution": 128, "samples": 8, "texels": 128}
DEPTH = {**BAKE, "maps": 2}  # what the others would add is little and takes minutes


def sample(name: str) -> bpy.types.Scene:
    """A sample scene, opened."""
    bpy.ops.wm.open_mainfile(filepath=str(SAMPLES / f"{name}.blend"), load_ui=False)
    return bpy.context.scene


build = partial(sample, "teapots")


def fig1(studio: Studio) -> Figure:
    rows, table, pairs = mirrors_compared(studio, studio.shot(build), BAKE, DEPTH)
    words = f"{pairs} second-order reflections, R (R - 1) for R = 4."
    return Figure(
        "Fig 1: four inter-reflecting teapots",
        f"{words} The paper: 12. A teapot in a teapot shows the ground, the world and (from order three on) no more teapots: "
        "the environment map has no teapots at all, billboards are flat, depth maps have the shape.",
        [("fig01.png", studio.sheet(rows, words))],
        table,
    )


def mirrors_compared(studio: Studio, shot: Shot, bake: dict, depth: dict):
    """(strips, a close-up of mirrors in mirrors below them; rows of numbers; how many mirrors see one). depth: settings of
    depth_maps, bake: of the others."""
    shown = [
        (name, shot.answer(shot.assets(name, **settings)))
        for name, settings in (("environment", bake), ("billboards", bake), ("depth_maps", depth))
    ]
    rows, table = studio.compared(shot, shown)
    close = studio.close_up(shot, meets_a_mirror(shot), rows, shown)
    return [*rows, close], table, len(second_order_pairs(shot.snapshot))


def meets_a_mirror(shot: Shot) -> np.ndarray:
    """(H, W) bool: rays that meet another reflector first."""
    hits, names = shot.truth, [i.object_name for i in shot.snapshot.reflectors()]
    own = np.array(names)[shot.ray_map.reflector[shot.mask]]
    met = np.array([*hits.object_names, ""])[hits.object]
    out = np.zeros(shot.mask.shape, bool)
    out[shot.mask] = hits.hit & np.isin(met, names) & (met != own)
    return out
