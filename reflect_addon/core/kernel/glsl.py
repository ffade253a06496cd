"""The GLSL emitter: one readable function per program, for Blender's gpu module and, as other dialects of the same text, for GLSL ES 3.00 and Godot.

Only what the wanted outputs need is in the text. Loops are `for` with `break`, or a block where there is one step; branches
are `if`; names are those of k.name and of loop-body parameters; k.cite became comments. Images are sampler2D and read with
texelFetch. Loops are never `do ... while`: with a `break` in it Mesa 22.3 compiles another loop.
"""

from bisect import bisect_right
from dataclasses import dataclass, field

import numpy as np

from . import glsl_text as text
from .graph import SIZES, KernelError, Node, Region
from .program import Names, Program, type_of
from .schedule import LEAVES, Schedule, schedule

INLINE_LENGTH = 60  # longer expressions become variables of their own
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
    writer = _Writer(program, plan, images, taken, dialect)

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


class _Writer:
    def __init__(self, program: Program, plan: Schedule, images: dict[str, str], taken: list[str], dialect: text.Dialect):
        self.program, self.plan, self.images, self.dialect = program, plan, images, dialect
        self.space = text.NameSpace([*taken, *images.values()], dialect)
        self.uniforms: dict[str, str] = {}
        self.variables: dict[Node, str] = {}
        self.inlined: dict[Node, tuple[str, int]] = {}
        self.lines: list[str] = []
        self.indent = 1
        self.sections = [start for start, _ in program.graph.citations]
        self.cited: set[int] = set()
        last: dict[int, Node] = {}  # a section must keep a statement, or its comment would be lost
        for block in plan.blocks.values():
            for node in block:
                section = self.section(node)
                if section not in last or last[section].id < node.id:
                    last[section] = node
        self.kept = set(last.values()) if self.sections else set()

    def line(self, content: str) -> None:
        self.lines.append("  " * self.indent + content)

    def section(self, node: Node) -> int:
        """Which citation a node stands under; 0 is before the first."""
        start = {"loop": lambda d: d.body.start, "branch": lambda d: d.then.start}.get(node.op)
        return bisect_right(self.sections, start(node.data) if start else node.id)

    def cite(self, node: Node) -> None:
        section = self.section(node)
        if section and section not in self.cited:
            self.cited.add(section)
            self.line(f"// {self.dialect.comment(self.program.graph.citations[section - 1][1])}")

    def expression(self, node: Node) -> tuple[str, int]:
        """(text, precedence) to read a node with: a variable, or the inlined expression."""
        if node in self.variables:
            return self.variables[node], text.ATOM
        if node in self.inlined:
            return self.inlined[node]
        if node.op == "const":
            return text.constant(node, self.dialect)
        if node.op == "input":
            return node.data, text.ATOM
        if node.op == "uniform":
            return self.uniforms[node.data], text.ATOM
        if node.op == "size":
            return f"vec2(textureSize({self.images[node.data]}, 0))", text.ATOM
        raise KernelError(f"{self.program.name}: {node.describe()} is read before it is computed")

    def block(self, region: Region) -> None:
        for node in self.plan.blocks[region]:
            if node.op == "loop":
                self.loop(node)
            elif node.op == "branch":
                self.branch(node)
            else:
                self.statement(node, region)

    def statement(self, node: Node, region: Region) -> None:
        image = self.images[node.data] if node.op in ("fetch", "sample") else ""
        expression = text.operation(node, [self.expression(a) for a in node.args], image)
        if self.is_inline(node, region, expression[0]):
            self.inlined[node] = expression
            return
        self.cite(node)
        self.variables[node] = name = self.space.new(node.name or {"fetch": "texel", "sample": "texel"}.get(node.op, "v"))
        self.line(f"{node.type} {name} = {expression[0]};")

    def is_inline(self, node: Node, region: Region, expression: str) -> bool:
        if node.name or node in self.kept or node.op in ("fetch", "sample") or len(expression) > INLINE_LENGTH:
            return False
        if node.op == "swizzle" and (node.args[0] in self.variables or node.args[0].op in LEAVES):
            return True
        uses = self.plan.uses[node]
        return len(uses) == 1 and uses[0] is region

    def branch(self, node: Node) -> None:
        self.cite(node)
        live, items, sides = self.plan.live[node], node.data.items, (node.data.then, node.data.other)
        names = {k: self.space.new(items[k].name or "picked") for k in live}
        lazy_other = not self.plan.blocks[sides[1]]  # nothing to compute there: its values are where the others start
        for k in live:
            start = f" = {self.expression(sides[1].results[k])[0]}" if lazy_other else ""
            self.line(f"{items[k].type} {names[k]}{start};")
        for word, side in (("if", sides[0]), ("else", sides[1])):
            if word == "else" and lazy_other:
                break
            self.line(f"if ({self.expression(node.args[0])[0]}) {{" if word == "if" else "} else {")
            self.indent += 1
            self.block(side)
            for k in live:
                self.line(f"{names[k]} = {self.expression(side.results[k])[0]};")
            self.indent -= 1
        self.line("}")
        self.variables.update({items[k]: names[k] for k in live})

    def loop(self, node: Node) -> None:
        self.cite(node)
        loop, live = node.data, self.plan.live[node]
        names = {k: self.space.new(loop.states[k].name) for k in live}
        for k in live:
            self.line(f"{loop.states[k].type} {names[k]} = {self.expression(node.args[k])[0]};")
            self.variables[loop.states[k]] = names[k]
        once = loop.count == 1
        if once:
            # Software OpenGL runs the body of a loop that it does not unroll once more, for nobody, to find that it has ended.
            self.variables[loop.index] = text.literal(0.0)
            self.line("{")
        else:
            counter = self.space.new(f"{loop.index.name}_int")
            limit = f"{counter} < {loop.count}"
            if loop.count is None:
                limit = f"(float({counter}) < {self.expression(node.args[-1])[0]})"  # Godot takes a type's name at the beginning for a declaration
            self.line(f"for (int {counter} = 0; {limit}; {counter}++) {{")
        self.indent += 1
        if not once and loop.index in self.plan.uses:
            self.variables[loop.index] = self.space.new(loop.index.name)
            self.line(f"float {self.variables[loop.index]} = float({counter});")
        self.block(loop.body)
        self.step(loop, live, names)
        self.indent -= 1
        self.line("}")
        self.variables.update({loop.items[k]: names[k] for k in live})

    def step(self, loop, live: tuple[int, ...], names: dict[int, str]) -> None:
        """The end of a loop body: stop is decided on the old states, then all states change at once."""
        stop = ""
        if loop.has_stop and loop.count != 1:
            stop = self.expression(loop.body.results[-1])[0]
            if self.reads(loop.body.results[-1]) & set(loop.states):
                name = self.space.new("stop")
                self.line(f"bool {name} = {stop};")
                stop = name
        moving = {k: loop.body.results[k] for k in live if loop.body.results[k] is not loop.states[k]}
        values = {k: self.expression(result)[0] for k, result in moving.items()}
        assigned: set[Node] = set()
        for k, result in moving.items():
            assigned.add(loop.states[k])
            for later, other in moving.items():
                if later > k and self.reads(other) & assigned and not values[later].startswith("next_"):
                    name = self.space.new(f"next_{names[later]}")
                    self.line(f"{other.type} {name} = {values[later]};")
                    values[later] = name
        for k in moving:
            self.line(f"{names[k]} = {values[k]};")
        if stop:
            self.line(f"if ({stop}) break;")

    def reads(self, node: Node) -> set[Node]:
        """The variables that the text of a node reads."""
        if node not in self.inlined:
            return {node}
        return set().union(*(self.reads(arg) for arg in node.args))
