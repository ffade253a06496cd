"""Godot's shading language: what its text must not have. Numbers, in Godot: tests/godot/test_kernels.py."""

import re

import numpy as np
import pytest
import random_kernels

from reflect_addon.core.asset import Asset
from reflect_addon.core.kernel import ES_300, GODOT, KernelError, emit_glsl, emitted, record_function
from reflect_addon.core.methods import environment


def source_of(kernel, inputs: dict[str, str], outputs: tuple[str, ...], **more) -> str:
    return emit_glsl(record_function(kernel, inputs, **more), outputs, "f", dialect=GODOT).source


def test_it_is_the_same_text_but_for_uniforms(rng):
    """One emitter: where no name and no small constant differs, nothing else does."""
    made, compared = random_kernels.asset(rng), 0
    for seed in range(16):
        program = random_kernels.random_program(seed, made)
        es, godot = (emit_glsl(program, ("p", "q"), push_bytes=0, dialect=dialect).source for dialect in (ES_300, GODOT))
        if "uintBitsToFloat" not in godot:
            assert es.replace("_uniforms.slot[", "_uniforms[") == godot
            compared += 1
    assert compared


def test_uniforms_are_an_array():
    """Godot has no uniform of a struct."""
    asset = Asset("environment", "", {"radiance_tx": None}, {n: 1.0 for n in ("radiance_scale", "distance_scale", "cube_size", "cube_coarsest")} | {"center": (0.0, 0.0, 0.0)})
    kernel = emitted(environment.trace, asset, ("radiance",), GODOT)
    assert "= answer_uniforms[0]." in kernel.source and ".slot" not in kernel.source and not kernel.typedef and not kernel.block_type
    assert len(kernel.pack_uniforms(asset)) % 4 == 0


def test_words_that_godot_keeps_become_other_names():
    def kernel(k, scope, a):
        x = k.name("instance", a + 1.0) * k.name("source_color", a + 2.0) * k.name("TIME", a + 3.0) * k.name("two__parts", a + 4.0) * k.name("hint_x", a + 5.0)
        return {"x": x}

    source = source_of(kernel, {"a": "float"}, ("x",))
    assert all(f"float {name} = " in source for name in ("instance_2", "source_color_2", "TIME_2", "two_parts", "hint_x_2"))


def test_small_constants_keep_their_bits():
    """Godot passes constants on with 14 decimal places."""
    numbers = (1e-30, -3.3333334e-7, 9.9e-5, 1e-4, 0.0, 1.0000001, 3.4e38)
    source = source_of(lambda k, scope, a: {"x": sum((a + n for n in numbers), a)}, {"a": "float"}, ("x",))
    found = {np.uint32(int(bits, 16)).view(np.float32) for bits in re.findall(r"uintBitsToFloat\(0x(\w{8})u\)", source)}
    assert found == {np.float32(n) for n in numbers[:3]} and "0.0001" in source and "1.0000001" in source


def test_no_loop_asks_by_a_types_name():
    """Godot takes a condition that begins with one for a declaration."""

    def kernel(k, scope, a):
        (total,) = k.loop(k.min(a, 9.0), (a,), lambda i, total: ((total + i,), total > 3.0))
        return {"x": total}

    source = source_of(kernel, {"a": "float"}, ("x",))
    assert "for (int " in source and not re.search(r"for \(int \w+ = 0; (float|vec\d)\(", source)


def test_names_from_outside_are_looked_at():
    def kernel(k, scope, a):
        return {"x": k.fetch(scope.images["a__b_tx"], a, a).x}

    with pytest.raises(KernelError, match="Godot's shading language takes no name like 'asset_a__b_tx'"):
        source_of(kernel, {"a": "float"}, ("x",), images=("a__b_tx",))
