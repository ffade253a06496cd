"""Which divisors are certain not to be zero: emitters whose target divides by zero its own way need not guard those."""

from .graph import Node


def is_nonzero(node: Node) -> bool:
    """Whether a divisor is certain not to be zero, as k.away_from_zero, k.normalize and k.max(x, 1e-6) make it."""
    if node.op == "const":
        return all(node.data)
    if node.op == "size":
        return True
    if node.op == "max":
        return any(a.op == "const" and min(a.data) > 0 for a in node.args)
    if node.op in ("sqrt", "neg", "abs", "vec"):
        return all(map(is_nonzero, node.args))
    if node.op == "mul":
        return all(map(is_nonzero, node.args)) and any(map(_is_sign, node.args))  # other products may be too small for a float
    if node.op == "select":
        condition, a, b = node.args
        a_is_sure = is_nonzero(a) or _excludes_zero(condition, a, chosen_when=True)  # select(|a| > 1e-12, a, 1)
        return a_is_sure and (is_nonzero(b) or _excludes_zero(condition, b, chosen_when=False))
    return False


def _is_sign(node: Node) -> bool:
    return node.op == "select" and all(a.op == "const" and set(map(abs, a.data)) == {1.0} for a in node.args[1:])


def _excludes_zero(condition: Node, value: Node, chosen_when: bool) -> bool:
    """Whether the condition being `chosen_when` keeps |value| away from 0: |value| > c, or not |value| < c."""
    if condition.op not in ("lt", "le"):
        return False
    limit, magnitude = condition.args if chosen_when else reversed(condition.args)
    if limit.op != "const" or magnitude.op != "abs" or magnitude.args[0] is not value:
        return False
    is_strict = (condition.op == "lt") is chosen_when  # not (|v| <= c) is |v| > c
    return limit.data[0] > 0 or (limit.data[0] == 0 and is_strict)
