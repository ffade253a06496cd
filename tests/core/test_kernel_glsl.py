"""The GLSL emitter's text: what it leaves out, where it puts things, what it calls them. Answers: tests/device."""

import re

import numpy as np
import pytest
import random_kernels

from reflect_addon.core.asset import Asset
from reflect_addon.core.kernel import Hit, KernelError, emit_glsl, record, record_function
from reflect_addon.core.kernel.glsl_text import literal, pack_layout


def two_images(k, asset, ray):
    k.cite("popescu-2006 3.1 step 2")
    distance = k.name("distance", ray.origin.z / k.away_from_zero(ray.direction.z))
    position = k.name("position", ray.origin + ray.direction * distance)
    seen = k.fetch(asset.images["seen_tx"], position.xy)
    alpha = k.fetch(asset.images["alpha_buf"], position.xy).x
    if asset.options["tinted"]:
        seen = seen * asset.uniforms["tint"]
    return Hit(seen.rgb, position, alpha, 1.0)


def two_images_asset(**options) -> Asset:
    images = {name: np.zeros((2, 2, 4), "f") for name in ("seen_tx", "alpha_buf")}
    return Asset("toy", "", images, {"tint": (1.0, 0.5, 0.25, 1.0)}, {"tinted": True} | options)


def test_what_is_not_wanted_is_not_emitted():
    program = record(two_images, two_images_asset())
    both = emit_glsl(program)
    assert set(both.images) == {"seen_tx", "alpha_buf"} and set(both.uniforms) == {"tint"}
    radiance = emit_glsl(program, ("radiance",))
    assert set(radiance.images) == {"seen_tx"} and "alpha_buf" not in radiance.source
    position = emit_glsl(program, ("position",))
    assert not position.images and not position.uniforms and "texelFetch" not in position.source


def test_an_option_is_a_variant():
    plain = emit_glsl(record(two_images, two_images_asset(tinted=False)))
    assert "tint" not in plain.source and not plain.uniforms and not plain.push_names


def test_names_and_citations_are_kept():
    source = emit_glsl(record(two_images, two_images_asset())).source
    assert "// popescu-2006 3.1 step 2\n" in source
    assert re.search(r"float distance = origin.z / \w+;", source)
    assert "vec3 position = origin + direction * distance;" in source
    assert source.index("// popescu") < source.index("float distance")


def test_a_citation_survives_though_its_values_are_inlined():
    def kernel(k, scope, a):
        k.cite("first")
        b = a * 2.0
        k.cite("second")
        return {"x": b + 1.0}

    source = emit_glsl(record_function(kernel, {"a": "float"}), ("x",), "f").source
    assert source.index("// first") < source.index("a * 2.0") < source.index("// second")


def test_a_fetch_stays_in_its_branch_and_an_invariant_leaves_its_loop():
    def kernel(k, scope, a, b):
        image = scope.images["i_buf"]
        at = k.name("address", k.floor(a * b))

        def body(i, total):
            steady = k.name("steady", k.exp2(a))
            (value,) = k.branch(total > b, lambda: (k.fetch(image, at, i).x * k.name("lazy", k.log2(b)),), lambda: (0.0,))
            return (total + value + steady,), None

        return {"x": k.loop(9, (a,), body)[0]}

    source = emit_glsl(record_function(kernel, {"a": "float", "b": "float"}, images=("i_buf",)), ("x",), "f").source
    head, loop = source[source.index("void f") :].split("for (")
    assert "steady" in head and "exp2(a)" not in loop
    before_if, inside = loop.split("if (")
    for what in ("reflect_fetch", "lazy", "address"):
        assert what in inside and what not in before_if and f"{what} =" not in head, what


def test_dead_loop_states_are_not_in_the_text():
    def kernel(k, scope, a):
        kept, dropped = k.loop(4, (a, a), lambda i, kept, dropped: ((kept + 1.0, k.exp2(dropped)), None))
        return {"x": kept, "y": dropped}

    source = emit_glsl(record_function(kernel, {"a": "float"}), ("x",), "f").source
    assert "dropped" not in source and "exp2" not in source and "kept = kept + 1.0;" in source
    assert "float i" not in source, "the index is not read"


