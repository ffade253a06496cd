"""The NumPy emitter: against arithmetic written by hand, against itself ray by ray, and its counts of work."""

import numpy as np
import pytest
import random_kernels

from reflect_addon.core.asset import Asset
from reflect_addon.core.kernel import Counts, Hit, KernelError, evaluate, record, record_function, run_numpy
from reflect_addon.core.rays import Rays


@pytest.mark.parametrize("seed", range(40))
def test_many_rays_at_once_are_each_ray_alone(seed, rng):
    """Compaction of stopped rays, masks of branches and broadcasting must not mix rays up."""
    made, given = random_kernels.asset(rng), random_kernels.inputs(rng, 48)
    program = random_kernels.random_program(seed, made)
    together = evaluate(program, given, made)
    for ray in range(48):
        alone = evaluate(program, {name: column[ray : ray + 1] for name, column in given.items()}, made)
        for name in together:
            np.testing.assert_array_equal(together[name][ray], alone[name][0])


def test_most_of_a_random_program_is_stable(rng):
    """The comparisons between emitters skip what float64 answers otherwise; that must stay the exception."""
    made, given = random_kernels.asset(rng), random_kernels.inputs(rng, 400)
    shares = []
    for seed in range(40):
        _, stable = random_kernels.yardstick(random_kernels.random_program(seed, made), given, made)
        shares += [mask.mean() for mask in stable.values()]
    assert np.mean(shares) > 0.85


def test_sample_is_the_stated_bilinear(rng):
    image = rng.random((5, 7, 4)).astype("f")
    program = record_function(lambda k, s, at: {"c": k.sample(s.images["i_tx"], at)}, {"at": "vec2"}, images=("i_tx",))
    at = rng.uniform(-2, 9, (500, 2))
    got = evaluate(program, {"at": at}, Asset("a", "", {"i_tx": image}), dtype=np.float64)["c"]
    padded = np.pad(image.astype(float), ((9, 9), (9, 9), (0, 0)), mode="edge")
    corner = np.floor(at - 0.5).astype(int)
    f = (at - 0.5 - corner)[:, :, None]
    texel = lambda dx, dy: padded[corner[:, 1] + 9 + dy, corner[:, 0] + 9 + dx]  # noqa: E731
    want = (texel(0, 0) * (1 - f[:, 0]) + texel(1, 0) * f[:, 0]) * (1 - f[:, 1])
    want += (texel(0, 1) * (1 - f[:, 0]) + texel(1, 1) * f[:, 0]) * f[:, 1]
    np.testing.assert_allclose(got, want, rtol=1e-12)


def test_fetch_clamps_whatever_comes():
    image = np.arange(24, dtype="f").reshape(2, 3, 4)
    program = record_function(lambda k, s, at: {"c": k.fetch(s.images["i_buf"], at)}, {"at": "vec2"}, images=("i_buf",))
    at = np.array([[0, 0], [2, 1], [-5, 9], [1e30, -1e30], [np.inf, -np.inf], [np.nan, np.nan], [1.9, 0.9]])
    got = evaluate(program, {"at": at}, Asset("a", "", {"i_buf": image}))["c"][:, 0]
    assert got.tolist() == [0, 20, 12, 8, 8, 0, 4]


def test_march_against_a_python_loop(rng):
    """A loop with early out, an image and a branch inside, beside the same thing written as plain Python."""
    image = rng.random((8, 8, 4)).astype("f")

    def kernel(k, scope, a):
        def body(i, x, total):
            texel = k.fetch(scope.images["i_buf"], k.floor(x), i)
            (more,) = k.branch(texel.x > 0.5, lambda: (texel.y * 2.0,), lambda: (i,))
            return (x + texel.z, total + more), texel.w > 0.9

        x, total = k.loop(8, (a, 0.0), body)
        return {"x": x, "total": total}

    starts = rng.uniform(0, 7, 200)
    got = evaluate(
        record_function(kernel, {"a": "float"}, images=("i_buf",)), {"a": starts}, Asset("a", "", {"i_buf": image}), dtype=float
    )
    for start, x_got, total_got in zip(starts, got["x"], got["total"]):
        x, total = start, 0.0
        for i in range(8):
            texel = image[i, min(int(x), 7)].astype(float)
            total += texel[1] * 2 if texel[0] > 0.5 else i
            x += texel[2]
            if texel[3] > 0.9:
                break
        assert (x_got, total_got) == pytest.approx((x, total), rel=1e-12)


