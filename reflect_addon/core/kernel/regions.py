"""What a region of a kernel reads from outside, and what makes two regions the same code: for emitters that write regions as functions.

Problem. A kernel that looks three times among depth maps is recorded three times; as text that is long, as shader nodes nobody can read it.
Idea. A region (a loop's body, a side of a branch) is a function of the values that it reads and does not compute. Numbered in the order in
which they are met, its values give a key, and regions of one key are one function called with other values [alpha equivalence].
"""

from collections.abc import Callable

from .graph import Node, Region
from .nonzero import is_nonzero
from .schedule import Schedule

CONSTANT = ("const", "size")  # leaves that are written where they are read


class Outline:
    """A region's statements, nested ones included.

    reads: the values from outside, in the order in which they are met; passes: those of `results` from outside that no statement reads;
    gives: those of `results` that the region computes; key: equal for regions that are the same function of what they read; statements: how many; loops: those among them."""

    def __init__(self, plan: Schedule, region: Region, results: tuple[Node, ...], bound: Callable[[Node], object]):
        """bound: of a count that differs per ray, what an emitter makes of it beside its value."""
        self.plan, self.bound = plan, bound
        self.reads: list[Node] = []
        self.statements = self.loops = 0
        self._numbers: dict[Node, int] = {}
        key = self._region(region)
        outside = set(self.reads)
        self.gives = tuple(dict.fromkeys(n for n in results if n in self._numbers and n not in outside))
        self.passes = tuple(dict.fromkeys(n for n in results if n not in self._numbers and n.op not in CONSTANT))
        self.key = (key, tuple(self._numbers[n] for n in self.gives), tuple((self._numbers[n], n.type) for n in self.reads))

    def _define(self, *nodes: Node) -> None:
        for node in nodes:
            self._numbers[node] = len(self._numbers)

    def _read(self, *nodes: Node) -> tuple:
        found = []
        for node in nodes:
            if node.op in CONSTANT:
                found.append((node.op, node.type, repr(node.data)))
                continue
            if node not in self._numbers:
                self._define(node)
                self.reads.append(node)
            found.append(self._numbers[node])
        return tuple(found)

    def _region(self, region: Region) -> tuple:
        return tuple(self._statement(node) for node in self.plan.blocks[region])

    def _statement(self, node: Node) -> tuple:
        self.statements += 1
        if node.op in ("loop", "branch"):
            return (self._loop if node.op == "loop" else self._branch)(node, self.plan.live[node])
        read = self._read(*node.args)
        self._define(node)
        return node.op, node.type, repr(node.data), read, node.op == "div" and is_nonzero(node.args[1])

    def _loop(self, node: Node, live: tuple[int, ...]) -> tuple:
        loop = node.data
        self.loops += 1
        count = (loop.count,) if loop.count is not None else (*self._read(node.args[-1]), self.bound(node.args[-1]))
        begin = self._read(*(node.args[k] for k in live))
        self._define(loop.index, *(loop.states[k] for k in live))
        body = self._region(loop.body)
        ends = self._read(*(loop.body.results[k] for k in live), *loop.body.results[-1:] * loop.has_stop)
        self._define(*(loop.items[k] for k in live))
        return "loop", count, begin, tuple(loop.states[k].type for k in live), body, ends, loop.has_stop

    def _branch(self, node: Node, live: tuple[int, ...]) -> tuple:
        branch, condition = node.data, self._read(node.args[0])
        sides = []
        for side in (branch.then, branch.other):
            body = self._region(side)
            sides.append((body, self._read(*(side.results[k] for k in live))))
        self._define(*(branch.items[k] for k in live))
        return "branch", condition, tuple(sides)
