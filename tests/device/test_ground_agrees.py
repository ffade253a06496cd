"""The ground's box: NumPy against GLSL on 10^5 rays, and against five quads that show the same picture (P20)."""

import numpy as np
import pytest
import tolerances
from baked_methods import is_on_the_brink, same_answer
from ground_boxes import LEVEL, asset_of, rays_everywhere, rays_in, tilted

from reflect_addon.core.kernel import record, run_numpy
from reflect_addon.core.methods import billboards
from reflect_addon.core.rays import Answer, Rays
from reflect_addon.evaluation import ground_quads

COUNT = 100_000
BOUNDS = tolerances.KERNEL_RADIANCE_RELATIVE, tolerances.KERNEL_DISTANCE_RELATIVE


def check(program, asset, rays, width, spread, found, rng):
    wanted = run_numpy(program, asset, rays, width, spread)
    for answer in (found, wanted):
        assert all(np.isfinite(field).all() for field in (answer.radiance, answer.position, answer.status, answer.coverage))
    odd = np.flatnonzero(~same_answer(found, wanted, rays.origin, *BOUNDS))
    assert len(odd) <= tolerances.RAYS_ON_BRINKS * len(rays)
    few = Rays(rays.origin[odd], rays.direction[odd])
    part = Answer(*(getattr(found, f)[odd] for f in ("radiance", "coverage", "position", "status")))
    explained = is_on_the_brink(program, asset, few, width[odd], spread[odd], part, rng, tolerances.BRINK, *BOUNDS)
    assert explained.all(), f"{(~explained).sum()} of {len(odd)} rays are nowhere near an edge: {odd[~explained][:5]}"


@pytest.mark.parametrize("ground", [LEVEL, tilted(), tilted(members=())], ids=["level", "tilted", "the world's"])
def test_glsl_says_what_numpy_says(device, rng, ground):
    from reflect_addon.gpu.fill import trace_rays

    asset, rays = asset_of(ground), rays_everywhere(rng, ground, COUNT)
    width, spread = rng.uniform(0, 0.05, COUNT).astype("f"), rng.choice([0.0, 0.05, 0.7], COUNT).astype("f")
    found = trace_rays(asset, billboards.trace, rays, width, spread)
    assert len(np.unique(found.status)) == 2
    check(record(billboards.trace, asset), asset, rays, width, spread, found, rng)


@pytest.mark.parametrize("ground", [LEVEL, tilted()], ids=["level", "tilted"])
def test_five_quads_show_the_same_picture(rng, ground):
    """The box, which is under test, against the loop over quads that other tests pin to Embree; from inside the box."""
    box = asset_of(ground)
    five = ground_quads.five_quads(box)
    rays = rays_in(rng, ground, COUNT)
    height = ground.local(rays.origin)[:, 2]
    rays = Rays(rays.origin[height < ground.low[2] + ground.height], rays.direction[height < ground.low[2] + ground.height])
    zero = np.zeros(len(rays))
    found = run_numpy(record(ground_quads.trace, five), five, rays)
    check(record(billboards.trace, box), box, rays, zero, zero, found, rng)
