"""Kernels as shader nodes: random programs and a method-like one in Cycles, the first methods in Cycles and in EEVEE."""

import numpy as np
import pytest
import random_kernels
from node_bench import run_nodes
from tolerances import KERNEL_RADIANCE_RELATIVE
from tolerances_nodes import EEVEE_HALF_MOST, EEVEE_HALF_RELATIVE, KERNEL_BRINK_SHARE

from reflect_addon.core import cubemap
from reflect_addon.core.asset import Asset
from reflect_addon.core.kernel import Hit, KernelError, evaluate, record, record_function, run_numpy
from reflect_addon.core.methods import box_proxy, environment
from reflect_addon.core.rays import Hits, Rays
from reflect_addon.scene.kernel_nodes import emit_nodes


def room(k, asset, ray):
    """A box room's exit point, a cube-map look-up there and a table of discs tested in a loop: what methods do."""
    uniforms, table = asset.uniforms, asset.images["discs_buf"]
    k.cite("lagarde-2012: the exit of a box, per axis, then the nearest")
    far = k.vec3(*(k.select(d > 0.0, high, low) for d, low, high in zip(ray.direction, uniforms["low"], uniforms["high"])))
    slope = k.vec3(*(k.away_from_zero(d) for d in ray.direction))
    exits = (far - ray.origin) / slope
    distance = k.name("box_exit", k.min(exits.x, exits.y, exits.z))

    def disc(i, nearest, colour):
        place = k.name("place", k.fetch(table, i, 0))
        t = (place.z - ray.origin.z) / slope.z
        at = ray.origin + ray.direction * t
        away = at.xy - place.xy
        inside = (k.dot(away, away) < place.w * place.w) & (t > 0.0) & (t < nearest)
        (shown,) = k.branch(inside, lambda: (k.fetch(table, i, 1),), lambda: (colour,))
        return (k.select(inside, t, nearest), shown), None

    background = k.sample(asset.images["wall_tx"], (ray.origin + ray.direction * distance).xy * 2.0 + 8.0)
    nearest, colour = k.loop(asset.options["discs"], (distance, background), disc)
    hit = nearest < distance
    return Hit(colour.rgb, ray.origin + ray.direction * nearest, k.select(hit, colour.a, 1.0), k.select(hit, 1.0, 2.0))


@pytest.fixture
def room_asset(rng):
    discs = rng.uniform(0.1, 1.0, (2, 5, 4)).astype("f")
    discs[0, :, :3] = rng.uniform(-3, 3, (5, 3))
    discs[0, :, 3] += 1.0  # radius, m
    images = {"wall_tx": rng.random((16, 16, 4)).astype(np.float16), "discs_buf": discs}
    return Asset("room", "", images, {"low": (-4.0, -4.0, -4.0), "high": (4.0, 4.0, 4.0)}, {"discs": 5})


@pytest.fixture
def rays(rng):
    direction = rng.normal(size=(2048, 3))
    direction[:6] = [[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]]
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    return Rays(rng.uniform(-3, 3, (2048, 3)).astype("f"), direction.astype("f"))


SIZES = {"radiance": 3, "coverage": 1, "position": 3, "status": 1}


def test_random_programs_in_cycles(fresh_file, tmp_path, rng):
    made, given = random_kernels.asset(rng), random_kernels.inputs(rng, 2048)
    programs = {f"r{seed}": random_kernels.random_program(seed, made) for seed in range(8)}
    groups = {key: (emit_nodes(p, made, key, ("p", "q"), unrolled=True), {"p": 3, "q": 3, "p w": 1, "q w": 1}) for key, p in programs.items()}
    answers = run_nodes(fresh_file, tmp_path, groups, given)
    for key, program in programs.items():
        single, stable = random_kernels.yardstick(program, given, made)
        for name in ("p", "q"):
            got = np.concatenate([answers[key][name], answers[key][f"{name} w"][:, None]], -1)
            share = random_kernels.disagreement(got, single[name], stable[name])
            assert share <= KERNEL_BRINK_SHARE, f"{key}, {name}"


def test_random_programs_in_eevee(fresh_file, tmp_path, rng):
    """Loops and branches of shaders, not unrolled; groups within groups, each its own tree where it is large enough."""
    made, given = random_kernels.asset(rng), random_kernels.inputs(rng, 512)
    programs = {f"r{seed}": random_kernels.random_program(seed, made) for seed in range(6)}
    groups = {key: (emit_nodes(p, made, key, ("p",)), {"p": 3}) for key, p in programs.items()}
    answers = run_nodes(fresh_file, tmp_path, groups, given, "BLENDER_EEVEE")
    for key, program in programs.items():
        single, stable = (of["p"][:, :3] for of in random_kernels.yardstick(program, given, made))
        in_half = np.abs(single) < EEVEE_HALF_MOST
        got = np.where(in_half, answers[key]["p"], single)
        assert random_kernels.disagreement(got, single, stable, EEVEE_HALF_RELATIVE) <= KERNEL_BRINK_SHARE, key


