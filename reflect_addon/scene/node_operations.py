"""One recorded operation as a few shader nodes: what a tree holds, of the values that it has.

A vec4 travels as a vector and a float, a bool as 0 or 1. What differs from the other emitters: Blender's nodes divide by zero to 0, so
x / 0 is made to be x * HUGE here (kernels that divide by k.away_from_zero do not pay for that).
"""

from collections.abc import Callable

import bpy
import numpy as np

from ..core.kernel.graph import SIZES, Node
from ..core.kernel.nonzero import is_nonzero
from ..core.kernel.whole import is_whole
from .node_images import Place, address, texel
from .node_tree import Source, TreeBuilder

HUGE = 1e30  # stands for infinity: far above FAR, yet its products with scene sizes stay finite
MATH = {"add": "ADD", "sub": "SUBTRACT", "mul": "MULTIPLY", "div": "DIVIDE", "min": "MINIMUM", "max": "MAXIMUM"} | {
    "abs": "ABSOLUTE",
    "floor": "FLOOR",
    "sqrt": "SQRT",
}
VECTOR_MATH = {op: name for op, name in MATH.items() if op != "sqrt"}
Parts = tuple[Source, ...]  # of a value: (float,), (vector,) or (vector, float)


class NodeScope:
    """The values of one tree. leaf: the parts of what no statement of the tree computes; place, sampler: of an image where it lies, and the
    group that samples it."""

    def __init__(
        self, build: TreeBuilder, leaf: Callable[[Node], Parts], place: Callable[[str], Place], sampler: Callable[[str], bpy.types.NodeTree]
    ):
        self.build, self.leaf, self.place, self.sampler = build, leaf, place, sampler
        self.values: dict[Node, Parts] = {}
        self.inverted: dict[Node, Source] = {}  # condition -> 1 - condition
        self.addresses: dict[tuple, Source] = {}  # (image, axis, texel) -> coordinate

    def get(self, node: Node) -> Parts:
        if node not in self.values:
            self.values[node] = self.leaf(node)
        return self.values[node]

    def operation(self, node: Node) -> tuple[Source, ...]:
        """The parts of a statement that is no loop and no branch."""
        build, op, args = self.build, node.op, [self.get(a) for a in node.args]
        if op == "fetch":
            return self.fetch(node)
        if op == "sample":
            color, alpha = build.group(self.sampler(node.data), args[0][0], args[1][0], label=node.name)
            return color, alpha
        if op in ("lt", "le", "eq", "and", "or", "not"):
            return (self.logic(node, *(a[0] for a in args)),)
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

    def fetch(self, node: Node) -> tuple[Source, Source]:
        """An exact texel; what several look-ups have in common of an address is computed once."""
        place = self.place(node.data)
        for axis, at in enumerate(node.args):
            if (key := (node.data, axis, at)) not in self.addresses:
                source = self.get(at)[0]
                if not is_whole(at):
                    source = self.build.math("FLOOR", source)
                self.addresses[key] = address(self.build, place, axis, source)
        return texel(self.build, place, *(self.addresses[node.data, axis, at] for axis, at in enumerate(node.args)), label=node.name)

    def logic(self, node: Node, a: Source, b: Source = 0.0) -> Source:
        math, op = self.build.math, node.op
        if op == "lt":
            return math("LESS_THAN", a, b)
        if op in ("and", "or"):
            return math("MULTIPLY" if op == "and" else "MAXIMUM", a, b)
        if op == "not":
            self.inverted[node] = a
        elif op == "le":
            self.inverted[node] = math("GREATER_THAN", a, b)
        else:
            self.inverted[node] = math("ADD", math("LESS_THAN", a, b), math("GREATER_THAN", a, b))
        return math("SUBTRACT", 1.0, self.inverted[node])

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

    def otherwise(self, condition: Node) -> Source:
        if condition not in self.inverted:
            self.inverted[condition] = self.build.math("SUBTRACT", 1.0, self.get(condition)[0])
        return self.inverted[condition]

    def select(self, condition: Node, a: tuple, b: tuple, kind: str, label: str = "") -> tuple[Source, ...]:
        no = 0.0 if all(step_between(x, y) is not None for x, y in zip(a, b)) else self.otherwise(condition)
        return self.keep(self.get(condition)[0], no, a, b, kind, label)

    def keep(self, yes: Source, no: Source, a: tuple, b: tuple, kind: str, label: str = "") -> tuple[Source, ...]:
        """a * yes + b * no: exact, where a Mix node's a + (b - a) t would cancel between FAR and a metre."""
        results = []
        for part, (x, y) in enumerate(zip(a, b)):
            is_float = SIZES[kind] == 1 or part == 1
            make, zero = (self.build.math, 0.0) if is_float else (self.build.vector, (0.0, 0.0, 0.0))
            step = step_between(x, y)
            if (step, y) == (1.0, 0.0):
                results.append(yes)
            elif step is not None:
                results.append(make("MULTIPLY_ADD", yes, step, y, label=label))
            elif x == zero:
                results.append(make("MULTIPLY", y, no, label=label))
            else:
                rest = zero if y == zero else make("MULTIPLY", y, no)
                results.append(make("MULTIPLY_ADD", x, yes, rest, label=label))
        return tuple(results)


def step_between(x: Source, y: Source) -> float | None:
    """x - y of two constants where y + (x - y) is x in float32, too: then yes * (x - y) + y chooses between them exactly."""
    if not (isinstance(x, float) and isinstance(y, float)):
        return None
    a, b = np.float32(x), np.float32(y)
    return float(a - b) if (a - b) + b == a else None


def parts_of(value: tuple[float, ...]) -> Parts:
    """The parts of a constant."""
    if len(value) == 1:
        return value
    return ((*value, 0.0)[:3], *value[3:])


def part_kinds(kind: str) -> tuple[str, ...]:
    """The sockets that a value of this type takes."""
    return ("Float",) if SIZES[kind] == 1 else ("Vector", "Float") if kind == "vec4" else ("Vector",)
