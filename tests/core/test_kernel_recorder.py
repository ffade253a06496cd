"""The kernel language: what it records, what it refuses and how it says so."""

import numpy as np
import pytest

from reflect_addon.core.asset import Asset
from reflect_addon.core.kernel import Hit, KernelError, evaluate, record, record_function
from reflect_addon.core.kernel.nonzero import is_nonzero
from reflect_addon.core.kernel.schedule import schedule


def scalar(function, **values):
    """The outputs of a kernel of floats, for one set of inputs."""
    program = record_function(function, {name: "float" for name in values})
    return {k: v[0] for k, v in evaluate(program, {n: np.array([v]) for n, v in values.items()}).items()}


def test_equal_expressions_are_one_node():
    def kernel(k, scope, a):
        return {"x": k.sqrt(a + 1.0) * 2.0, "y": k.sqrt(a + 1.0)}

    program = record_function(kernel, {"a": "float"})
    assert sum(n.op == "sqrt" for n in program.graph.nodes) == 1


def test_defined_where_floating_point_is_not():
    def kernel(k, scope, a):
        zero = k.vec3(0.0)
        return {
            "root": k.sqrt(a),
            "log": k.log2(a),
            "unit": k.length(k.normalize(zero * a)),
            "inverse": 1.0 / k.away_from_zero(a * 0.0),
        }

    got = scalar(kernel, a=-4.0)
    assert got["root"] == 0.0 and got["unit"] == 0.0
    assert got["log"] == pytest.approx(-126) and np.isfinite(got["inverse"])


@pytest.mark.parametrize(
    ("kernel", "words"),
    [
        (lambda k, s, a: {"x": 1.0 if a > 0.0 else 2.0}, "k.select or k.branch"),
        (lambda k, s, a: {"x": a == 1.0}, "k.equal"),
        (lambda k, s, a: {"x": k.vec2(1, 2) + k.vec3(1, 2, 3)}, "add does not take vec2"),
        (lambda k, s, a: {"x": k.vec3(a, a)}, "vec3 cannot be made of"),
        (lambda k, s, a: {"x": k.select(a, 1.0, 2.0)}, "not a bool"),
        (lambda k, s, a: {"x": k.select(a > 0.0, 1.0, k.vec2(1, 2))}, "types differ"),
        (lambda k, s, a: {"x": k.fetch(s.images["missing_tx"], a, a)}, "no image 'missing_tx' .there: here_tx"),
        (lambda k, s, a: {"x": s.uniforms["box"]}, "no uniform 'box'"),
        (lambda k, s, a: {"x": s.options["steps"]}, "no option 'steps'"),
        (lambda k, s, a: {"x": k.fetch(a, 1, 2)}, "reads an image"),
        (lambda k, s, a: {"x": s.images["here_tx"] * 2.0}, "unsupported operand|handle"),
        (lambda k, s, a: {"x": a + float("nan")}, "finite"),
        (lambda k, s, a: {"x": k.loop(3, (0.0,), lambda i, t: t)[0]}, "new state tuple"),
        (lambda k, s, a: {"x": k.loop(3, (0.0,), lambda i, t: ((k.vec2(t, t),), None))[0]}, "wanted .float"),
        (lambda k, s, a: {"x": k.branch(a > 0.0, lambda: (a,), lambda: (k.vec2(a, a),))[0]}, "wanted .float"),
        (lambda k, s, a: {"x": k.name("not a name", a)}, "no name for a variable"),
        (lambda k, s, a: {"x": int(a)}, "known only per ray"),
    ],
)
def test_mistakes_are_named(kernel, words):
    with pytest.raises(TypeError, match=words):
        record_function(kernel, {"a": "float"}, images=("here_tx",), uniforms={"u": 1.0})


def test_a_value_cannot_leave_its_loop():
    def kernel(k, scope, a):
        inside = []

        def body(i, t):
            inside.append(t * 2.0)
            return (t + 1.0,), None

        k.loop(3, (a,), body)
        return {"x": inside[0] + 1.0}

    with pytest.raises(KernelError, match="has ended"):
        record_function(kernel, {"a": "float"})


def test_missing_component_is_an_attribute_error():
    with pytest.raises(AttributeError, match="'z'"):
        record_function(lambda k, s, a: {"x": a.z}, {"a": "vec2"})


def test_hit_fields_are_checked():
    asset = Asset("toy", "", {})
    with pytest.raises(KernelError, match="Hit.radiance of toy is float"):
        record(lambda k, a, ray: Hit(ray.width, ray.origin, 1.0, 1.0), asset)


def test_unneeded_loop_states_and_branch_results_are_dropped():
    def kernel(k, scope, a):
        def body(i, t, unused, steers):
            return (t + 1.0, k.sqrt(unused) + a, steers * 2.0), steers > 100.0

        t, unused, _ = k.loop(30, (a, a, 1.0), body)
        x, y = k.branch(a > 0.0, lambda: (t, k.exp2(a)), lambda: (a, k.log2(a)))
        return {"x": x, "y": y, "z": unused}

    program = record_function(kernel, {"a": "float"})
    ops = {n.op for n in schedule(program, ("x",)).uses}
    assert not ops & {"sqrt", "exp2", "log2"}
    loop = next(n for n in program.graph.nodes if n.op == "loop")
    assert schedule(program, ("x",)).live[loop] == (0, 2), "the counter and the state that decides when to stop"
    got = evaluate(program, {"a": np.array([1.0, -1.0])}, wanted=("x",))
    assert got["x"].tolist() == [9.0, -1.0], "steers is 128 at the eighth step, whose state is kept"


