"""Runs kernels of GLSL ES 3.00 in a process of its own: Blender's graphics context and another do not share one.

A fragment shader as a loader writes it (docs/export-format.md, "Kernels"), `#version 300 es`, on software OpenGL: its compiler takes no implicit conversion, no
reserved word and no array that ES has not.
"""

import json
import subprocess
import sys
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

WIDTH = 256  # texels of a row of rays
HEADING = "#version 300 es\nprecision highp float; precision highp int; precision highp sampler2D;\n"


@dataclass
class Job:
    """One kernel and its rays."""

    source: str
    inputs: dict[str, np.ndarray]  # name -> (N,) or (N, c) float32
    outputs: dict[str, str]  # name -> type
    samplers: dict[str, np.ndarray] = field(default_factory=dict)  # name -> (H, W, 4) float16 or float32, row 0 at the bottom
    slots: np.ndarray | None = None  # (n, 4) float32
    function: str = "answer"

    def text(self) -> str:
        """The whole fragment shader."""
        lines = [f"uniform sampler2D {name};" for name in self.samplers]
        if self.slots is not None and len(self.slots):
            struct = f"{self.function.title().replace('_', '')}Uniforms"
            lines += [f"struct {struct} {{ vec4 slot[{len(self.slots)}]; }};", f"uniform {struct} {self.function}_uniforms;"]
        lines += [f"uniform sampler2D given_{name};" for name in self.inputs]
        lines += [f"layout(location = {k}) out vec4 shown_{name};" for k, name in enumerate(self.outputs)]
        lines += [self.source, "void main() {", "  ivec2 here = ivec2(gl_FragCoord.xy);"]
        arguments = []
        for name, values in self.inputs.items():
            arguments.append(f"texelFetch(given_{name}, here, 0).{'xyzw'[: values.reshape(len(values), -1).shape[1]]}")
        for name, kind in self.outputs.items():
            lines.append(f"  {kind} got_{name};")
            arguments.append(f"got_{name}")
        lines.append(f"  {self.function}({', '.join(arguments)});")
        rest = {"float": ", 0.0, 0.0, 0.0", "vec2": ", 0.0, 0.0", "vec3": ", 0.0", "vec4": ""}
        lines += [f"  shown_{name} = vec4(got_{name}{rest[kind]});" for name, kind in self.outputs.items()]
        return HEADING + "\n".join(lines) + "\n}\n"


def run_gles(jobs: list[Job], folder: Path) -> list[dict[str, np.ndarray]]:
    """Outputs of each job: name -> (N,) or (N, c) float32. folder: empty, for what goes to the other process and back."""
    folder.mkdir(parents=True, exist_ok=True)
    arrays, told = {}, []
    for k, job in enumerate(jobs):
        for name, values in job.inputs.items():
            arrays[f"{k} given_{name}"] = rows(values)
        for name, image in job.samplers.items():
            arrays[f"{k} {name}"] = image
        slots = job.slots if job.slots is not None and len(job.slots) else None
        told.append({"text": job.text(), "outputs": len(job.outputs), "slots": [] if slots is None else np.asarray(slots, np.float32).tolist(), "block": f"{job.function}_uniforms"})
    np.savez(folder / "given.npz", **arrays)
    (folder / "jobs.json").write_text(json.dumps(told))
    done = subprocess.run([sys.executable, __file__, str(folder)], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-4000:]
    results = []
    with np.load(folder / "got.npz") as got:
        for k, job in enumerate(jobs):
            count, found = len(next(iter(job.inputs.values()))), {}
            for j, (name, kind) in enumerate(job.outputs.items()):
                size = {"float": 1, "vec2": 2, "vec3": 3, "vec4": 4}[kind]
                values = got[f"{k} {j}"].reshape(-1, 4)[:count, :size]
                found[name] = values[:, 0] if size == 1 else values
            results.append(found)
    return results


def rows(values: np.ndarray) -> np.ndarray:
    """(N,) or (N, c) padded to (rows, WIDTH, 4)."""
    values = np.asarray(values, np.float32).reshape(len(values), -1)
    out = np.zeros((-(-len(values) // WIDTH) * WIDTH, 4), np.float32)
    out[: len(values), : values.shape[1]] = values
    return out.reshape(-1, WIDTH, 4)


def main(folder: Path) -> None:
    import moderngl

    context = moderngl.create_context(standalone=True, backend="egl", require=330)
    triangle = context.buffer(np.array([-1, -1, 3, -1, -1, 3], "f4").tobytes())
    got = {}
    with np.load(folder / "given.npz") as given:
        for k, job in enumerate(json.loads((folder / "jobs.json").read_text())):
            program = context.program(vertex_shader="#version 300 es\nin vec2 corner; void main() { gl_Position = vec4(corner, 0.0, 1.0); }", fragment_shader=job["text"])
            textures, height = [], 0
            for name in (n for n in given.files if n.startswith(f"{k} ")):
                array = np.ascontiguousarray(given[name])
                made = context.texture((array.shape[1], array.shape[0]), 4, array.tobytes(), dtype="f2" if array.dtype == np.float16 else "f4")
                made.filter = (moderngl.NEAREST, moderngl.NEAREST)
                if " given_" in name:
                    height = array.shape[0]
                if (uniform := name.partition(" ")[2]) in program:  # what has no effect is dropped
                    made.use(len(textures))
                    program[uniform] = len(textures)
                    textures.append(made)
            for name in program:
                if name.startswith(f"{job['block']}.slot"):
                    program[name].write(np.array(job["slots"], "f4")[: program[name].array_length].tobytes())
            targets = [context.texture((WIDTH, height), 4, dtype="f4") for _ in range(job["outputs"])]
            frame = context.framebuffer(targets)
            frame.use()
            context.vertex_array(program, [(triangle, "2f", "corner")]).render(moderngl.TRIANGLES)
            for j, target in enumerate(targets):
                got[f"{k} {j}"] = np.frombuffer(target.read(), "f4").reshape(height, WIDTH, 4)
    np.savez(folder / "got.npz", **got)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
