"""Random well-typed kernels, and inputs that go where it hurts: what all emitters are compared on."""

from contextlib import contextmanager
from functools import partial

import numpy as np
from tolerances import KERNEL_RADIANCE_RELATIVE

from reflect_addon.core.asset import Asset
from reflect_addon.core.kernel import evaluate, numpy_machine, record_function

INPUTS = {"origin": "vec3", "direction": "vec3", "width": "float"}
EDGES = np.array([0.0, -0.0, 1.0, -1.0, 0.5, 3.0, 8.0, 7.5, 1e-30, -1e-30, 1e-6, 1e4, -1e4, 1e9], np.float32)


def inputs(rng: np.random.Generator, count: int) -> dict[str, np.ndarray]:
    """A quarter of the rays is made of edge values, with directions along the axes."""
    edge = count // 4
    direction = rng.normal(size=(count, 3))
    direction[:edge] = rng.choice([0.0, -0.0, 1.0, -1.0], size=(edge, 3))
    origin = rng.uniform(-12, 12, (count, 3))
    origin[:edge] = rng.choice(EDGES, size=(edge, 3))
    origin[edge : 2 * edge] = np.round(origin[edge : 2 * edge] * 2) / 2  # texel edges and centres
    width = rng.uniform(0, 2, count)
    width[:edge] = rng.choice(EDGES, size=edge)
    length = np.linalg.norm(direction, axis=1, keepdims=True)
    direction = np.divide(direction, length, out=np.zeros_like(direction), where=length > 0)
    return {"origin": origin.astype("f"), "direction": direction.astype("f"), "width": width.astype("f")}


def asset(rng: np.random.Generator) -> Asset:
    images = {"noise_tx": rng.random((9, 16, 4)).astype(np.float16), "table_buf": rng.normal(size=(3, 7, 4)).astype("f")}
    uniforms = {"scale": 2.5, "offset": (0.25, -0.75, 1.5), "pair": (3.0, 0.5), "quad": (0.1, 0.2, 0.3, 0.4), "on": 1.0}
    return Asset("random", "", images, uniforms)


def random_program(seed: int, made: Asset):
    """Two vec4 outputs, p and q, of a program of some 15 to 60 operations."""

    def kernel(k, scope, **given):
        return _Grower(k, scope, np.random.default_rng(seed), given).outputs()

    return record_function(kernel, INPUTS, made.images, made.uniforms, name=f"random_{seed}")


