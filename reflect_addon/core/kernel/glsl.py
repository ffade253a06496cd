"""The GLSL emitter: one readable function per program, for Blender's gpu module and, as other dialects of the same text, for GLSL ES 3.00 and Godot.

Only what the wanted outputs need is in the text, which glsl_writer.py writes. Images are sampler2D and read with texelFetch.
"""

from dataclasses import dataclass, field

import numpy as np

from . import glsl_text as text
from .glsl_writer import GlslWriter
from .graph import SIZES, KernelError
from .program import Names, Program, type_of
from .schedule import Schedule, schedule

PUSH_BYTES = {"float": 4, "bool": 4, "vec2": 8, "vec3": 16, "vec4": 16}


@dataclass(frozen=True)
class GlslKernel:
    """Text and what to bind.

    source: the function `void FUNCTION(inputs in order, out TYPE out_NAME in order of outputs)` and its helpers.
    images: the asset's image name -> sampler2D to declare and bind. Those not read are not in here.
    uniforms: name -> type, those that are read. With block_name empty, declare each as a push constant called
    push_names[name] (a bool as a float); otherwise declare typedef and a uniform buffer block_type block_name, filled
    with pack_uniforms(asset). Without a typedef (Godot) the uniform is vec4 block_name[slots].
    """

    function: str
    source: str
    inputs: dict[str, str]  # name -> type
    outputs: dict[str, str]  # name -> type
    images: dict[str, str]
    uniforms: dict[str, str]
    push_names: dict[str, str] = field(default_factory=dict)
    block_type: str = ""
    block_name: str = ""
    typedef: str = ""

    def values(self, asset) -> dict[str, tuple[float, ...]]:
        """name -> components of the uniforms that are read, checked against their types."""
        given = Names("uniform", f"the asset of {self.function}", asset.uniforms)
        for name, kind in self.uniforms.items():
            if type_of(given[name]) != ("float" if kind == "bool" else kind):
                raise KernelError(f"uniform '{name}' is a {type_of(given[name])}; {self.function} reads a {kind}")
        return {name: tuple(float(v) for v in np.ravel(given[name])) for name in self.uniforms}

    def pack_uniforms(self, asset) -> np.ndarray:
        """(4 * slots,) float32: the uniform block's content."""
        layout, slots = text.pack_layout(self.uniforms)
        packed = np.zeros((max(slots, 1), 4), np.float32)
        for name, components in self.values(asset).items():
            slot, first = layout[name]
            packed[slot, first : first + len(components)] = components
        return packed.ravel()


def emit_glsl(
    program: Program,
    wanted: tuple[str, ...] = ("radiance", "coverage"),
    function: str = "reflect_trace",
    push_bytes: int = 128,
    prefix: str = "asset_",
    dialect: text.Dialect = text.DESKTOP,
) -> GlslKernel:
    """A GLSL function of this program. push_bytes: what is left for its uniforms among the push constants (128 in all are
    safe); more go into a uniform block. prefix: before the names of images and push constants. KernelError for an image's, input's or
    output's name that the dialect does not take."""
    plan = schedule(program, wanted)
    images = {name: prefix + name for name in plan.images}
    uniforms = {name: program.uniforms[name] for name in plan.uniforms}
    block = sum(PUSH_BYTES[kind] for kind in uniforms.values()) > push_bytes
    push_names = {} if block else {name: prefix + name for name in uniforms}
    inputs = {name: node.type for name, node in program.inputs.items()}
    outputs = {name: node.type for name, node in plan.outputs.items()}
    taken = [*inputs, *(f"out_{o}" for o in outputs), function, *push_names.values()]
    dialect.check(*taken, *images.values())
    writer = GlslWriter(program, plan, images, taken, dialect)

    block_name, block_type = f"{function}_uniforms", f"{function.title().replace('_', '')}Uniforms"
    layout, slots = text.pack_layout(uniforms)
    for name, kind in uniforms.items():
        if block:
            slot, first = layout[name]
            source = f"{block_name}{dialect.slots}[{slot}].{'xyzw'[first : first + SIZES[kind]]}"
        else:
            source = push_names[name]
        if block or kind == "bool":
            local = writer.space.new(name)
            writer.line(f"{kind} {local} = {source}{' != 0.0' if kind == 'bool' else ''};")
            source = local
        writer.uniforms[name] = source

    writer.block(program.graph.root)
    for name, node in plan.outputs.items():
        writer.line(f"out_{name} = {writer.expression(node)[0]};")
    parameters = [f"{kind} {name}" for name, kind in inputs.items()]
    parameters += [f"out {kind} out_{name}" for name, kind in outputs.items()]
    body = "\n".join(writer.lines)
    heading = f"// {dialect.comment(program.name)}: recorded kernel.\n" if program.name else ""
    return GlslKernel(
        function,
        f"{_helpers(plan)}{heading}void {function}({', '.join(parameters)})\n{{\n{body}\n}}\n",
        inputs,
        outputs,
        images,
        uniforms,
        push_names,
        block_type if block and dialect.slots else "",
        block_name if block else "",
        f"struct {block_type} {{\n  vec4 slot[{slots}];\n}};\n" if block and dialect.slots else "",
    )


def _helpers(plan: Schedule) -> str:
    """The look-ups in use, guarded so that two kernels can share a shader."""
    used = {n.op for n in plan.uses}
    parts = [("fetch", text.FETCH), ("sample", text.SAMPLE)]
    return "".join(
        f"#ifndef REFLECT_{op.upper()}\n#define REFLECT_{op.upper()}\n{code}#endif\n\n" for op, code in parts if op in used
    )