def test_room_in_cycles(fresh_file, tmp_path, room_asset, rays):
    program = record(room, room_asset)
    want = run_numpy(program, room_asset, rays)
    group = emit_nodes(program, room_asset, "Room", tuple(SIZES), unrolled=True)
    assert {s.name for s in group.interface.items_tree} >= {"Origin", "Direction", "Radiance", "Coverage"}
    got = run_nodes(fresh_file, tmp_path, {"room": (group, SIZES)}, _inputs(rays))["room"]
    assert 0.1 < np.mean(want.status == 1.0) < 0.9
    for name in SIZES:
        _agree(got[name], getattr(want, name), KERNEL_RADIANCE_RELATIVE)


@pytest.fixture
def cube_asset(rng):
    """A small cube map of noise, partly sky, and a box around it: what environment and box_proxy read."""
    bundle = cubemap.bundle(np.zeros(3), 16)
    count = len(bundle)
    position = bundle.direction * rng.uniform(1, 3, (count, 1))
    hits = Hits(
        rng.random((count, 3)).astype("f"), position.astype("f"), bundle.direction, np.zeros(count, int), rng.random(count) > 0.2
    )
    image, uniforms = cubemap.assemble(np.zeros(3), 16, hits)
    axes = {"box_x": (0.6, 0.8, 0.0), "box_y": (-0.8, 0.6, 0.0), "box_z": (0.0, 0.0, 1.0)}
    box = {"box_low": (-4.0, -4.0, -4.0), "box_high": (4.0, 5.0, 3.0), "center": (0.0, 0.0, 0.0)}
    box |= {"box_rim_low": (-2e9, -2e9, -2e9), "box_rim_high": (2e9, 2e9, 2.5)}
    return Asset("cube", "", {"radiance_tx": image}, uniforms | axes | box, {"turned": True, "open": True, "walls": True})


@pytest.mark.parametrize("engine", ["CYCLES", "BLENDER_EEVEE"])
def test_environment_and_box_proxy_in(engine, fresh_file, tmp_path, rng, cube_asset, rays):
    """EEVEE gives half floats, so only its radiance is looked at; Cycles also tells positions."""
    bound = EEVEE_HALF_RELATIVE if engine == "BLENDER_EEVEE" else KERNEL_RADIANCE_RELATIVE
    outputs = {"radiance": 3} if engine == "BLENDER_EEVEE" else {"radiance": 3, "position": 3, "status": 1}
    given = _inputs(rays) | {"width": rng.uniform(0, 0.1, len(rays)), "spread": rng.choice([0.0, 0.01, 0.1, 0.5], len(rays))}
    programs = {method.NAME: record(method.trace, cube_asset) for method in (environment, box_proxy)}
    unrolled = engine == "CYCLES"
    groups = {name: (emit_nodes(program, cube_asset, name, tuple(outputs), unrolled), outputs) for name, program in programs.items()}
    answers = run_nodes(fresh_file, tmp_path, groups, given, engine)
    for name, program in programs.items():
        want = run_numpy(program, cube_asset, rays, given["width"], given["spread"])
        for field in outputs:
            _agree(answers[name][field], getattr(want, field), bound)
    assert not np.allclose(answers["environment"]["radiance"], answers["box_proxy"]["radiance"])


def _inputs(rays: Rays) -> dict[str, np.ndarray]:
    return {"origin": rays.origin, "direction": rays.direction}


def _agree(got: np.ndarray, want: np.ndarray, bound: float) -> None:
    """All rays but one in a thousand, which may be on the edge of a disc or between two walls."""
    error = (np.abs(got - want) / (np.abs(want) + 1e-2)).reshape(len(want), -1).max(1)
    assert np.mean(error > bound) <= 1e-3


def test_division_by_zero_is_huge_not_zero(fresh_file, tmp_path):
    """Blender's own nodes say x / 0 = 0, which would put the exit of an axis-aligned ray at its start."""
    program = record_function(lambda k, s, a: {"x": k.min(3.0 / a, 5.0), "y": k.max(k.vec2(-2.0, 1.0) / a, -7.0)}, {"a": "float"})
    values = {"a": np.array([0.0, 2.0, -1.0])}
    got = run_nodes(fresh_file, tmp_path, {"d": (emit_nodes(program, _no_asset(), "D", ("x", "y")), {"x": 1, "y": 2})}, values)["d"]
    assert got["x"].tolist() == [5.0, 1.5, -3.0]
    assert got["y"][:2].tolist() == [[-7.0, np.float32(1e30)], [-1.0, 0.5]]