class _Grower:
    def __init__(self, k, scope, rng, given):
        self.k, self.scope, self.rng = k, scope, rng
        uniforms = scope.uniforms
        self.pool = {
            "float": [given["width"], uniforms["scale"], given["origin"].x],
            "vec2": [given["origin"].xy, uniforms["pair"]],
            "vec3": [given["origin"], uniforms["offset"], given["direction"]],
            "vec4": [uniforms["quad"], k.vec4(given["direction"], 0.5)],
            "bool": [uniforms["on"] > 0.5, given["direction"].z > 0.0],
        }

    def outputs(self):
        self.grow(int(self.rng.integers(10, 22)), depth=2)
        last = {kind: self.blend(kind) for kind in self.pool}
        return {
            "p": self.k.vec4(last["vec3"], last["float"]),
            "q": last["vec4"] + self.k.vec4(last["vec2"], self.k.select(last["bool"], 1.0, 2.0), last["float"]),
        }

    def pick(self, kind: str):
        """Recent values are likelier, so that programs become deep."""
        values = self.pool[kind]
        return values[-1 - min(int(self.rng.geometric(0.4)) - 1, len(values) - 1)]

    def blend(self, kind: str):
        """Several recent values in one, so that most of what was grown has an effect."""
        values = self.pool[kind][-3:]
        if kind == "bool":
            return values[0] & ~values[-2] | values[-1]
        return values[0] - values[-2] * 0.5 + values[-1]

    def kind(self) -> str:
        return str(self.rng.choice(["float", "float", "vec2", "vec3", "vec3", "vec4"]))

    def grow(self, steps: int, depth: int) -> None:
        makers = [self.arithmetic, self.unary, self.geometry, self.assembly, self.logic, self.choice, self.look_up]
        for _ in range(steps):
            chance = self.rng.random()
            if depth and chance < 0.12:
                self.add(*self.loop(depth))
            elif depth and chance < 0.24:
                self.add(*self.branch(depth))
            else:
                self.add(makers[self.rng.integers(len(makers))]())

    def add(self, *values) -> None:
        for value in values:
            self.pool[value.type].append(value)

    def arithmetic(self):
        k, kind, op = self.k, self.kind(), self.rng.integers(7)
        a, b = self.pick(kind), self.pick(kind if self.rng.random() < 0.6 else "float")
        if op == 3:
            return a / k.max(k.abs(b), 0.25)
        if op == 6:
            return a / k.away_from_zero(self.pick("float"), 0.01)
        return [lambda: a + b, lambda: a - b, lambda: a * b, None, lambda: k.min(a, b), lambda: k.max(b, a)][op]()

    def unary(self):
        k, a = self.k, self.pick(self.kind())
        return [
            lambda: -a,
            lambda: k.abs(a),
            lambda: k.floor(a),
            lambda: k.fract(a),
            lambda: k.sqrt(a),
            lambda: k.exp2(k.clamp(a, -8.0, 8.0)),
            lambda: k.log2(a),
            lambda: k.ceil(a * 0.5),
        ][self.rng.integers(8)]()

    def geometry(self):
        k, kind = self.k, str(self.rng.choice(["vec2", "vec3", "vec4"]))
        a, b = self.pick(kind), self.pick(kind)
        return [
            lambda: k.dot(a, b),
            lambda: k.length(a),
            lambda: k.normalize(a),
            lambda: k.reflect(a, k.normalize(b)),
            lambda: k.mix(a, b, self.pick("float")),
            lambda: k.cross(self.pick("vec3"), self.pick("vec3")),
        ][self.rng.integers(6)]()

    def assembly(self):
        k, pick = self.k, self.pick
        return [
            lambda: k.vec2(pick("float"), pick("float")),
            lambda: k.vec3(pick("vec2"), pick("float")),
            lambda: k.vec4(pick("vec3"), pick("float")),
            lambda: k.vec4(pick("float"), pick("vec2"), 0.5),
            lambda: pick("vec4").xyz,
            lambda: pick("vec3").zx,
            lambda: pick("vec4").wzyx,
            lambda: pick("vec4").w,
            lambda: pick("vec3").y,
        ][self.rng.integers(9)]()

    def logic(self):
        a, b = self.pick("float"), self.pick("float")
        p, q = self.pick("bool"), self.pick("bool")
        return [lambda: a < b, lambda: a >= b * 0.5, lambda: p & q, lambda: p | q, lambda: ~p][self.rng.integers(5)]()

    def choice(self):
        kind = str(self.rng.choice([self.kind(), "bool"]))
        return self.k.select(self.pick("bool"), self.pick(kind), self.pick(kind))

    def look_up(self):
        k, image = self.k, self.scope.images[str(self.rng.choice(["noise_tx", "table_buf"]))]
        at = self.pick("vec2") if self.rng.random() < 0.7 else k.fract(self.pick("vec2")) * image.size
        return k.fetch(image, at) if self.rng.random() < 0.5 else k.sample(image, at.x, at.y)

    def inside(self, steps: int, depth: int, kinds, extra=()) -> tuple:
        """Grows on a copy of the pool, so that nothing leaves a body but what it returns."""
        outer, self.pool = self.pool, {kind: list(values) for kind, values in self.pool.items()}
        self.add(*extra)
        self.grow(steps, depth)
        made = tuple(self.blend(kind) for kind in kinds)
        self.pool, condition = outer, self.pool["bool"][-1]
        return made, condition

    def loop(self, depth: int):
        kinds = [self.kind() for _ in range(self.rng.integers(1, 4))]
        count = int(self.rng.integers(1, 7)) if self.rng.random() < 0.7 else self.scope.uniforms["scale"]
        early, steps = self.rng.random() < 0.6, int(self.rng.integers(2, 6))

        def body(i, *state):
            made, condition = self.inside(steps, depth - 1, kinds, (i, *state))
            new = tuple(self.k.clamp(s * 0.5 + m, -100.0, 100.0) for s, m in zip(state, made))
            return new, (condition & (i > 0.0)) if early else None

        return self.k.loop(count, tuple(self.pick(kind) for kind in kinds), body)

    def branch(self, depth: int):
        kinds = [str(self.rng.choice([self.kind(), "bool"])) for _ in range(self.rng.integers(1, 3))]
        steps = int(self.rng.integers(1, 5))
        side = lambda: self.inside(steps, depth - 1, kinds)[0]  # noqa: E731
        return self.k.branch(self.pick("bool"), side, side)


NUDGED = ("mul", "div", "sqrt", "exp2", "log2")  # what GPUs round their own way or contract with an addition


@contextmanager
def nudged(seed: int):
    """NumPy with every result of these operations off by up to four roundings, at random."""
    exact, rng = dict(numpy_machine.ELEMENTWISE), np.random.default_rng(seed)

    def shaken(function, *operands):
        result = np.asarray(function(*operands))
        return result * (1 + rng.uniform(-2.5e-7, 2.5e-7, result.shape)).astype(result.dtype)

    for op in NUDGED:
        numpy_machine.ELEMENTWISE[op] = partial(shaken, exact[op])
    try:
        yield
    finally:
        numpy_machine.ELEMENTWISE.update(exact)


def yardstick(program, given, made) -> tuple[dict, dict]:
    """(float32 outputs, bool masks): a component is compared where float64 and differently rounded float32 say the same,
    so that what is left is the emitters' doing and not that of a floor or comparison on the brink."""
    single = evaluate(program, given, made)
    others = [evaluate(program, given, made, dtype=np.float64)]
    for seed in range(5):
        with nudged(seed):
            others.append(evaluate(program, given, made))
    stable = {name: np.isfinite(value) for name, value in single.items()}
    with np.errstate(all="ignore"):
        for name, value in single.items():
            bound = 0.25 * KERNEL_RADIANCE_RELATIVE * (np.abs(value) + 1e-3)
            for other in others:
                stable[name] &= np.abs(value - other[name]) <= bound
    return single, stable


def disagreement(got: np.ndarray, single: np.ndarray, stable: np.ndarray, bound: float = KERNEL_RADIANCE_RELATIVE) -> float:
    """Share of the components that are stable in NumPy and yet differ by more than the tolerance."""
    with np.errstate(all="ignore"):
        agree = np.abs(got.astype(np.float64) - single) <= bound * (np.abs(single) + 1e-3)
    return float(np.mean(stable & ~agree))
