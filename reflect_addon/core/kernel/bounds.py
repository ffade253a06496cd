"""How large a loop's count can become: interval arithmetic over recorded values, for emitters that unroll loops.

Problem. A shader-node tree has no loop that ends when a ray is done: zones are unrolled, so a tree needs the most steps that any ray takes.
Idea. Counts are small expressions of constants and uniforms with a ray's own choice in them (`k.select(found, 16, 0)`). Their range
follows from the ranges of their operands [Moore 1966]: a choice has that of both sides, `min` and `max` bound what is not known.
Limits. What a ray brings is unbounded until `min` or `max` bound it, loop states too; a kernel that counts with them says `k.clamp`.
"""

import math
from collections.abc import Callable

from .graph import Node

EVERYTHING = (-math.inf, math.inf)

Range = tuple[float, float]


def range_of(node: Node, uniform: Callable[[Node], float]) -> Range:
    """(least, most) that a float can be; infinite where that is not known. uniform: the number that a uniform's node has."""
    known: dict[Node, Range] = {}
    pending = [node]
    while pending:
        current = pending[-1]
        missing = [a for a in current.args if a not in known] if current.op in RULES else []
        if missing:
            pending += missing
            continue
        known[pending.pop()] = _range(current, [known[a] for a in current.args] if current.op in RULES else [], uniform)
    return known[node]


def _range(node: Node, operands: list[Range], uniform) -> Range:
    if node.type != "float":
        return EVERYTHING
    if node.op == "const":
        return node.data[0], node.data[0]
    if node.op == "uniform":
        value = uniform(node)
        return value, value
    return RULES[node.op](*operands) if node.op in RULES else EVERYTHING


def _product(a: Range, b: Range) -> Range:
    ends = [0.0 if 0.0 in (x, y) else x * y for x in a for y in b]  # 0 times what is not known is 0
    return min(ends), max(ends)


RULES: dict[str, Callable[..., Range]] = {
    "select": lambda _, a, b: (min(a[0], b[0]), max(a[1], b[1])),
    "min": lambda a, b: (min(a[0], b[0]), min(a[1], b[1])),
    "max": lambda a, b: (max(a[0], b[0]), max(a[1], b[1])),
    "add": lambda a, b: (a[0] + b[0], a[1] + b[1]),
    "sub": lambda a, b: (a[0] - b[1], a[1] - b[0]),
    "neg": lambda a: (-a[1], -a[0]),
    "mul": _product,
    "floor": lambda a: tuple(math.floor(x) if math.isfinite(x) else x for x in a),
}
