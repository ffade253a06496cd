"""Which numbers are certain to be whole: emitters whose look-ups take coordinates need not round those."""

from .graph import Node

KEEPS = ("add", "sub", "mul", "min", "max", "neg", "abs")


def is_whole(node: Node) -> bool:
    """Whether a float is certain to have no fraction, as a loop's index, k.floor and sums of such have none."""
    if node.op == "const":
        return all(value == int(value) for value in node.data)
    if node.op in ("index", "floor", "size"):
        return True
    if node.op == "select":
        return all(map(is_whole, node.args[1:]))
    return node.op in KEEPS and all(map(is_whole, node.args))
