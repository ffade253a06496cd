"""Every registered method: NumPy against GLSL, through the fill shader that frames are drawn with, on 10^5 rays."""

from dataclasses import replace

import numpy as np
import pytest
import tolerances
from baked_methods import bake_all, is_on_the_brink, rays_of_all_kinds, same_answer, scene_of_everything

from reflect_addon.core import methods, spaces
from reflect_addon.core.kernel import counted, record, run_numpy
from reflect_addon.core.rays import Rays

COUNT = 100_000


CONTACT = "light_field beside depth_maps"


@pytest.fixture(scope="module")
def assets():
    found = bake_all(scene_of_everything())
    return {**found, CONTACT: replace(found["light_field"].joined(found["depth_maps"]), kind="light_field")}


@pytest.fixture(scope="module")
def rays():
    return rays_of_all_kinds(np.random.default_rng(11), COUNT)


@pytest.mark.parametrize("footprint", [False, True])
@pytest.mark.parametrize("name", (*methods.gathering(), CONTACT))
def test_glsl_says_what_numpy_says(name, footprint, device, rng, assets, rays, record_property):
    from reflect_addon.gpu.fill import trace_rays

    trace, asset = methods.get(assets[name].kind).trace, assets[name]
    width = rng.uniform(0, 0.05, COUNT) * footprint
    spread = rng.choice([0.0, 0.004, 0.05, 0.7], COUNT) * footprint
    found = trace_rays(asset, trace, rays, width.astype("f"), spread.astype("f"))
    program = record(trace, asset)
    wanted = run_numpy(program, asset, rays, width, spread)
    for answer in (found, wanted):
        assert all(np.isfinite(field).all() for field in (answer.radiance, answer.position, answer.status, answer.coverage))
    bounds = tolerances.KERNEL_RADIANCE_RELATIVE, tolerances.KERNEL_DISTANCE_RELATIVE
    same = same_answer(found, wanted, rays.origin, *bounds)
    odd = np.flatnonzero(~same)
    record_property("exceptions", len(odd))
    assert len(odd) <= tolerances.RAYS_ON_BRINKS * COUNT
    few = Rays(rays.origin[odd], rays.direction[odd])
    part = type(found)(*(getattr(found, f)[odd] for f in ("radiance", "coverage", "position", "status")))
    explained = is_on_the_brink(
        program, asset, few, width[odd], spread[odd], part, rng, tolerances.BRINK, *bounds
    )  # fmt: skip
    assert explained.all(), f"{(~explained).sum()} of {len(odd)} rays are nowhere near an edge: {odd[~explained][:5]}"


def test_the_rays_meet_everything(assets, rays):
    """A guard on the test itself: quads, alpha, the sky and the fall-back all take part."""
    status = run_numpy(record(methods.get("billboards").trace, assets["billboards"]), assets["billboards"], rays).status
    assert 0.2 < np.mean(status == spaces.STATUS_HIT) < 0.99
    options = assets["billboards"].options
    assert options["contours"] and options["count"] >= 9
    assert options["mirrors"] >= 3 and all(options[o] for o in ("partly", "relief", "has_metal", "has_dielectric"))
    steps = run_numpy(record(counted(methods.get("billboards").trace), assets["billboards"]), assets["billboards"], rays).radiance
    assert np.mean(steps[:, 0] > options["count"] + options["mirrors"]) > 0.01, "few rays go on from a mirror"
    sphere = run_numpy(record(methods.get("sphere_proxy").trace, assets["sphere_proxy"]), assets["sphere_proxy"], rays).status
    assert len(np.unique(sphere)) == 2
    assert max(assets["box_proxy"].uniforms["box_high"]) == spaces.FAR, "the room has no ceiling"
    answers = {name: run_numpy(record(methods.get(asset.kind).trace, asset), asset, rays).radiance for name, asset in assets.items()}
    different = [np.abs(a - answers["environment"]).max(1) > 0.05 for n, a in answers.items() if n != "environment"]
    assert all(d.mean() > 0.1 for d in different)


def test_the_shader_counts_the_intersections(device, assets, rays):
    """popescu-2006 3.1: 2 D + R - 1 for a ray that meets a mirror first, else D + R - 1; counted by the shader itself."""
    from reflect_addon.gpu.fill import trace_rays

    asset, trace = assets["billboards"], counted(methods.get("billboards").trace)
    found = trace_rays(asset, trace, rays, 0.0, 0.0).radiance[:, 0]
    diffuse, once = asset.options["count"], asset.options["count"] + asset.options["mirrors"]
    assert set(np.unique(found)) == {once, once + diffuse}
    wanted = run_numpy(record(trace, asset), asset, rays).radiance[:, 0]
    assert np.sum(found != wanted) <= tolerances.RAYS_ON_BRINKS * COUNT