def test_a_loop_of_one_step_is_none():
    def kernel(k, scope, a):
        count = scope.options["count"]
        return {"x": k.loop(count, (a,), lambda i, x: ((x * 2.0 + i,), x > 5.0))[0]}

    def text(count):
        program = record_function(kernel, {"a": "float"}, options={"count": count})
        return emit_glsl(program, ("x",), "f").source

    assert "for (int i_int = 0; i_int < 2; i_int++)" in text(2) and "break" in text(2)
    assert "for (int i_int = 0; i_int < 0; i_int++)" in text(0)
    assert not any(word in text(1) for word in ("for (", "break", "_int", "stop")) and "x = x * 2.0 + 0.0;" in text(1)


def test_reserved_words_and_clashes_become_other_names():
    def kernel(k, scope, a):
        return {"x": k.name("sample", a + 1.0) * k.name("a", a + 2.0) * k.name("gl_x", a + 3.0)}

    source = emit_glsl(record_function(kernel, {"a": "float"}), ("x",), "f").source
    assert "float sample_2 = " in source and "float a_2 = " in source and "float gl_x_2 = " in source


def test_order_of_operations_is_kept():
    def kernel(k, scope, a, b):
        return {"x": a - (b - 1.0), "y": (a + b) * -(a * b), "z": k.select(~(a > b) & (b > 1.0), a / (b / a), -(-a))}

    program = record_function(kernel, {"a": "float", "b": "float"})
    source = emit_glsl(program, ("x", "y", "z"), "f").source
    for text in ("a - (b - 1.0)", "(a + b) * -(a * b)", "!(b < a) && b > 1.0 ? a / (b / a) : a"):
        assert text in source


@pytest.mark.parametrize("value", [0.0, -0.0, 1.0, 1 / 3, 1e-38, 1e9, 65504.0, 123456789.0, -2.5e-7])
def test_literals_are_the_same_float_again(value):
    assert np.float32(literal(value)) == np.float32(value)
    assert re.fullmatch(r"-?\d+\.\d+(e[+-]?\d+)?", literal(value))


def test_uniforms_beyond_the_push_constants_go_into_whole_vec4s():
    uniforms = {"a": 1.0, "b": (1.0, 2.0, 3.0), "c": (4.0, 5.0), "d": (6.0, 7.0, 8.0, 9.0), "e": 5.0, "unread": 1.0}

    def kernel(k, scope, x):
        u = scope.uniforms
        return {"x": u["a"] * u["b"].x + k.dot(u["c"], u["d"].xy) * u["e"] + x}

    program = record_function(kernel, {"x": "float"}, uniforms=uniforms)
    asset = Asset("a", "", {}, uniforms)
    pushed, block = emit_glsl(program, ("x",), "f"), emit_glsl(program, ("x",), "f", push_bytes=16)
    assert set(pushed.push_names) == {"a", "b", "c", "d", "e"} and not pushed.block_name
    assert not block.push_names and "vec4 slot[3];" in block.typedef and block.block_name in block.source
    layout, slots = pack_layout(block.uniforms)
    packed = block.pack_uniforms(asset).reshape(slots, 4)
    for name, (slot, first) in layout.items():
        want = np.ravel(uniforms[name])
        assert packed[slot, first : first + len(want)].tolist() == want.tolist()
    with pytest.raises(KernelError, match="no uniform 'a'"):
        block.pack_uniforms(Asset("a", "", {}))


def test_the_text_is_the_same_every_time(rng):
    """Shaders are cached by their text."""
    made = random_kernels.asset(rng)
    first, second = (emit_glsl(random_kernels.random_program(7, made), ("p", "q")) for _ in range(2))
    assert first == second


def test_an_unknown_output_is_named():
    with pytest.raises(KernelError, match="no output 'depth'"):
        emit_glsl(record(two_images, two_images_asset()), ("depth",))
