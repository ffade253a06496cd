"""Shader programs: what is missing is an error with its name; compiled once a session."""

from dataclasses import replace

import numpy as np
import pytest

from reflect_addon.gpu.counts import Counts


def info(**more):
    from reflect_addon.gpu.program import ProgramInfo

    parts = {
        "name": "reflect_test",
        "vertex": "fullscreen.vert.glsl",
        "fragment": "main.glsl",
        "attributes": (("FLOAT", "unused"),),
        "uniforms": (("FLOAT", "strength"), ("VEC3", "tint")),
        "outputs": (("VEC4", "out_color"),),
        "generated": (("main.glsl", "void main()\n{\n  out_color = vec4(tint * strength, 1.0);\n}\n"),),
    }
    return ProgramInfo(**(parts | more))


def test_missing_include_is_named(device):
    from reflect_addon.gpu.program import resolve_includes

    with pytest.raises(FileNotFoundError, match='a.glsl includes "nowhere_lib.glsl"'):
        resolve_includes("a.glsl", {"a.glsl": '#include "nowhere_lib.glsl"\n'})


def test_an_include_comes_once(device):
    from reflect_addon.gpu.program import resolve_includes

    text = resolve_includes("a", {"a": '#include "b"\n  #include "c"\n', "b": '#include "c"\n', "c": "float once;\n"})
    assert text.count("float once;") == 1


def test_compiled_once(device):
    from reflect_addon.gpu.program import program

    counts = Counts()
    first = program(info(name="reflect_once"), counts)
    assert program(info(name="reflect_once"), counts) is first and counts.compiles == 1
    other = replace(info(name="reflect_once"), defines=(("OTHER", "1"),))
    assert program(other, counts) is not first and counts.compiles == 2


def test_unknown_and_unset_uniforms_are_named(device):
    from reflect_addon.gpu.program import program
    from reflect_addon.gpu.state import drawing_state
    from reflect_addon.gpu.upload import triangle_batch

    shader, batch = program(info()), triangle_batch()
    screen = device.types.GPUOffScreen(4, 4, format="RGBA32F")
    with drawing_state(), screen.bind():
        shader.bind()
        shader.set("strength", 2.0)
        with pytest.raises(ValueError, match="not set before drawing: tint"):
            shader.draw(batch)
        with pytest.raises(ValueError, match="'tnit'"):
            shader.set("tnit", (1, 1, 1))
        with pytest.raises(ValueError, match="VEC3"):
            shader.set("tint", (1, 1))
        shader.set("tint", (0.5, 0.25, 1))
        shader.draw(batch)
        pixel = np.array(device.state.active_framebuffer_get().read_color(1, 1, 1, 1, 4, 0, "FLOAT").to_list())
    screen.free()
    assert pixel.ravel() == pytest.approx([1, 0.5, 2, 1])


def test_too_many_push_constants(device):
    from reflect_addon.gpu.program import program

    with pytest.raises(ValueError, match="132 bytes"):
        program(info(uniforms=(("MAT4", "a"), ("MAT4", "b"), ("FLOAT", "strength"))))


def test_a_shader_that_does_not_compile_is_named(device):
    from reflect_addon.gpu.program import program

    with pytest.raises(RuntimeError, match="reflect_broken"):
        program(info(name="reflect_broken", generated=(("main.glsl", "void main() { this is not GLSL }"),)))


def test_describe_names_the_device(device):
    from reflect_addon.gpu.device import describe

    assert describe()["backend"] and describe()["renderer"] in describe()["summary"]


def test_no_device_is_an_error_with_a_remedy(device, monkeypatch):
    from reflect_addon.core.errors import ReflectError
    from reflect_addon.gpu.device import ensure

    def refuse():
        raise SystemError("no context")

    monkeypatch.setattr(device, "init", refuse)
    with pytest.raises(ReflectError, match="No usable graphics device"):
        ensure()
