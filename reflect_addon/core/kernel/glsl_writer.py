"""A recorded kernel's statements as the body of a GLSL function that reads as if written by hand.

Loops are `for` with `break`, or a block where there is one step; branches are `if`; names are those of k.name and of loop-body parameters;
k.cite became comments. Loops are never `do ... while`: with a `break` in it Mesa 22.3 compiles another loop.
"""

from bisect import bisect_right

from . import glsl_text as text
from .graph import KernelError, Node, Region
from .program import Program
from .schedule import LEAVES, Schedule

INLINE_LENGTH = 60  # longer expressions become variables of their own


class GlslWriter:
    """images: name -> sampler; taken: names that are in use. `lines` is what was written."""

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
