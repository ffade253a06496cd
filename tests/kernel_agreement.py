"""Kernels in a dialect of GLSL against NumPy, whoever runs them: random programs, every gathering method, and what surfaces make of a ray.

run: a bench's function (gles_bench.run_gles, godot_bench.run_godot), list of jobs -> list of answers.
"""

import numpy as np
import random_kernels
import tolerances
from baked_methods import is_on_the_brink, rays_of_all_kinds, same_answer
from kernel_jobs import baked_everything, job_of
from tolerances_nodes import KERNEL_BRINK_SHARE

from reflect_addon.core import methods, pixel_rays, shading
from reflect_addon.core.asset import Asset
from reflect_addon.core.kernel import emit_glsl, emitted, evaluate, record, record_function, run_numpy
from reflect_addon.core.rays import Answer, Rays

COUNT, FEW, PROGRAMS = 20_000, 4096, 10


def random_programs_agree(run, dialect, rng) -> None:
    made, given = random_kernels.asset(rng), random_kernels.inputs(rng, FEW)
    programs = [random_kernels.random_program(seed, made) for seed in range(PROGRAMS)]
    kernels = [emit_glsl(program, ("p", "q"), "answer", push_bytes=0, dialect=dialect) for program in programs]
    answers = run([job_of(kernel, made, given) for kernel in kernels])
    for seed, (program, got) in enumerate(zip(programs, answers)):
        single, stable = random_kernels.yardstick(program, given, made)
        for name in single:
            share = random_kernels.disagreement(got[name], single[name], stable[name])
            assert share <= KERNEL_BRINK_SHARE, f"program {seed}, output {name}"


def methods_agree(run, dialect, rng) -> None:
    assets = baked_everything()
    rays = rays_of_all_kinds(np.random.default_rng(11), COUNT)
    width, spread = rng.uniform(0, 0.05, COUNT).astype("f"), rng.choice([0.0, 0.004, 0.05, 0.7], COUNT).astype("f")
    inputs = {"origin": rays.origin, "direction": rays.direction, "width": width, "spread": spread}
    wanted = ("radiance", "coverage", "position", "status")
    kernels = {name: emitted(methods.get(asset.kind).trace, asset, wanted, dialect) for name, asset in assets.items()}
    answers = run([job_of(kernel, assets[name], inputs) for name, kernel in kernels.items()])
    bounds = tolerances.KERNEL_RADIANCE_RELATIVE, tolerances.KERNEL_DISTANCE_RELATIVE
    for (name, asset), got in zip(assets.items(), answers):
        found, program = Answer(*(got[field] for field in wanted)), record(methods.get(asset.kind).trace, asset)
        assert all(np.isfinite(values).all() for values in got.values()), name
        odd = np.flatnonzero(~same_answer(found, run_numpy(program, asset, rays, width, spread), rays.origin, *bounds))
        assert len(odd) <= tolerances.RAYS_ON_BRINKS * COUNT, f"{name}: {len(odd)}"
        few, part = Rays(rays.origin[odd], rays.direction[odd]), Answer(*(got[field][odd] for field in wanted))
        explained = is_on_the_brink(program, asset, few, width[odd], spread[odd], part, rng, tolerances.BRINK, *bounds)
        assert explained.all(), f"{name}: {(~explained).sum()} of {len(odd)} rays are nowhere near an edge"


def surface_agrees(run, dialect, rng) -> None:
    """Reflectance, and the rays that a pixel sends: these where float32 itself is sure of them, for the line of a pixel that is hardly stretched is a matter of rounding."""
    kinds = shading.REFLECTANCE_INPUTS
    given = {name: rng.random((FEW, 3) if kind == "vec3" else FEW).astype("f") for name, kind in kinds.items()}
    given["ior"] += 1.0
    along = {name: rng.normal(0, 0.1, (FEW, 3)).astype("f") for name in ("along_x", "along_y")}
    along |= {"width": rng.random(FEW).astype("f"), "spread": (0.2 * rng.random(FEW)).astype("f"), "most": rng.choice([1, 3, 7], FEW).astype("f")}
    mirrors = record_function(shading.reflectance, kinds, options={"has_metal": True, "has_dielectric": True})
    pixel = record_function(pixel_rays.rays, pixel_rays.INPUTS)
    parts = ((mirrors, "surface_reflectance", given), (pixel, "rays_of_pixel", along))
    none = Asset("", "", {})
    mirrored, sent = run([job_of(emit_glsl(program, tuple(program.outputs), name, dialect=dialect), none, inputs) for program, name, inputs in parts])
    wanted = evaluate(mirrors, given)
    for name in ("reflectance", "opacity"):
        np.testing.assert_allclose(mirrored[name], wanted[name], rtol=tolerances.KERNEL_RADIANCE_RELATIVE, atol=1e-5)
    single, stable = random_kernels.yardstick(pixel, along, none)
    assert set(np.unique(sent["rays"])) == {1, 3, 5, 7}
    for name in single:
        share = random_kernels.disagreement(sent[name], single[name], stable[name])
        assert stable[name].mean() > 0.9 and share <= KERNEL_BRINK_SHARE, f"{name}: {stable[name].mean()} stable, {share}"