def test_a_choice_between_constants_is_exact(fresh_file, tmp_path):
    """Also where their difference, added again, is not what it was: FAR and a metre, 0.1 and 0.3."""
    pairs = [(1.0, 0.0), (0.0, 1.0), (-1.0, 1.0), (0.1, 0.3), (1.0, 1e30), (1e30, 0.3), (0.0, 1e30), (1e-20, -3.0)]

    def kernel(k, scope, a):
        return {f"x{n}": k.select(a > 0.0, x, y) for n, (x, y) in enumerate(pairs)}

    names = [f"x{n}" for n in range(len(pairs))]
    tree = emit_nodes(record_function(kernel, {"a": "float"}), _no_asset(), "C", tuple(names))
    got = run_nodes(fresh_file, tmp_path, {"c": (tree, dict.fromkeys(names, 1))}, {"a": np.array([1.0, -1.0])})["c"]
    for name, pair in zip(names, pairs, strict=True):
        assert np.array_equal(np.ravel(got[name]), np.array(pair, np.float32)), name


def test_a_guarded_division_costs_one_node(fresh_file):
    """k.away_from_zero must be recognised, or every division of a kernel is paid for twice."""
    guarded = record_function(lambda k, s, a: {"x": k.exp2(a) / k.max(a, 0.5) / k.away_from_zero(a)}, {"a": "float"})
    bare = record_function(lambda k, s, a: {"x": k.exp2(a) / k.max(a, 0.5) / a}, {"a": "float"})
    trees = [emit_nodes(program, _no_asset(), "D", ("x",)) for program in (guarded, bare)]
    greater = [sum(getattr(n, "operation", "") == "GREATER_THAN" for n in tree.nodes) for tree in trees]
    assert greater == [0, 1]


def _no_asset() -> Asset:
    return Asset("none", "", {})


def test_a_count_from_a_uniform_is_unrolled(fresh_file, tmp_path):
    def kernel(k, scope, a):
        return {"x": k.loop(scope.uniforms["n"] * 2.0, (a,), lambda i, t: ((t + i,), None))[0]}

    asset = Asset("a", "", {}, {"n": 2.0})
    tree = emit_nodes(record_function(kernel, {"a": "float"}, uniforms=asset.uniforms), asset, "N", ("x",), unrolled=True)
    got = run_nodes(fresh_file, tmp_path, {"n": (tree, {"x": 1})}, {"a": np.array([1.0, 5.0])})
    assert got["n"]["x"].tolist() == [7.0, 11.0]


def test_what_nodes_cannot_express_leaves_nothing_behind(fresh_file, rng):
    def kernel(k, scope, a):
        start = k.sample(scope.images["noise_tx"], a, 0.5).x
        return {"x": k.loop(a, (start,), lambda i, t: ((t + i,), None))[0]}

    asset = random_kernels.asset(rng)
    before = len(fresh_file.data.node_groups), len(fresh_file.data.images)
    with pytest.raises(KernelError, match="differs per ray"):
        emit_nodes(record_function(kernel, {"a": "float"}, asset.images), asset, "N", ("x",), unrolled=True)
    with pytest.raises(KernelError, match="no image 'noise_tx'"):
        emit_nodes(record_function(kernel, {"a": "float"}, asset.images), _no_asset(), "N", ("x",), unrolled=True)
    assert (len(fresh_file.data.node_groups), len(fresh_file.data.images)) == before


def test_unused_images_and_outputs_leave_no_nodes(fresh_file, room_asset):
    program = record(room, room_asset)
    tree = emit_nodes(program, room_asset, "Room", ("position",))
    assert "Room wall_tx" not in fresh_file.data.images and "Room discs_buf" in fresh_file.data.images
    assert [s.name for s in tree.interface.items_tree if s.in_out == "OUTPUT"] == ["Position"]
    assert fresh_file.data.images["Room discs_buf"].use_half_precision is False


def test_evaluate_is_what_nodes_are_compared_with(rng):
    """A guard on the bench itself: two different programs do differ on its inputs."""
    made, given = random_kernels.asset(rng), random_kernels.inputs(rng, 256)
    one, two = (evaluate(random_kernels.random_program(seed, made), given, made)["p"] for seed in (0, 1))
    assert not np.allclose(one, two, equal_nan=True)
