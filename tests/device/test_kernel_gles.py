"""Kernels as GLSL ES 3.00 in a context of their own against NumPy: random programs, every gathering method, and what surfaces make of a ray."""

import numpy as np
import pytest
import random_kernels
import tolerances
from baked_methods import is_on_the_brink, rays_of_all_kinds, same_answer
from gles_bench import run_gles
from kernel_jobs import baked_everything, job_of
from tolerances_nodes import KERNEL_BRINK_SHARE

from reflect_addon.core import methods, pixel_rays, shading
from reflect_addon.core.asset import Asset
from reflect_addon.core.kernel import ES_300, emit_glsl, emitted, evaluate, record, record_function, run_numpy
from reflect_addon.core.rays import Answer, Rays

pytest.importorskip("moderngl", reason="SKIPPED: no moderngl; ./dev installs it")
COUNT, PROGRAMS = 20_000, 10


def test_random_programs(rng, tmp_path):
    made, given = random_kernels.asset(rng), random_kernels.inputs(rng, 4096)
    programs = [random_kernels.random_program(seed, made) for seed in range(PROGRAMS)]
    kernels = [emit_glsl(program, ("p", "q"), "answer", push_bytes=0, dialect=ES_300) for program in programs]
    answers = run_gles([job_of(kernel, made, given) for kernel in kernels], tmp_path)
    for seed, (program, got) in enumerate(zip(programs, answers)):
        single, stable = random_kernels.yardstick(program, given, made)
        for name in single:
            share = random_kernels.disagreement(got[name], single[name], stable[name])
            assert share <= KERNEL_BRINK_SHARE, f"program {seed}, output {name}"


def test_every_gathering_method(rng, tmp_path):
    assets = baked_everything()
    rays = rays_of_all_kinds(np.random.default_rng(11), COUNT)
    width, spread = rng.uniform(0, 0.05, COUNT).astype("f"), rng.choice([0.0, 0.004, 0.05, 0.7], COUNT).astype("f")
    inputs = {"origin": rays.origin, "direction": rays.direction, "width": width, "spread": spread}
    wanted = ("radiance", "coverage", "position", "status")
    kernels = {name: emitted(methods.get(asset.kind).trace, asset, wanted, ES_300) for name, asset in assets.items()}
    answers = run_gles([job_of(kernel, assets[name], inputs) for name, kernel in kernels.items()], tmp_path)
    bounds = tolerances.KERNEL_RADIANCE_RELATIVE, tolerances.KERNEL_DISTANCE_RELATIVE
    for (name, asset), got in zip(assets.items(), answers):
        found, program = Answer(*(got[field] for field in wanted)), record(methods.get(asset.kind).trace, asset)
        assert all(np.isfinite(values).all() for values in got.values()), name
        odd = np.flatnonzero(~same_answer(found, run_numpy(program, asset, rays, width, spread), rays.origin, *bounds))
        assert len(odd) <= tolerances.RAYS_ON_BRINKS * COUNT, name
        few, part = Rays(rays.origin[odd], rays.direction[odd]), Answer(*(got[field][odd] for field in wanted))
        explained = is_on_the_brink(program, asset, few, width[odd], spread[odd], part, rng, tolerances.BRINK, *bounds)
        assert explained.all(), f"{name}: {(~explained).sum()} of {len(odd)} rays are nowhere near an edge"


def test_reflectance(rng, tmp_path):
    kinds = shading.REFLECTANCE_INPUTS
    given = {name: rng.random((4096, 3) if kind == "vec3" else 4096).astype("f") for name, kind in kinds.items()}
    given["ior"] += 1.0
    program = record_function(shading.reflectance, kinds, options={"has_metal": True, "has_dielectric": True})
    kernel = emit_glsl(program, ("reflectance", "opacity"), "surface_reflectance", dialect=ES_300)
    (got,) = run_gles([job_of(kernel, Asset("", "", {}), given)], tmp_path)
    wanted = evaluate(program, given)
    for name in ("reflectance", "opacity"):
        np.testing.assert_allclose(got[name], wanted[name], rtol=tolerances.KERNEL_RADIANCE_RELATIVE, atol=1e-5)


def test_rays_of_a_pixel(rng, tmp_path):
    count = 4096
    given = {name: rng.normal(0, 0.1, (count, 3)).astype("f") for name in ("along_x", "along_y")}
    given |= {"width": rng.random(count).astype("f"), "spread": (0.2 * rng.random(count)).astype("f"), "most": rng.choice([1, 3, 7], count).astype("f")}
    program = record_function(pixel_rays.rays, pixel_rays.INPUTS)
    wanted = evaluate(program, given)
    kernel = emit_glsl(program, tuple(wanted), "rays_of_pixel", dialect=ES_300)
    (got,) = run_gles([job_of(kernel, Asset("", "", {}), given)], tmp_path)
    same = got["rays"] == wanted["rays"]  # a count next to its limit may be the other one
    assert same.mean() > 0.999 and set(np.unique(got["rays"])) == {1, 3, 5, 7}
    for name in ("line", "width", "spread"):
        np.testing.assert_allclose(got[name][same], wanted[name][same], rtol=1e-3, atol=1e-5)
