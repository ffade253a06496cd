"""gpu/compute.py: compute programs are as strict as those that draw, and see what the dispatch before them wrote."""

import numpy as np
import pytest

from reflect_addon.gpu.counts import Counts

ADD = """
void main()
{
  ivec2 here = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(here, imageSize(sum_img)))) {
    return;
  }
  imageStore(sum_img, here, texelFetch(last_buf, here, 0) + step_size);
}
"""


def info(**more):
    from reflect_addon.gpu.compute import ComputeInfo

    parts = {
        "name": "reflect_test_compute",
        "compute": "main.glsl",
        "group": (8, 4, 1),
        "uniforms": (("FLOAT", "step_size"),),
        "samplers": (("FLOAT_2D", "last_buf"),),
        "images": (("RGBA32F", "FLOAT_2D", "sum_img", "WRITE"),),
        "generated": (("main.glsl", ADD),),
    }
    return ComputeInfo(**(parts | more))


def texture(device, size=(10, 6)):
    made = device.types.GPUTexture(size, format="RGBA32F")
    made.clear(format="FLOAT", value=(0, 0, 0, 0))
    return made


def test_each_dispatch_sees_the_one_before(device):
    from reflect_addon.gpu.program import program

    shader, pair = program(info()), [texture(device), texture(device)]
    for i in range(20):
        shader.bind()
        shader.set("step_size", 1)
        shader.image("last_buf", pair[i % 2])
        shader.store("sum_img", pair[1 - i % 2])
        shader.dispatch(10, 6)
    device.shader.unbind()
    assert np.all(np.array(pair[0].read()) == 20)


def test_compiled_once_and_forgotten(device):
    from reflect_addon.gpu.program import forget_programs, program

    counts = Counts()
    first = program(info(name="reflect_once_compute"), counts)
    assert program(info(name="reflect_once_compute"), counts) is first and counts.compiles == 1
    forget_programs()
    assert program(info(name="reflect_once_compute"), counts) is not first and counts.compiles == 2


def test_what_is_not_set_is_named(device):
    from reflect_addon.gpu.program import program

    shader, source = program(info()), texture(device)
    shader.bind()
    shader.set("step_size", 1)
    shader.image("last_buf", source)
    with pytest.raises(ValueError, match="not set before dispatch: sum_img"):
        shader.dispatch(10, 6)
    with pytest.raises(ValueError, match="'sum'"):
        shader.store("sum", source)
    device.shader.unbind()


def test_a_shader_that_does_not_compile_is_named_with_its_file(device):
    from reflect_addon.gpu.program import program

    with pytest.raises(RuntimeError, match=r"reflect_broken_compute \(main.glsl\)"):
        program(info(name="reflect_broken_compute", generated=(("main.glsl", "void main() { this is not GLSL }"),)))


def test_more_images_than_work_are_refused(device):
    from reflect_addon.gpu.program import program

    images = tuple(("RGBA32F", "FLOAT_2D", f"out{i}_img", "WRITE") for i in range(9))
    with pytest.raises(ValueError, match="9 images"):
        program(info(images=images))
