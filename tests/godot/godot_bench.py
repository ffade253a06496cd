"""Runs kernels of Godot's shading language in Godot, as gles_bench runs those of GLSL ES: Godot checks the text by a compiler of its own and writes GLSL from it.

Its canvas has 8 bits a channel, which is enough for the four bytes of a float32.
"""

import json
from pathlib import Path

import numpy as np
from gles_bench import WIDTH, Job, rows
from godot_program import PROJECT, godot

SIZES = {"float": 1, "vec2": 2, "vec3": 3, "vec4": 4}


def text(job: Job) -> str:
    """The whole shader."""
    lines = ["shader_type canvas_item;", "render_mode blend_disabled;", "uniform int number;"]
    lines += [f"uniform sampler2D {name} : filter_nearest, repeat_disable;" for name in (*job.samplers, *(f"given_{name}" for name in job.inputs))]
    if job.slots is not None and len(job.slots):
        lines.append(f"uniform vec4 {job.function}_uniforms[{len(job.slots)}];")
    lines += [job.source, "void fragment() {", f"  ivec2 here = ivec2(UV * vec2(textureSize(given_{next(iter(job.inputs))}, 0)));"]
    arguments = [f"texelFetch(given_{name}, here, 0).{'xyzw'[: values.reshape(len(values), -1).shape[1]]}" for name, values in job.inputs.items()]
    lines += [f"  {kind} got_{name};" for name, kind in job.outputs.items()]
    lines += [f"  {job.function}({', '.join((*arguments, *(f'got_{name}' for name in job.outputs)))});", "  float chosen = 0.0;"]
    each = [f"got_{name}{f'.{c}' if kind != 'float' else ''}" for name, kind in job.outputs.items() for c in "xyzw"[: SIZES[kind]]]
    lines += [f"  if (number == {k}) chosen = {one};" for k, one in enumerate(each)]
    lines.append("  uint bits = floatBitsToUint(chosen);")
    lines.append("  COLOR = vec4(float(bits & 255u), float((bits >> 8u) & 255u), float((bits >> 16u) & 255u), float(bits >> 24u)) / 255.0;")
    return "\n".join(lines) + "\n}\n"


def run_godot(jobs: list[Job], folder: Path) -> list[dict[str, np.ndarray]]:
    """Outputs of each job: name -> (N,) or (N, c) float32. folder: empty, for what goes to Godot and back."""
    folder.mkdir(parents=True, exist_ok=True)
    told = []
    for k, job in enumerate(jobs):
        textures = {}
        for name, image in {**job.samplers, **{f"given_{name}": rows(values) for name, values in job.inputs.items()}}.items():
            file = f"{k}_{name}"
            (folder / file).write_bytes(np.ascontiguousarray(image).tobytes())
            textures[name] = {"file": file, "half": image.dtype == np.float16, "width": image.shape[1], "height": image.shape[0]}
        slots = [] if job.slots is None else np.asarray(job.slots, np.float32).tolist()
        numbers = sum(SIZES[kind] for kind in job.outputs.values())
        height = rows(next(iter(job.inputs.values()))).shape[0]
        told.append({"text": text(job), "textures": textures, "slots": slots, "block": f"{job.function}_uniforms", "numbers": numbers, "width": WIDTH, "height": height})
    (folder / "jobs.json").write_text(json.dumps(told))
    said = godot("-s", Path(__file__).with_name("bench.gd"), "--", folder, project=PROJECT)
    assert "SHADER ERROR" not in said and "ERROR:" not in said, said[-4000:]
    results = []
    for k, job in enumerate(jobs):
        count, found, number = len(next(iter(job.inputs.values()))), {}, 0
        for name, kind in job.outputs.items():
            parts = [np.fromfile(folder / f"got{k}_{number + c}", "<f4")[:count] for c in range(SIZES[kind])]
            number += SIZES[kind]
            found[name] = parts[0] if kind == "float" else np.stack(parts, -1)
        results.append(found)
    return results
