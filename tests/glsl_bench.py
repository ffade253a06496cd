"""Runs GLSL kernels in a compute shader: rays in float textures, every output in its own RGBA32F image."""

import numpy as np

WIDTH = 128  # texels per row of the input and output images


def texture(gpu, pixels: np.ndarray):
    """(H, W, 4) floats as an RGBA32F texture that is read texel by texel."""
    pixels = np.ascontiguousarray(pixels, np.float32)
    height, width = pixels.shape[:2]
    made = gpu.types.GPUTexture((width, height), format="RGBA32F", data=gpu.types.Buffer("FLOAT", pixels.size, pixels.ravel()))
    made.filter_mode(False)
    return made


def as_rows(values: np.ndarray) -> np.ndarray:
    """(N,) or (N, c) padded to (rows, WIDTH, 4)."""
    values = np.asarray(values, np.float32).reshape(len(values), -1)
    rows = -(-len(values) // WIDTH)
    out = np.zeros((rows * WIDTH, 4), np.float32)
    out[: len(values), : values.shape[1]] = values
    return out.reshape(rows, WIDTH, 4)


def _is_read(shader, name: str) -> bool:
    """False for what the driver's compiler found out to be without effect: setting that is an error."""
    try:
        shader.uniform_from_name(name)
    except ValueError:
        return False
    return True


def run_glsl(gpu, kernels, inputs: dict[str, np.ndarray], assets) -> list[dict[str, np.ndarray]]:
    """Outputs of each kernel (they share inputs) for its asset: name -> (N,) or (N, c) float32. One shader for all."""
    count = len(next(iter(inputs.values())))
    info, body, bound = gpu.types.GPUShaderCreateInfo(), [], []
    slot = 0
    for name, values in inputs.items():
        info.sampler(slot, "FLOAT_2D", f"input_{name}")
        bound.append((f"input_{name}", texture(gpu, as_rows(values))))
        kind, letters = next(iter(kernels)).inputs[name], "xyzw"[: np.asarray(values).reshape(count, -1).shape[1]]
        body.append(f"{kind} {name} = texelFetch(input_{name}, here, 0).{letters};")
        slot += 1
    blocks, typedefs, pushed, results = [], [], [], []
    rows = as_rows(np.zeros(count)).shape[0]
    for kernel, asset in zip(kernels, assets):
        for name, sampler in kernel.images.items():
            info.sampler(slot, "FLOAT_2D", sampler)
            bound.append((sampler, texture(gpu, asset.images[name])))
            slot += 1
        if kernel.block_name:
            typedefs.append(kernel.typedef)
            info.uniform_buf(len(blocks), kernel.block_type, kernel.block_name)
            blocks.append((kernel.block_name, gpu.types.GPUUniformBuf(kernel.pack_uniforms(asset))))
        values = kernel.values(asset) if kernel.uniforms else {}
        for name, constant in kernel.push_names.items():
            kind = kernel.uniforms[name]
            info.push_constant({"bool": "FLOAT"}.get(kind, kind.upper()), constant)
            pushed.append((constant, values[name]))
        for name, kind in kernel.outputs.items():
            body.append(f"{kind} {kernel.function}_{name};")
        arguments = [*kernel.inputs, *(f"{kernel.function}_{n}" for n in kernel.outputs)]
        body.append(f"{kernel.function}({', '.join(arguments)});")
        for name, kind in kernel.outputs.items():
            variable = f"{kernel.function}_{name}"
            parts = {"vec2": f"{variable}, 0.0, 0.0", "vec3": f"{variable}, 0.0"}.get(kind, variable)
            body.append(f"imageStore({variable}_img, here, vec4({'float(' + parts + ')' if kind == 'bool' else parts}));")
            image = gpu.types.GPUTexture((WIDTH, rows), format="RGBA32F")
            info.image(len(results), "RGBA32F", "FLOAT_2D", f"{variable}_img", qualifiers={"WRITE"})
            results.append((kernel, name, kind, f"{variable}_img", image))
    if typedefs:
        info.typedef_source("".join(typedefs))
    info.local_group_size(32, 1, 1)
    lines = ["ivec2 here = ivec2(gl_GlobalInvocationID.xy);", *body]
    info.compute_source("".join(k.source for k in kernels) + "void main()\n{\n  " + "\n  ".join(lines) + "\n}\n")
    shader = gpu.shader.create_from_info(info)
    shader.bind()
    for name, made in bound:
        if not _is_read(shader, name):
            continue
        shader.uniform_sampler(name, made)
    for name, block in blocks:
        shader.uniform_block(name, block)
    for name, value in pushed:
        if not _is_read(shader, name):
            continue
        shader.uniform_float(name, value if len(value) > 1 else value[0])
    for *_, name, image in results:
        shader.image(name, image)
    gpu.compute.dispatch(shader, WIDTH // 32, rows, 1)
    outputs: dict[str, dict] = {k.function: {} for k in kernels}
    for kernel, name, kind, _, image in results:
        values = np.array(image.read(), np.float32).reshape(-1, 4)[:count]
        size = {"vec2": 2, "vec3": 3, "vec4": 4}.get(kind, 1)
        outputs[kernel.function][name] = values[:, :size] if size > 1 else values[:, 0]
    gpu.shader.unbind()
    return [outputs[k.function] for k in kernels]