def test_python_if_is_the_variant():
    def kernel(k, scope, a):
        return {"x": k.exp2(a) if scope.options["curved"] else a}

    for curved in (False, True):
        program = record_function(kernel, {"a": "float"}, options={"curved": curved})
        assert any(n.op == "exp2" for n in program.graph.nodes) is curved


FOLDED = {
    "sum": lambda k, a, b: a + b,
    "difference": lambda k, a, b: a - b,
    "product": lambda k, a, b: a * b,
    "quotient": lambda k, a, b: a / b,
    "least": lambda k, a, b: k.min(a, b),
    "most": lambda k, a, b: k.max(a, b),
    "bounds": lambda k, a, b: k.max(k.max(a, 1.0), -1.0) + k.max(k.max(b, -1.0), 1.0) * 8.0 + k.min(k.min(a, 0.5), b) * 64.0,
    "root": lambda k, a, b: k.sqrt(k.abs(a) + k.floor(b)),
    "vector": lambda k, a, b: k.dot(k.vec3(a, b, a).zyx * b, k.vec3(1.0, a, 2.0)),
    "less": lambda k, a, b: k.select((a < b) & ~(b <= a), 1.0, 2.0),
    "either": lambda k, a, b: k.select((a >= b) | k.equal(a, b), k.fract(a), k.ceil(b)),
    "side": lambda k, a, b: k.branch(a > b, lambda: (a,), lambda: (b * 2.0,))[0],
}


@pytest.mark.parametrize("name", FOLDED)
@pytest.mark.parametrize("pair", [(0.0, 1.0), (1.0, 0.0), (2.5, 2.5), (-1.5, 3.0), (1.0, -0.25)])
def test_what_is_known_while_recording_has_the_value_it_would_have(name, pair):
    """Both operands known, one of them known, none of them known: the same number."""
    function = FOLDED[name]

    def kernel(k, scope, a, b):
        known_a, known_b = pair
        return {
            "none": function(k, a, b),
            "first": function(k, known_a + 0.0 * k.vec2(0.0, 0.0).x, b),
            "second": function(k, a, k.vec2(known_b, 1.0).x),
            "both": function(k, k.vec2(known_a, 1.0).x, k.vec2(known_b, 1.0).x),
        }

    got = scalar(kernel, a=pair[0], b=pair[1])
    assert len({float(v) if np.isfinite(v) else "not finite" for v in got.values()}) == 1, got


@pytest.mark.parametrize("known", [True, False])
def test_known_bools_disappear_from_logic(known):
    def kernel(k, scope, a):
        unknown = a > 0.0
        return {"and": k.select(unknown & known, 1.0, 0.0), "or": k.select(known | unknown, 1.0, 0.0)}

    for a in (1.0, -1.0):
        got = scalar(kernel, a=a)
        assert got == {"and": float(a > 0 and known), "or": float(a > 0 or known)}


def test_states_that_others_need_step_by_step_stay():
    """What decides the end depends on b, b on c: all live although only a is wanted."""

    def kernel(k, scope, n):
        def body(i, a, b, c, dead):
            return (a + 1.0, b + c, c + 1.0, dead + a), b > 5.0

        return dict(zip("abcd", k.loop(20, (0.0, 0.0, n, 0.0), body)))

    program = record_function(kernel, {"n": "float"})
    loop = next(n for n in program.graph.nodes if n.op == "loop")
    assert schedule(program, ("a",)).live[loop] == (0, 1, 2)
    assert evaluate(program, {"n": np.array([1.0])}, wanted=("a",))["a"][0] == 4.0, "b is 0 1 3 6 at the steps"


@pytest.mark.parametrize(
    ("divisor", "sure"),
    [
        (lambda k, a: k.away_from_zero(a), True),
        (lambda k, a: k.select(k.abs(a) > 0.0, a, 1.0), True),
        (lambda k, a: k.select(k.abs(a) >= 0.0, a, 1.0), False),
        (lambda k, a: k.select(k.abs(a) <= 0.0, 1.0, a), True),
        (lambda k, a: k.select(k.abs(a) < 0.0, 1.0, a), False),
        (lambda k, a: k.select(k.abs(a) > 1e-9, 1.0, a), False),
        (lambda k, a: k.select(k.abs(a) > 1e-9, a, a * 2.0), False),
        (lambda k, a: k.select(a > 1e-9, a, 1.0), False),
        (lambda k, a: k.sqrt(k.max(a, 1e-9)), True),
        (lambda k, a: k.max(a, 0.0), False),
        (lambda k, a: k.exp2(a), False),
        (lambda k, a: k.vec3(1.0, a, 2.0), False),
        (lambda k, a: k.vec2(k.max(a, 1.0), -k.max(a, 2.0)), True),
    ],
)
def test_divisors_that_cannot_be_zero(divisor, sure):
    program = record_function(lambda k, s, a: {"x": divisor(k, a)}, {"a": "float"})
    assert is_nonzero(program.outputs["x"]) is sure