def test_counts_are_those_of_the_rays_that_work():
    """Rays stop after their own number of steps; a branch reads its image only where it is taken."""

    def kernel(k, scope, a):
        def body(i, t):
            (texel,) = k.branch(t > 2.0, lambda: (k.fetch(scope.images["i_buf"], t, 0).x,), lambda: (0.0,))
            return (t - 1.0 + texel * 0.0,), t <= 1.0

        return {"t": k.loop(10, (a,), body)[0]}

    counts = Counts()
    program = record_function(kernel, {"a": "float"}, images=("i_buf",))
    made = Asset("a", "", {"i_buf": np.zeros((1, 1, 4), "f")})
    evaluate(program, {"a": np.array([1.0, 3.0, 30.0])}, made, counts=counts)
    assert counts.steps == 1 + 3 + 10 and counts.rays == 3
    assert counts.fetches == {"i_buf": 0 + 1 + 10}
    assert counts.steps_per_ray == pytest.approx(14 / 3) and counts.fetches_per_ray == pytest.approx(11 / 3)


def test_per_ray_counts_of_a_loop_and_no_rays_at_all():
    program = record_function(lambda k, s, n: {"t": k.loop(n, (0.0,), lambda i, t: ((t + i,), None))[0]}, {"n": "float"})
    assert evaluate(program, {"n": np.array([0.0, 1.0, 4.0, -2.0])})["t"].tolist() == [0, 0, 6, 0]
    assert evaluate(program, {"n": np.zeros(0)})["t"].shape == (0,)


def test_run_numpy_answers_rays_and_names_what_is_missing():
    def trace(k, asset, ray):
        return Hit(asset.uniforms["tint"] * ray.width, ray.origin + ray.direction, 1.0, 2.0)

    program = record(trace, Asset("toy", "", {}, {"tint": (1.0, 2.0, 3.0)}))
    rays = Rays(np.zeros((70000, 3), "f"), np.ones((70000, 3), "f"))
    answer = run_numpy(program, Asset("toy", "", {}, {"tint": (1.0, 2.0, 3.0)}), rays, width=0.5)
    assert answer.radiance.shape == (70000, 3) and answer.radiance.dtype == np.float32
    assert answer.radiance[-1].tolist() == [0.5, 1.0, 1.5] and answer.status[0] == 2.0 and answer.position[5, 1] == 1.0
    with pytest.raises(KernelError, match="no uniform 'tint'"):
        run_numpy(program, Asset("toy", "", {}), rays)
    with pytest.raises(KernelError, match="uniform 'tint' is a float"):
        run_numpy(program, Asset("toy", "", {}, {"tint": 1.0}), rays)
    with pytest.raises(KernelError, match="input 'origin' has the shape"):
        run_numpy(program, Asset("toy", "", {}, {"tint": 1.0}), Rays(rays.origin[:, :2], rays.direction))


def test_a_loop_ends_whatever_its_count():
    """Counts between whole numbers, from NumPy, infinite, and not a number."""
    kernel = lambda k, s, n: {"t": k.loop(n, (0.0,), lambda i, t: ((t + 1.0,), None))[0]}  # noqa: E731
    program = record_function(kernel, {"n": "float"})
    got = evaluate(program, {"n": np.array([2.5, np.inf, np.nan, -np.inf])})["t"]
    assert got.tolist() == [3.0, 65536.0, 0.0, 0.0]
    known = record_function(lambda k, s, n: {"t": kernel(k, s, np.int64(3))["t"] + kernel(k, s, 1.5)["t"] * n}, {"n": "float"})
    assert evaluate(known, {"n": np.array([10.0])})["t"][0] == 23.0
