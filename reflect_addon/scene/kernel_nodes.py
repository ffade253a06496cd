"""The shader-node emitter: a recorded kernel as a node group for EEVEE and Cycles.

Loops are Repeat zones in which a `running` flag freezes the states once the kernel has stopped; both sides of a branch
are computed and the right one kept. A vec4 travels as a vector and a float, a bool as 0 or 1. What differs from the
other emitters: Blender's nodes divide by zero to 0, so x / 0 is made to be x * HUGE here (kernels that divide by
k.away_from_zero do not pay for that); an infinite value in the side of a branch that is not taken spoils the result.
"""

import bpy
import numpy as np

from ..core.kernel import KernelError, Program, evaluate
from ..core.kernel.graph import SIZES, Node, Region
from ..core.kernel.nonzero import is_nonzero
from ..core.kernel.program import Names, type_of
from ..core.kernel.schedule import schedule
from .node_images import fetch_group, image_from, sample_group
from .node_tree import Source, TreeBuilder

HUGE = 1e30  # stands for infinity: far above FAR, yet its products with scene sizes stay finite
MATH = {"add": "ADD", "sub": "SUBTRACT", "mul": "MULTIPLY", "div": "DIVIDE", "min": "MINIMUM", "max": "MAXIMUM"} | {
    "abs": "ABSOLUTE",
    "floor": "FLOOR",
    "sqrt": "SQRT",
}
VECTOR_MATH = {op: name for op, name in MATH.items() if op != "sqrt"}


def emit_nodes(
    program: Program, asset, name: str, wanted: tuple[str, ...] = ("radiance", "coverage")
) -> bpy.types.NodeTree:
    """A new shader node group. Inputs: the program's (Origin, Direction, ...); outputs: the wanted ones, a vec3 called
    radiance as Color, other vectors as Vector, bools as 0 or 1, the w of a vec4 in a second socket "NAME w".

    The asset's images become images of the file, called "NAME image"; its uniforms are labelled nodes.
    """
    emitter = _Emitter(program, asset, name, wanted)
    try:
        return emitter.emit()
    except BaseException:
        emitter.discard()
        raise


