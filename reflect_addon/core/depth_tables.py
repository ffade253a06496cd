"""The tables of an asset's depth maps: their rows in `billboard_buf`, their simplified rotated rows, and their depths [popescu-2006 4.2]."""

import numpy as np

from . import srdm, srdm_greedy, srdm_optimal
from .billboard_capture import Texels
from .depth_atlas import fill_rows, sphere_around, stacked
from .depth_fit import DepthView
from .depth_refine import NOTHING, corners_of
from .job import BakeJob


def write_maps(job, rows, stand_ins: list, captured: list[Texels], placed: list, center, again) -> dict[str, np.ndarray]:
    """Fills the rows of the depth maps; returns the images that they look their depths up in. again: rays start on mirrors."""
    by_name = {i.name: i for i in (*job.scene.instances, *job.scene.lamps)}
    tables, depths, spheres = [], [], []
    maps = [i for i, s in enumerate(stand_ins) if isinstance(s, DepthView)]
    for i in maps:
        depth = stand_ins[i].depth(captured[i].distance)
        tables.append(_table(job, depth))
        depths.append(corners_of(depth, np.float32 if captured[i].mirrors else np.float16))
        spheres.append(sphere_around(job.scene.world_positions(by_name[stand_ins[i].instance])))
    image, at = stacked(tables, (-srdm.FILL, 0.0, -srdm.FILL, 0.0))
    depth_images, depth_at = {}, [(0, 0)] * len(maps)
    for name, kind in (("depth_tx", np.float16), ("mirror_depth_buf", np.float32)):
        some = [n for n, d in enumerate(depths) if d.dtype == kind]
        if some:
            depth_images[name], places = stacked([depths[n] for n in some], (NOTHING,) * 4)
            for n, where in zip(some, places, strict=True):
                depth_at[n] = where
    corners = [(*a, *b) for a, b in zip(at, depth_at, strict=True)]
    started_on = [stand_ins[i].own or (again and captured[i].mirrors) for i in maps]
    filled = np.zeros((len(maps), *rows.shape[1:]), np.float32)
    fill_rows(filled, [stand_ins[i] for i in maps], started_on, [placed[i] for i in maps], corners, spheres, center)
    rows[maps] = filled
    tables = {"srdm_tx": image.astype(np.float16)} if job.settings["half"] else {"srdm_buf": image}
    return {**tables, **depth_images}


def _table(job: BakeJob, depth: np.ndarray) -> np.ndarray:
    n, m = int(job.settings["turns"]), int(job.settings["points"])
    simplify = srdm_optimal.simplify if job.settings["optimal"] else srdm_greedy.simplify
    return srdm.packed(simplify(srdm.with_spans(srdm.rotated_rows(depth, n), m), m).reshape(n, len(depth), m, 2))
