"""Fig 1: four teapots that mirror each other, the sample `teapots`."""

from functools import partial
from pathlib import Path

import bpy
import numpy as np

from reflect_addon.core.mirrors import second_order_pairs

from .sheet import Panel
from .shot import Shot
from .studio import Figure, Studio, busiest, magnified, outlined, up

SAMPLES = Path(__file__).resolve().parents[2] / "sample_blends"
BAKE = {"resolution": 256, "samples": 16, "texels": 128}


def sample(name: str) -> bpy.types.Scene:
    """A sample scene, opened."""
    bpy.ops.wm.open_mainfile(filepath=str(SAMPLES / f"{name}.blend"), load_ui=False)
    return bpy.context.scene


build = partial(sample, "teapots")


def fig1(studio: Studio) -> Figure:
    shot = studio.shot(build)
    shown = [(name, shot.answer(shot.assets(name, **BAKE))) for name in ("environment", "billboards", "depth_maps")]
    rows, table = studio.compared(shot, shown)
    window = busiest(meets_a_mirror(shot), (studio.size[0] // 4, studio.size[1] // 4))
    rows[0][0] = Panel(rows[0][0].title, up(outlined(shot.picture(shot.truth), window)), rows[0][0].detail)
    close = [Panel("truth, close up", magnified(shot.picture(shot.truth), window, studio.size), "the frame above, 4 times")]
    close += [Panel(label, magnified(shot.picture(answer), window, studio.size), "close up") for label, answer in shown]
    pairs = second_order_pairs(shot.snapshot)
    words = f"{len(pairs)} second-order reflections, R (R - 1) for R = 4."
    return Figure(
        "Fig 1: four inter-reflecting teapots",
        f"{words} The paper: 12. A teapot in a teapot shows the ground, the world and (from order three on) no more teapots: "
        "the environment map has no teapots at all, billboards are flat, depth maps have the shape.",
        [("fig01.png", studio.sheet([*rows, close], words))],
        table,
    )


def meets_a_mirror(shot: Shot) -> np.ndarray:
    """(H, W) bool: rays that meet another reflector first."""
    hits, names = shot.truth, [i.object_name for i in shot.snapshot.reflectors()]
    own = np.array(names)[shot.ray_map.reflector[shot.mask]]
    met = np.array([*hits.object_names, ""])[hits.object]
    out = np.zeros(shot.mask.shape, bool)
    out[shot.mask] = hits.hit & np.isin(met, names) & (met != own)
    return out
