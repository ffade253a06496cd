"""The expression graph that a kernel is recorded into: typed, hash-consed nodes in nested regions.

Equal expressions become one node (so each is emitted once). A region is the body of a loop or one side of a branch;
`Node.home` is the outermost region in which a node can be computed, `schedule.py` later decides where it is.
"""

import math
from dataclasses import dataclass, field

SIZES = {"float": 1, "bool": 1, "vec2": 2, "vec3": 3, "vec4": 4}
VECTORS = {2: "vec2", 3: "vec3", 4: "vec4"}
LETTERS = "xyzw"


class KernelError(TypeError):
    """A kernel that cannot be recorded or emitted: a type that does not fit, an unknown name, a Python `if` on a
    value that is known only per ray. The message names the operation and the values."""


@dataclass(eq=False)
class Region:
    """A body of statements. kind: 'root' | 'loop' | 'then' | 'other'; parent is the region it was recorded in."""

    kind: str
    parent: "Region | None"
    depth: int = 0
    start: int = 0  # id of the first node recorded in it
    results: tuple["Node", ...] = ()

    def is_inside(self, other: "Region") -> bool:
        region = self
        while region is not None and region.depth > other.depth:
            region = region.parent
        return region is other


@dataclass(eq=False, repr=False)  # the whole expression as text: a failed test would fill the memory with it
class Node:
    """One operation. id grows in recording order, so operands always have smaller ids than what uses them."""

    id: int
    op: str
    type: str  # a key of SIZES, or 'tuple' for a loop or branch, whose values are its 'item' nodes
    args: tuple["Node", ...]
    data: object  # const: tuple; input, uniform, image, size: name; swizzle: letters; item: index; loop, branch: below
    home: Region
    name: str = ""

    def describe(self) -> str:
        return f"{self.type} '{self.name}'" if self.name else f"{self.type} ({self.op})"


@dataclass(eq=False)
class Loop:
    """data of a 'loop' node. Its args are the initial states, then the symbolic count where count is None."""

    count: int | None
    body: Region  # results: the new states, then the stop where has_stop
    index: Node
    states: tuple[Node, ...]
    has_stop: bool
    items: tuple[Node, ...] = ()  # the values it gives: one 'item' node per state


@dataclass(eq=False)
class Branch:
    """data of a 'branch' node. Its one arg is the condition."""

    then: Region
    other: Region
    items: tuple[Node, ...] = ()  # the values it gives: one 'item' node per result


@dataclass(eq=False)
class Graph:
    nodes: list[Node] = field(default_factory=list)
    root: Region = field(default_factory=lambda: Region("root", None))
    citations: list[tuple[int, str]] = field(default_factory=list)  # (id of the next node, text)

    def __post_init__(self):
        self.region = self.root
        self._known: dict[tuple, Node] = {}

    def const(self, kind: str, *values) -> Node:
        if kind == "bool":
            return self.node("const", kind, (), (bool(values[0]),))
        values = tuple(float(v) for v in values)
        if not all(map(math.isfinite, values)):
            raise KernelError(f"a constant must be finite, got {values}")
        return self.node("const", kind, (), values)

    def node(self, op: str, kind: str, args: tuple[Node, ...] = (), data: object = None) -> Node:
        """The node for this operation, new or known, simplified where that is free of rounding."""
        for arg in args:
            if not self.region.is_inside(arg.home):
                raise KernelError(
                    f"{op}: {arg.describe()} belongs to a loop or branch that has ended; return it from that body"
                )
        simpler = simplify(self, op, kind, args, data)
        if simpler is not None:
            return simpler
        key = (op, kind, tuple(a.id for a in args), repr(data))
        known = self._known.get(key)
        if known is None:
            known = self.new(op, kind, args, data, max((a.home for a in args), key=lambda r: r.depth, default=self.root))
            self._known[key] = known
        return known

    def new(self, op: str, kind: str, args: tuple[Node, ...], data: object, home: Region, name: str = "") -> Node:
        """A node of its own, never shared: parameters, loops, branches."""
        self.nodes.append(Node(len(self.nodes), op, kind, args, data, home, name))
        return self.nodes[-1]

    def open(self, kind: str) -> Region:
        self.region = Region(kind, self.region, self.region.depth + 1, len(self.nodes))
        return self.region

    def close(self, results: tuple[Node, ...]) -> None:
        self.region.results = results
        self.region = self.region.parent


