"""`k`: the functions of the kernel language. Each records one node, or a few.

Everything is defined for every finite input, and the same in every emitter: sqrt of a negative number is 0, log2 of
zero or less is that of the smallest normal float, normalize of a zero vector is zero. What is left to the kernel is
division: x / 0 is infinite in NumPy and GLSL and merely huge in shader nodes, so divide by k.away_from_zero(x).
exp2 and log2 are within a few roundings of each other, no more: GPUs say exp2(3) = 7.9999995, so never floor them.
"""

import inspect
import math
from collections.abc import Callable

from .graph import SIZES, VECTORS, Branch, Graph, KernelError, Loop
from .values import Image, Value, compare, elementwise, lift

SMALLEST = 1.1754944e-38  # the smallest normal float32: guards roots and logarithms; below it GPUs flush to 0
MOST_STEPS = 65536  # a loop whose count comes from a damaged asset must still end: a hung GPU takes Blender with it


class Recorder:
    """Handed to a kernel as `k`."""

    def __init__(self, graph: Graph):
        self.graph = graph

    # Names and citations: for the reader of the emitted code only.

    def name(self, name: str, value) -> Value:
        """The same value, called `name` in emitted code."""
        value = lift(self.graph, value, f"name '{name}'")
        if not name.isidentifier():
            raise KernelError(f"'{name}' is no name for a variable")
        if value.node.op == "item" or (value.node.op != "const" and not value.node.name):
            value.node.name = name
        return value

    def cite(self, text: str) -> None:
        """A comment above whatever is recorded next: a paper's section, a step, an argument."""
        self.graph.citations.append((len(self.graph.nodes), " ".join(text.split())))

    # Values.

    def vec2(self, *parts) -> Value:
        return self._vector(2, parts)

    def vec3(self, *parts) -> Value:
        return self._vector(3, parts)

    def vec4(self, *parts) -> Value:
        return self._vector(4, parts)

    def _vector(self, size: int, parts) -> Value:
        values = [lift(self.graph, p, f"vec{size}") for p in parts]
        if len(values) == 1 and values[0].type == "float":
            values *= size
        if any(v.type == "bool" for v in values) or sum(SIZES[v.type] for v in values) != size:
            raise KernelError(f"vec{size} cannot be made of {', '.join(v.node.describe() for v in values) or 'nothing'}")
        if len(values) == 1:
            return values[0]
        return Value(self.graph, self.graph.node("vec", VECTORS[size], tuple(v.node for v in values)))

    def min(self, a, b, *more) -> Value:
        return self._fold("min", a, b, *more)

    def max(self, a, b, *more) -> Value:
        return self._fold("max", a, b, *more)

    def _fold(self, op: str, first, *rest) -> Value:
        for value in rest:
            first = elementwise(self.graph, op, first, value)
        return first

    def floor(self, a) -> Value:
        return elementwise(self.graph, "floor", a)

    def ceil(self, a) -> Value:
        return -self.floor(-lift(self.graph, a, "ceil"))

    def fract(self, a) -> Value:
        return a - self.floor(a)

    def abs(self, a) -> Value:
        return elementwise(self.graph, "abs", a)

    def sqrt(self, a) -> Value:
        return elementwise(self.graph, "sqrt", self.max(a, 0.0))

    def exp2(self, a) -> Value:
        return elementwise(self.graph, "exp2", a)

    def log2(self, a) -> Value:
        return elementwise(self.graph, "log2", self.max(a, SMALLEST))

    def clamp(self, a, low, high) -> Value:
        return self.min(self.max(a, low), high)

    def mix(self, a, b, t) -> Value:
        """a + (b - a) * t: exactly a at t = 0."""
        a = lift(self.graph, a, "mix")
        return a + (lift(self.graph, b, "mix") - a) * t

    def away_from_zero(self, a, least: float = 1e-20) -> Value:
        """a, its magnitude raised to `least`, its sign kept (0 and -0 count as positive): a safe float divisor."""
        return self.max(self.abs(a), least) * self.select(a < 0.0, -1.0, 1.0)

    def equal(self, a, b) -> Value:
        return compare(self.graph, "eq", a, b)

    def dot(self, a, b) -> Value:
        return self._geometric("dot", "float", a, b)

    def cross(self, a, b) -> Value:
        return self._geometric("cross", "vec3", a, b)

    def _geometric(self, op: str, kind: str, a, b) -> Value:
        a, b = lift(self.graph, a, op), lift(self.graph, b, op)
        if a.type != b.type or SIZES[a.type] == 1 or (op == "cross" and a.type != "vec3"):
            raise KernelError(f"{op} does not take {a.node.describe()} and {b.node.describe()}")
        return Value(self.graph, self.graph.node(op, kind, (a.node, b.node)))

    def length(self, a) -> Value:
        return elementwise(self.graph, "sqrt", self.dot(a, a))

    def normalize(self, a) -> Value:
        a = lift(self.graph, a, "normalize")
        return a / elementwise(self.graph, "sqrt", self.max(self.dot(a, a), SMALLEST))

    def reflect(self, direction, normal) -> Value:
        """The direction mirrored at a unit normal."""
        normal = lift(self.graph, normal, "reflect")
        return direction - normal * (2.0 * self.dot(direction, normal))

    def select(self, condition, a, b) -> Value:
        """a where the condition holds, else b; both are computed. k.branch computes only one."""
        condition = self._condition(condition, "select")
        a, b = lift(self.graph, a, "select"), lift(self.graph, b, "select")
        if a.type != b.type:
            raise KernelError(f"select between {a.node.describe()} and {b.node.describe()}: the types differ")
        return Value(self.graph, self.graph.node("select", a.type, (condition.node, a.node, b.node)))

    def _condition(self, condition, where: str) -> Value:
        condition = lift(self.graph, condition, where)
        if condition.type != "bool":
            raise KernelError(f"{where}: the condition is a {condition.node.describe()}, not a bool")
        return condition

    # Images.

    def fetch(self, image: Image, x, y=None) -> Value:
        """vec4: texel (floor x, floor y), clamped to the edge. A vec2 does for x and y. Of a _bc1 image w is 1, and each GPU
        rounds in its own way what lies between a block's two colours (8 bits or more)."""
        return self._look_up("fetch", image, x, y)

    def sample(self, image: Image, x, y=None) -> Value:
        """vec4: bilinear between the four texels around (x, y) in texel coordinates (centres at + 0.5), clamped to the
        edge, weights in float32: mix(mix(t00, t10, fx), mix(t01, t11, fx), fy), mix(a, b, t) = a + (b - a) * t."""
        return self._look_up("sample", image, x, y)

    def _look_up(self, op: str, image: Image, x, y) -> Value:
        if not isinstance(image, Image):
            raise KernelError(f"{op} reads an image of asset.images, not {image!r}")
        x = lift(self.graph, x, op)
        x, y = (x.x, x.y) if y is None and x.type == "vec2" else (x, lift(self.graph, y, op))
        if x.type != "float" or y.type != "float":
            raise KernelError(f"{op} of image '{image.name}' at {x.node.describe()}, {y.node.describe()}: floats wanted")
        return Value(self.graph, self.graph.node(op, "vec4", (x.node, y.node), image.name))

    # Control flow.

    def loop(self, count, state: tuple, body: Callable) -> tuple[Value, ...]:
        """Repeats body(i, *state) -> (new state, stop) while i < count; i is a float from 0. Once stop (a bool, or None
        for never) holds, the new state of that step is kept and the loop ends. count: a number, or a float value (a
        uniform, or different per ray), of which at most MOST_STEPS are done. Names of the body's parameters are the
        states' names in emitted code."""
        graph = self.graph
        initial = tuple(lift(graph, s, "loop state") for s in state)
        limit = lift(graph, count, "loop count")
        if limit.type != "float":
            raise KernelError(f"loop: the count is a {limit.node.describe()}, not a float")
        limit = self.min(limit, MOST_STEPS)
        fixed = limit.node.op == "const"
        times = () if fixed else (limit,)
        names = _parameter_names(body, 1 + len(initial))
        region = graph.open("loop")
        index = graph.new("index", "float", (), None, region, names[0])
        states = tuple(
            graph.new("state", s.type, (), k, region, name) for k, (s, name) in enumerate(zip(initial, names[1:]))
        )
        returned = body(Value(graph, index), *(Value(graph, s) for s in states))
        if not isinstance(returned, tuple) or len(returned) != 2 or isinstance(returned[0], Value):
            raise KernelError("loop: the body must return (new state tuple, stop or None)")
        results = self._results("loop", returned[0], initial)
        stop = returned[1]
        if stop is not None:
            results += (self._condition(stop, "loop stop").node,)
        graph.close(results)
        data = Loop(math.ceil(limit.node.data[0]) if fixed else None, region, index, states, stop is not None)
        node = graph.new("loop", "tuple", tuple(v.node for v in initial + times), data, graph.region)
        return self._items(node, initial, names[1:])

    def branch(self, condition, then: Callable, other: Callable) -> tuple[Value, ...]:
        """The tuple that then() or other() returns; in GLSL and NumPy the other one is not computed."""
        graph = self.graph
        condition = self._condition(condition, "branch")
        if condition.node.op == "const":
            chosen = then() if condition.node.data[0] else other()
            return tuple(lift(graph, v, "branch") for v in chosen)
        regions, wanted = [], None
        for kind, side in (("then", then), ("other", other)):
            region = graph.open(kind)
            returned = side()
            if isinstance(returned, Value) or not isinstance(returned, tuple):
                raise KernelError(f"branch: {kind}() must return a tuple, not {returned!r}")
            if wanted is None:
                wanted = tuple(lift(graph, v, "branch") for v in returned)
            graph.close(self._results(f"branch, {kind}()", returned, wanted))
            regions.append(region)
        node = graph.new("branch", "tuple", (condition.node,), Branch(*regions), graph.region)
        return self._items(node, wanted, [v.node.name for v in wanted])

    def _results(self, where: str, values, like: tuple[Value, ...]) -> tuple:
        values = tuple(lift(self.graph, v, where) for v in values)
        if [v.type for v in values] != [v.type for v in like]:
            have = ", ".join(v.node.describe() for v in values)
            raise KernelError(f"{where} returned ({have}), wanted ({', '.join(v.type for v in like)})")
        return tuple(v.node for v in values)

    def _items(self, node, like: tuple[Value, ...], names) -> tuple[Value, ...]:
        graph = self.graph
        node.data.items = tuple(
            graph.new("item", v.type, (node,), k, graph.region, name) for k, (v, name) in enumerate(zip(like, names))
        )
        return tuple(Value(graph, item) for item in node.data.items)


def _parameter_names(body: Callable, count: int) -> list[str]:
    names = [p.name for p in inspect.signature(body).parameters.values() if p.kind is p.POSITIONAL_OR_KEYWORD]
    return [n.strip("_") or "unnamed" for n in names] if len(names) == count else ["step"] + ["state"] * (count - 1)
