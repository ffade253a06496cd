"""The symbolic values a kernel computes with: Python operators and swizzles that record nodes."""

import numbers

import numpy as np

from .graph import LETTERS, SIZES, VECTORS, Graph, KernelError, Node


class Image:
    """A handle to one of the asset's images: `k.fetch(image, x, y)`, `image.size`."""

    def __init__(self, graph: Graph, name: str):
        self.graph, self.name = graph, name

    @property
    def size(self) -> "Value":
        """vec2: (width, height) in texels. Not of block-compressed images: gpu/compressed.py may have to make them larger."""
        if self.name.endswith("_bc1"):
            raise KernelError(f"the size of '{self.name}' is not the same everywhere: put what you need of it in asset.options")
        return Value(self.graph, self.graph.node("size", "vec2", (), self.name))


class Value:
    """A float, bool, vec2, vec3 or vec4 that has a number only per ray."""

    __slots__ = ("graph", "node")
    __array_ufunc__ = None  # numpy arrays on the left hand side defer to our operators
    __hash__ = None

    def __init__(self, graph: Graph, node: Node):
        self.graph, self.node = graph, node

    @property
    def type(self) -> str:
        return self.node.type

    def __repr__(self) -> str:
        return f"<{self.node.describe()}>"

    def __bool__(self):
        raise KernelError(f"{self.node.describe()} is known only per ray: use k.select or k.branch, not a Python if")

    __float__ = __int__ = __index__ = __bool__

    def __getattr__(self, letters: str) -> "Value":
        xyzw = letters.translate(str.maketrans("rgba", LETTERS))
        size = SIZES[self.type]
        if size == 1 or not 1 <= len(xyzw) <= 4 or any(c not in LETTERS[:size] for c in xyzw):
            raise AttributeError(f"{self.node.describe()} has no component or attribute '{letters}'")
        kind = "float" if len(xyzw) == 1 else VECTORS[len(xyzw)]
        return Value(self.graph, self.graph.node("swizzle", kind, (self.node,), xyzw))

    def __iter__(self):
        if SIZES[self.type] == 1:
            raise KernelError(f"{self.node.describe()} has no components to unpack")
        return (getattr(self, c) for c in LETTERS[: SIZES[self.type]])

    def __neg__(self):
        return elementwise(self.graph, "neg", self)

    def __abs__(self):
        return elementwise(self.graph, "abs", self)

    def __invert__(self):
        return logical(self.graph, "not", self)

    def __eq__(self, other):
        raise KernelError(f"== on {self.node.describe()} would compare Python objects: use k.equal(a, b)")

    __ne__ = __eq__


def lift(graph: Graph, value, where: str) -> Value:
    """A Python number, bool, tuple of numbers or Value as a Value."""
    if isinstance(value, Value):
        if value.graph is not graph:
            raise KernelError(f"{where}: {value!r} was recorded by another kernel")
        return value
    if isinstance(value, bool | np.bool_):
        return Value(graph, graph.const("bool", value))
    if isinstance(value, numbers.Real):
        return Value(graph, graph.const("float", value))
    if isinstance(value, Image):
        raise KernelError(f"{where}: image '{value.name}' is a handle, not a value; read it with k.fetch or k.sample")
    try:
        parts = [float(v) for v in value]
    except (TypeError, ValueError):
        parts = []
    if len(parts) not in VECTORS:
        raise KernelError(f"{where}: {value!r} is no number, no bool and no 2 to 4 numbers")
    return Value(graph, graph.const(VECTORS[len(parts)], *parts))


def elementwise(graph: Graph, op: str, *operands) -> Value:
    """An operation on floats or vectors of one size; floats spread over the components of vectors."""
    values = [lift(graph, v, op) for v in operands]
    kinds = {v.type for v in values} - {"float"}
    if len(kinds) > 1 or "bool" in kinds or not all(v.type in SIZES for v in values):
        raise KernelError(f"{op} does not take {' and '.join(v.node.describe() for v in values)}")
    return Value(graph, graph.node(op, kinds.pop() if kinds else "float", tuple(v.node for v in values)))


def compare(graph: Graph, op: str, a, b) -> Value:
    a, b = lift(graph, a, op), lift(graph, b, op)
    if a.type != "float" or b.type != "float":
        raise KernelError(f"{op} compares floats, not {a.node.describe()} and {b.node.describe()}")
    return Value(graph, graph.node(op, "bool", (a.node, b.node)))


def logical(graph: Graph, op: str, *operands) -> Value:
    values = [lift(graph, v, op) for v in operands]
    if any(v.type != "bool" for v in values):
        raise KernelError(f"{op} takes bools, not {' and '.join(v.node.describe() for v in values)}")
    return Value(graph, graph.node(op, "bool", tuple(v.node for v in values)))


def _operator(function, op: str, swapped: bool):
    if swapped:
        return lambda self, other: function(self.graph, op, other, self)
    return lambda self, other: function(self.graph, op, self, other)


for _name in ("add", "sub", "mul", "truediv"):
    _op = _name.replace("true", "")
    setattr(Value, f"__{_name}__", _operator(elementwise, _op, False))
    setattr(Value, f"__r{_name}__", _operator(elementwise, _op, True))
for _name in ("and", "or"):
    setattr(Value, f"__{_name}__", _operator(logical, _name, False))
    setattr(Value, f"__r{_name}__", _operator(logical, _name, True))
for _name, _op, _swapped in (("lt", "lt", False), ("le", "le", False), ("gt", "lt", True), ("ge", "le", True)):
    setattr(Value, f"__{_name}__", _operator(compare, _op, _swapped))