FOLDS = {
    "add": lambda a, b: a + b,
    "sub": lambda a, b: a - b,
    "mul": lambda a, b: a * b,
    "div": lambda a, b: a / b if b else math.nan,
    "min": lambda a, b: b if b < a else a,
    "max": lambda a, b: b if a < b else a,
    "neg": lambda a: -a,
    "abs": abs,
    "floor": lambda a: float(math.floor(a)),
    "sqrt": lambda a: math.sqrt(a) if a >= 0 else math.nan,
    "lt": lambda a, b: a < b,
    "le": lambda a, b: a <= b,
    "eq": lambda a, b: a == b,
    "and": lambda a, b: a and b,
    "or": lambda a, b: a or b,
    "not": lambda a: not a,
}
# op -> (which operand, its constant): the other operand is the answer. Adding 0 may turn -0 into 0; nothing else differs.
NEUTRAL = {"add": ((0, 0.0), (1, 0.0)), "sub": ((1, 0.0),), "mul": ((0, 1.0), (1, 1.0)), "div": ((1, 1.0),)}
NEUTRAL_BOOL = {"and": (True, False), "or": (False, True)}  # op -> (gives the other operand, gives itself)


def simplify(graph: Graph, op: str, kind: str, args: tuple[Node, ...], data: object) -> Node | None:
    """A known node that means the same, or None."""
    constant = bool(args) and all(a.op == "const" for a in args)
    if op in FOLDS and constant:
        size = SIZES[kind]
        columns = zip(*(a.data if len(a.data) > 1 else a.data * size for a in args))
        values = [FOLDS[op](*column) for column in columns]
        if kind == "bool" or all(map(math.isfinite, values)):
            return graph.const(kind, *values)
    for which, value in NEUTRAL.get(op, ()):
        if args[which].op == "const" and set(args[which].data) == {value} and args[1 - which].type == kind:
            return args[1 - which]
    if op in NEUTRAL_BOOL:
        for which in (0, 1):
            if args[which].op == "const":
                return args[1 - which] if args[which].data[0] == NEUTRAL_BOOL[op][0] else args[which]
    if op in ("not", "neg") and args[0].op == op:
        return args[0].args[0]
    if op == "select":
        if args[0].op == "const":
            return args[1] if args[0].data[0] else args[2]
        if args[1] is args[2]:
            return args[1]
    if op in ("max", "min") and args[1].op == "const" and args[0].op == op and args[0].type == kind:
        bound, inner = args[1], args[0].args[1]  # max(max(x, 1), 0) is max(x, 1)
        if inner.op == "const" and inner.type == bound.type == "float":
            if FOLDS[op](inner.data[0], bound.data[0]) == inner.data[0]:
                return args[0]
    if op == "vec" and constant:
        return graph.const(kind, *(v for a in args for v in a.data))
    if op == "swizzle":
        return _simplify_swizzle(graph, kind, args[0], data)
    return None


def _simplify_swizzle(graph: Graph, kind: str, vector: Node, letters: str) -> Node | None:
    if letters == LETTERS[: SIZES[vector.type]]:
        return vector
    picks = [LETTERS.index(letter) for letter in letters]
    if vector.op == "const":
        return graph.const(kind, *(vector.data[p] for p in picks))
    if vector.op == "swizzle":
        return graph.node("swizzle", kind, vector.args, "".join(vector.data[p] for p in picks))
    if vector.op == "vec" and len(letters) == 1:
        offset = picks[0]
        for arg in vector.args:
            if offset < SIZES[arg.type]:
                return arg if arg.type == "float" else graph.node("swizzle", "float", (arg,), LETTERS[offset])
            offset -= SIZES[arg.type]
    return None