class _Emitter:
    def __init__(self, program: Program, asset, name: str, wanted):
        self.program, self.asset, self.name = program, asset, name
        self.plan = schedule(program, wanted)
        self.build = TreeBuilder(name)
        self.values: dict[Node, tuple[Source, ...]] = {}  # parts: (float,), (vector,) or (vector, float)
        self.inverted: dict[Node, Source] = {}  # condition -> 1 - condition
        self.images: dict[str, bpy.types.Image] = {}
        self.look_ups: dict[tuple[str, str], bpy.types.NodeTree] = {}

    def emit(self) -> bpy.types.NodeTree:
        build = self.build
        pixels = Names("image", f"the asset of {self.program.name}", self.asset.images)
        for name in self.plan.images:
            self.images[name] = image_from(f"{self.name} {name}", pixels[name])
        for name, node in self.program.inputs.items():
            build.socket(name.capitalize(), "Float" if SIZES[node.type] == 1 else "Vector", is_output=False)
            if node.type == "vec4":
                build.socket(f"{name.capitalize()} w", "Float", is_output=False)
        sockets = iter(build.inputs.outputs)
        for node in self.program.inputs.values():
            self.values[node] = tuple(next(sockets) for _ in range(2 if node.type == "vec4" else 1))
        for name, node in self.plan.outputs.items():
            kind = "Float" if SIZES[node.type] == 1 else "Color" if name == "radiance" else "Vector"
            build.socket(name.capitalize(), kind, is_output=True)
            if node.type == "vec4":
                build.socket(f"{name.capitalize()} w", "Float", is_output=True)
        self.block(self.program.graph.root)
        build.results(*(part for node in self.plan.outputs.values() for part in self.get(node)))
        return build.tree

    def discard(self) -> None:
        """Removes what was made so far: a kernel that nodes cannot express leaves the file as it was."""
        for group in (self.build.tree, *self.look_ups.values()):
            bpy.data.node_groups.remove(group)
        for image in self.images.values():
            bpy.data.images.remove(image)

    def get(self, node: Node) -> tuple[Source, ...]:
        if node not in self.values:
            self.values[node] = self.leaf(node)
        return self.values[node]

    def leaf(self, node: Node) -> tuple[Source, ...]:
        if node.op == "const":
            return _parts(tuple(map(float, node.data)))
        if node.op == "size":
            height, width = self.asset.images[node.data].shape[:2]
            return ((float(width), float(height), 0.0),)
        if node.op == "uniform":
            value = Names("uniform", f"the asset of {self.program.name}", self.asset.uniforms)[node.data]
            if type_of(value) != ("float" if node.type == "bool" else node.type):
                raise KernelError(f"uniform '{node.data}' is a {type_of(value)}; {self.program.name} reads a {node.type}")
            return self.uniform(node.data, tuple(float(v) for v in np.ravel(value)))
        raise KernelError(f"{self.program.name}: {node.describe()} is read before it is computed")

    def uniform(self, name: str, value: tuple[float, ...]) -> tuple[Source, ...]:
        sockets = []
        for part, constant in enumerate(_parts(value)):
            label = name if part == 0 else f"{name} w"
            kind = "ShaderNodeValue" if isinstance(constant, float) else "ShaderNodeCombineXYZ"
            node = self.build.node(kind, label)
            if isinstance(constant, float):
                node.outputs[0].default_value = constant
            else:
                for socket, component in zip(node.inputs, constant):
                    socket.default_value = component
            sockets.append(self.build.finish(node).outputs[0])
        return tuple(sockets)

    def block(self, region: Region) -> None:
        for node in self.plan.blocks[region]:
            if node.op == "loop":
                self.loop(node)
            elif node.op == "branch":
                self.branch(node)
            else:
                self.values[node] = self.operation(node)

    def operation(self, node: Node) -> tuple[Source, ...]:
        build, op, args = self.build, node.op, [self.get(a) for a in node.args]
        if op in ("fetch", "sample"):
            color, alpha = build.group(self.look_up(op, node.data), args[0][0], args[1][0], label=node.name)
            return color, alpha
        if op in ("lt", "le", "eq", "and", "or", "not"):
            return (self.logic(op, *(a[0] for a in args)),)
        if op == "select":
            return self.select(node.args[0], args[1], args[2], node.type, node.name)
        if op == "swizzle":
            components = self.components(node.args[0])
            if node.data in ("xy", "xyz"):
                return (args[0][0],)
            return self.joined([components["xyzw".index(c)] for c in node.data], node.name)
        if op == "vec":
            if node.type == "vec4" and node.args[0].type == "vec3":
                return args[0][0], args[1][0]
            return self.joined([c for arg in node.args for c in self.components(arg)], node.name)
        if op == "dot":
            return (self.dot(node, args),)
        if op == "cross":
            return (build.vector("CROSS_PRODUCT", args[0][0], args[1][0], label=node.name),)
        return self.elementwise(node, args)

    def look_up(self, op: str, image: str) -> bpy.types.NodeTree:
        key = (op, image)
        if key not in self.look_ups:
            if op == "fetch":
                self.look_ups[key] = fetch_group(f"{self.name} fetch {image}", self.images[image])
            else:
                self.look_ups[key] = sample_group(f"{self.name} sample {image}", self.look_up("fetch", image))
        return self.look_ups[key]

    def logic(self, op: str, a: Source, b: Source = 0.0) -> Source:
        math = self.build.math
        if op == "lt":
            return math("LESS_THAN", a, b)
        if op == "le":
            return math("SUBTRACT", 1.0, math("GREATER_THAN", a, b))
        if op == "eq":
            return math("SUBTRACT", 1.0, math("ADD", math("LESS_THAN", a, b), math("GREATER_THAN", a, b)))
        if op == "not":
            return math("SUBTRACT", 1.0, a)
        return math("MULTIPLY" if op == "and" else "MAXIMUM", a, b)

    def elementwise(self, node: Node, args: list[tuple]) -> tuple[Source, ...]:
        """One node per part. Division by what may be zero, and functions without a vector node, go by components."""
        op, size = node.op, SIZES[node.type]
        by_component = op in ("sqrt", "exp2", "log2") or (op == "div" and not is_nonzero(node.args[1]))
        if size > 1 and by_component:
            columns = [self.components(a) if SIZES[a.type] > 1 else (self.get(a)[0],) * size for a in node.args]
            return self.joined([self.scalar(node, *column) for column in zip(*columns)], node.name)
        results = []
        for part in range(2 if size == 4 else 1):
            operands = [a[part] if len(a) > part else a[0] for a in args]
            if size == 1 or part == 1:
                results.append(self.scalar(node, *operands))
            elif op == "neg":
                results.append(self.build.vector("SCALE", operands[0], -1.0, label=node.name))
            else:
                results.append(self.build.vector(VECTOR_MATH[op], *operands, label=node.name))
        return tuple(results)

    def scalar(self, node: Node, *operands: Source) -> Source:
        math, op = self.build.math, node.op
        if op == "neg":
            return math("MULTIPLY", operands[0], -1.0, label=node.name)
        if op == "exp2":  # bounded, so that a side of a branch that is not taken stays finite
            return math("POWER", 2.0, math("MINIMUM", operands[0], 127.0), label=node.name)
        if op == "log2":
            return math("LOGARITHM", operands[0], 2.0, label=node.name)
        if op == "div" and not is_nonzero(node.args[1]):
            a, b = operands
            nonzero = math("ADD", math("LESS_THAN", b, 0.0), math("GREATER_THAN", b, 0.0))
            return math("MULTIPLY_ADD", a, math("MULTIPLY_ADD", nonzero, -HUGE, HUGE), math("DIVIDE", a, b), label=node.name)
        return math(MATH[op], *operands, label=node.name)

    def components(self, node: Node) -> tuple[Source, ...]:
        parts = self.get(node)
        if SIZES[node.type] == 1:
            return parts
        return (*self.build.components(parts[0]), *parts[1:])[: SIZES[node.type]]

    def joined(self, components: list[Source], label: str = "") -> tuple[Source, ...]:
        if len(components) == 1:
            return tuple(components)
        return (self.build.combine(*components[:3], label=label), *components[3:])

    def dot(self, node: Node, args: list[tuple]) -> Source:
        math = self.build.math
        if node.args[0].type == "vec2":  # the third component of a vec2 is not kept at zero
            (ax, ay), (bx, by) = (self.components(a) for a in node.args)
            return math("MULTIPLY_ADD", ax, bx, math("MULTIPLY", ay, by), label=node.name)
        product = self.build.vector("DOT_PRODUCT", args[0][0], args[1][0], label=node.name)
        return math("MULTIPLY_ADD", args[0][1], args[1][1], product) if node.args[0].type == "vec4" else product

    def select(self, condition: Node, a: tuple, b: tuple, kind: str, label: str = "") -> tuple[Source, ...]:
        if condition not in self.inverted:
            self.inverted[condition] = self.build.math("SUBTRACT", 1.0, self.get(condition)[0])
        return self.keep(self.get(condition)[0], self.inverted[condition], a, b, kind, label)

    def keep(self, yes: Source, no: Source, a: tuple, b: tuple, kind: str, label: str = "") -> tuple[Source, ...]:
        """a * yes + b * no: exact, where a Mix node's a + (b - a) t would cancel between FAR and a metre."""
        results = []
        for part, (x, y) in enumerate(zip(a, b)):
            if SIZES[kind] == 1 or part == 1:
                rest = 0.0 if y == 0.0 else self.build.math("MULTIPLY", y, no)
                results.append(self.build.math("MULTIPLY_ADD", x, yes, rest, label=label))
            else:
                rest = (0.0, 0.0, 0.0) if y == (0.0, 0.0, 0.0) else self.build.vector("SCALE", y, no)
                results.append(self.build.vector("MULTIPLY_ADD", x, yes, rest, label=label))
        return tuple(results)

    def branch(self, node: Node) -> None:
        then, other, items = node.data.then, node.data.other, node.data.items
        self.block(then)
        self.block(other)
        for k in self.plan.live[node]:
            sides = (self.get(then.results[k]), self.get(other.results[k]))
            self.values[items[k]] = self.select(node.args[0], *sides, items[k].type, items[k].name)

    def loop(self, node: Node) -> None:
        build, loop, live = self.build, node.data, self.plan.live[node]
        count = loop.count if loop.count is not None else self.steps(node.args[-1])
        enter, leave = build.node("GeometryNodeRepeatInput"), build.node("GeometryNodeRepeatOutput")
        enter.pair_with_output(leave)
        leave.repeat_items.clear()
        for k in live:
            leave.repeat_items.new("FLOAT" if SIZES[loop.states[k].type] == 1 else "VECTOR", loop.states[k].name)
            if loop.states[k].type == "vec4":
                leave.repeat_items.new("FLOAT", f"{loop.states[k].name} w")
        if loop.has_stop:
            leave.repeat_items.new("FLOAT", "running")
        enter.inputs["Iterations"].default_value = count
        initial = [part for k in live for part in self.get(node.args[k])] + [1.0] * loop.has_stop
        for socket, source in zip(enter.inputs[1:], initial):
            build.plug(socket, source)
        build.finish(enter)

        sockets = iter(enter.outputs[1:])
        for k in live:
            self.values[loop.states[k]] = tuple(next(sockets) for _ in range(2 if loop.states[k].type == "vec4" else 1))
        self.values[loop.index] = (self.index(enter.outputs["Iteration"], loop, live),)
        self.block(loop.body)
        new = {k: self.get(loop.body.results[k]) for k in live}
        last = []
        if loop.has_stop:
            running = next(sockets)
            stopped = build.math("SUBTRACT", 1.0, running)
            for k in live:
                new[k] = self.keep(running, stopped, new[k], self.get(loop.states[k]), loop.states[k].type)
            last = [build.math("MULTIPLY", running, self.logic("not", self.get(loop.body.results[-1])[0]))]
        for socket, source in zip(leave.inputs, [part for k in live for part in new[k]] + last):
            build.plug(socket, source)
        build.finish(leave)
        sockets = iter(leave.outputs)
        for k in live:
            parts = tuple(next(sockets) for _ in range(2 if loop.states[k].type == "vec4" else 1))
            self.values[loop.items[k]] = parts

    def index(self, iteration: Source, loop, live) -> Source:
        """The iteration, made to wait for the one before it: zones are unrolled and Cycles computes what it can at once, so
        the table rows of all iterations would lie on its stack of 255 floats together."""
        state = next((loop.states[k] for k in live if loop.states[k].type == "float"), None)
        if state is None:
            return iteration
        nothing = self.build.math("MINIMUM", self.build.math("ABSOLUTE", self.values[state][0]), 0.0)
        return self.build.math("ADD", iteration, nothing)

    def steps(self, count: Node) -> int:
        """A count that only uniforms decide, as an int: zones are unrolled when the shader is compiled."""
        pending = [count]
        while pending:
            node = pending.pop()
            if node.op in ("input", "index", "state", "item"):
                raise KernelError(f"{self.program.name}: the loop count {count.describe()} differs per ray; nodes need one")
            pending.extend(node.args)
        program = Program(self.program.name, self.program.graph, self.program.inputs, {"count": count}, (), {})
        sizes = {name: SIZES[symbol.type] for name, symbol in self.program.inputs.items()}
        inputs = {name: np.zeros((1,) if size == 1 else (1, size)) for name, size in sizes.items()}
        return max(0, int(np.ceil(evaluate(program, inputs, self.asset)["count"][0])))


def _parts(value: tuple[float, ...]) -> tuple[Source, ...]:
    if len(value) == 1:
        return value
    return ((*value, 0.0)[:3], *value[3:])
