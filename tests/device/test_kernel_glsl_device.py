"""Random programs through GLSL on the device and through NumPy: the same rays, the same answers."""

import numpy as np
import pytest
import random_kernels
from glsl_bench import run_glsl
from tolerances_nodes import KERNEL_BRINK_SHARE

from reflect_addon.core.asset import Asset
from reflect_addon.core.kernel import emit_glsl, evaluate, record_function

TOGETHER = 4  # programs in one shader: two images of results each, and a shader may bind eight


@pytest.mark.parametrize("batch", range(12))
def test_random_programs(device, rng, batch):
    made, given = random_kernels.asset(rng), random_kernels.inputs(rng, 4096)
    seeds = range(batch * TOGETHER, (batch + 1) * TOGETHER)
    programs = [random_kernels.random_program(seed, made) for seed in seeds]
    kernels = [
        emit_glsl(program, ("p", "q"), f"random_{seed}", push_bytes=128 if seed % 2 else 0, prefix=f"r{seed}_")
        for seed, program in zip(seeds, programs)
    ]
    answers = run_glsl(device, kernels, given, [made] * TOGETHER)
    for seed, program, got in zip(seeds, programs, answers):
        single, stable = random_kernels.yardstick(program, given, made)
        for name in single:
            share = random_kernels.disagreement(got[name], single[name], stable[name])
            assert share <= KERNEL_BRINK_SHARE, f"program {seed}, output {name}"


def test_edges_of_texels_and_images(device):
    """Look-ups exactly on texel edges, centres, borders and far outside."""
    steps = np.concatenate([np.arange(-3, 12, 0.25), [1e9, -1e9, 1e30, -1e30, 1e-30, -1e-30, 7.9999995]])
    at = np.stack(np.meshgrid(steps, steps), -1).reshape(-1, 2).astype("f")
    made = Asset("a", "", {"i_tx": np.random.default_rng(3).random((4, 8, 4)).astype(np.float16)})

    def kernel(k, scope, at):
        return {"texel": k.fetch(scope.images["i_tx"], at), "mixed": k.sample(scope.images["i_tx"], at)}

    program = record_function(kernel, {"at": "vec2"}, images=("i_tx",))
    (got,) = run_glsl(device, [emit_glsl(program, ("texel", "mixed"), "look")], {"at": at}, [made])
    want = evaluate(program, {"at": at}, made)
    np.testing.assert_array_equal(got["texel"], want["texel"])
    near = np.abs(at).max(1) < 1e8  # the weight between two equal texels far outside is whatever rounding makes it
    np.testing.assert_allclose(got["mixed"][near], want["mixed"][near], atol=1e-6)
    np.testing.assert_allclose(got["mixed"][~near], want["mixed"][~near], rtol=1e-3)


def test_states_that_swap_change_at_once(device):
    """(a, b) -> (b, a + b): text that assigned one state before reading it would give powers of two."""

    def kernel(k, scope, n):
        a, b, was = k.loop(n, (0.0, 1.0, False), lambda i, a, b, was: ((b, a + b, a > b), a > 50.0))
        return {"r": k.vec3(a, b, k.select(was, 1.0, 0.0))}

    program = record_function(kernel, {"n": "float"})
    counts = np.arange(15, dtype="f")
    (got,) = run_glsl(device, [emit_glsl(program, ("r",), "fibonacci")], {"n": counts}, [None])
    np.testing.assert_array_equal(got["r"], evaluate(program, {"n": counts})["r"])
    assert got["r"][10].tolist() == [55.0, 89.0, 0.0] and got["r"][14, 0] == 89.0, "stops one step after a > 50"
