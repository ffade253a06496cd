"""The ground's box as shader nodes in Cycles against NumPy."""

import numpy as np
import tolerances
from baked_methods import is_on_the_brink, same_answer
from ground_boxes import LEVEL, asset_of, rays_everywhere, tilted
from node_bench import run_nodes

from reflect_addon.core.kernel import record, run_numpy
from reflect_addon.core.methods import billboards
from reflect_addon.core.rays import Answer, Rays
from reflect_addon.scene.kernel_nodes import emit_nodes

COUNT = 100_000
SIZES = {"radiance": 3, "position": 3, "coverage": 1, "status": 1}


def test_cycles_says_what_numpy_says(fresh_file, tmp_path, rng):
    """A level, a tilted and the world's own ground in one render; the rays are the tilted one's."""
    assets = {"level": asset_of(LEVEL), "tilted": asset_of(tilted()), "world": asset_of(tilted(members=()))}
    rays = rays_everywhere(rng, tilted(), COUNT)
    width, spread = rng.uniform(0, 0.05, COUNT), rng.choice([0.0, 0.05, 0.7], COUNT)
    programs = {name: record(billboards.trace, asset) for name, asset in assets.items()}
    groups = {name: (emit_nodes(program, assets[name], name, tuple(SIZES), unrolled=True), SIZES) for name, program in programs.items()}
    given = {"origin": rays.origin, "direction": rays.direction, "width": width, "spread": spread}
    answers = run_nodes(fresh_file, tmp_path, groups, given)
    bounds = tolerances.KERNEL_RADIANCE_RELATIVE, tolerances.KERNEL_DISTANCE_RELATIVE
    for name, program in programs.items():
        found, wanted = Answer(**answers[name]), run_numpy(program, assets[name], rays, width, spread)
        odd = np.flatnonzero(~same_answer(found, wanted, rays.origin, *bounds))
        assert len(odd) <= tolerances.RAYS_ON_NODE_BRINKS * COUNT, f"{name}: {len(odd)} rays"
        few = Rays(rays.origin[odd], rays.direction[odd])
        part = Answer(*(getattr(found, f)[odd] for f in ("radiance", "coverage", "position", "status")))
        explained = is_on_the_brink(
            program, assets[name], few, width[odd], spread[odd], part, rng, tolerances.BRINK, *bounds
        )  # fmt: skip
        assert explained.all(), f"{name}: {(~explained).sum()} of {len(odd)} rays are nowhere near an edge"
