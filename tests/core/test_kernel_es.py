"""GLSL ES 3.00: what its text must not have. Numbers: tests/device/test_kernel_gles.py."""

import re

import pytest
import random_kernels

from reflect_addon.core import shading
from reflect_addon.core.asset import Asset
from reflect_addon.core.kernel import ES_300, KernelError, emit_glsl, emitted, record_function
from reflect_addon.core.methods import environment


def test_it_is_the_same_text_but_for_names_and_comments(rng):
    """One emitter: where no name and no word differs, nothing does."""
    made = random_kernels.asset(rng)
    for seed in range(8):
        program = random_kernels.random_program(seed, made)
        both = [emit_glsl(program, ("p", "q"), push_bytes=0, dialect=dialect).source for dialect in (ES_300, emit_glsl.__kwdefaults__["dialect"] if emit_glsl.__kwdefaults__ else emit_glsl.__defaults__[-1])]
        assert both[0] == both[1]


def test_words_that_browsers_keep_become_other_names():
    def kernel(k, scope, a):
        x = k.name("saturate", a + 1.0) * k.name("atomic_uint", a + 2.0) * k.name("webgl_x", a + 3.0) * k.name("two__parts", a + 4.0) * k.name("sampler3D", a + 5.0)
        return {"x": x}

    source = emit_glsl(record_function(kernel, {"a": "float"}), ("x",), "f", dialect=ES_300).source
    assert all(f"float {name} = " in source for name in ("saturate_2", "atomic_uint_2", "webgl_x_2", "two_parts", "sampler3D_2")) and "__" not in source


def test_comments_are_plain():
    """A browser takes ASCII alone, and a backslash at a line's end would swallow the next line."""

    def kernel(k, scope, a):
        k.cite("Müller 3.1 \\")
        return {"x": a * 2.0}

    source = emit_glsl(record_function(kernel, {"a": "float"}, name="kernél"), ("x",), "f", dialect=ES_300).source
    assert source.isascii() and "\\" not in source and "// M?ller 3.1 /" in source


def test_names_from_outside_are_looked_at():
    def kernel(k, scope, a):
        return {"x": k.fetch(scope.images["a__b_tx"], a, a).x}

    program = record_function(kernel, {"a": "float"}, images=("a__b_tx",))
    assert "a__b_tx" in emit_glsl(program, ("x",), "f").source
    with pytest.raises(KernelError, match="GLSL ES 3.00 takes no name like 'asset_a__b_tx'"):
        emit_glsl(program, ("x",), "f", dialect=ES_300)


def test_no_integer_meets_a_float():
    """ES converts nothing by itself. Integers are loop counters and texel addresses alone."""

    def kernel(k, scope, a):
        (total,) = k.loop(4, (a,), lambda i, total: ((total + i * 2.0,), total > 3.0))
        return {"x": k.max(total, 1.0), "y": k.vec3(0.0, a, 2.0) * 2.0}

    source = emit_glsl(record_function(kernel, {"a": "float"}), ("x", "y"), "f", dialect=ES_300).source
    for line in source.splitlines():
        if not line.strip().startswith(("for (int", "//")):
            assert not re.search(r"(?<![\w.])\d+(?![\w.]|\.\d)", line), line


def test_dialects_are_kept_apart():
    asset = Asset("environment", "", {"radiance_tx": None}, {n: 1.0 for n in ("radiance_scale", "distance_scale", "cube_size", "cube_coarsest")} | {"center": (0.0, 0.0, 0.0)})
    one, other = emitted(environment.trace, asset, ("radiance",)), emitted(environment.trace, asset, ("radiance",), ES_300)
    assert one is emitted(environment.trace, asset, ("radiance",)) and other is emitted(environment.trace, asset, ("radiance",), ES_300) and one is not other
    assert shading.REFLECTANCE_INPUTS.keys() == {"cosine", "base_color", "metallic", "specular_tint", "ior", "weight"}, "as docs/export-format.md has them"
