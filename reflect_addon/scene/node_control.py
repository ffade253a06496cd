"""Loops and branches of a kernel as Repeat zones.

Problem. A kernel branches and loops; a shader tree is a list of nodes that are all computed.
Idea. EEVEE keeps Repeat zones as loops of the shader, and how often one repeats may be a value of the ray. So a loop is a zone; a side of a
branch is a zone that repeats once or not at all; a loop that stops early wraps its body in such a zone. All that a zone reads goes in as
one of its items, changed or not: Blender 5.2 writes a zone's nodes in the order of their links, and what only the inside asks for is declared
inside, where what comes after the zone cannot see it ("undeclared" in the shader's log, and a pink surface).
Cycles unrolls zones and wants constant counts. `unrolled` groups therefore compute both sides of a branch and keep the right one, and loops
repeat as often as any ray may need (core/kernel/bounds.py), a flag freezing the states once the ray is done. There an infinite value in the
side of a branch that is not taken spoils the result.
"""

import numpy as np

from ..core.kernel import KernelError
from ..core.kernel.bounds import range_of
from ..core.kernel.graph import SIZES, Node, Region
from ..core.kernel.program import Names
from ..core.kernel.recorder import MOST_STEPS
from .node_operations import NodeScope, Parts, part_kinds, parts_of
from .node_tree import Source

ZONE_FROM = 24  # statements without a look-up from which the side of a branch is worth a zone: fewer cost less than its states


class ControlFlow:
    """Of an emitter, which says: scope, the tree that is being written; computed(region, results), the parts of a region's results;
    outline(region, results); program, plan, asset, unrolled."""

    scope: NodeScope
    unrolled: bool

    def zone(self, count: Source, states: list[tuple[str, str, Parts]], reads: list[Node], body) -> list[Parts]:
        """A Repeat zone. states: (name, type, what it begins with); reads: the nodes of the kernel that its body reads beside them;
        body(iteration, parts of each state) -> their new parts."""
        scope = self.scope
        held = [] if self.unrolled else [(n.name or n.op, n.type, scope.get(n)) for n in reads]
        items = [*states, *held]
        labels = [(f"{name}{end}", kind) for name, type_, _ in items for kind, end in zip(part_kinds(type_), ("", " w"))]
        enter, leave = scope.build.zone(count, labels, [part for *_, parts in items for part in parts])

        def split(sockets):
            sockets = iter(sockets)
            return [tuple(next(sockets) for _ in part_kinds(type_)) for _, type_, _ in items]

        inside = split(enter.outputs[1:])
        outer = dict(scope.values), dict(scope.inverted)
        if held:
            scope.values.update(zip(reads, inside[len(states) :]))
            scope.inverted.clear()
        new = [*body(enter.outputs[0], inside[: len(states)]), *inside[len(states) :]]
        scope.values, scope.inverted = outer
        for socket, source in zip(leave.inputs, [part for parts in new for part in parts]):
            scope.build.plug(socket, source)
        scope.build.finish(leave)
        return split(leave.outputs)[: len(states)]

    def branch(self, node: Node) -> None:
        scope, branch, live = self.scope, node.data, self.plan.live[node]
        sides = [(side, [side.results[k] for k in live]) for side in (branch.then, branch.other)]
        heavy = [not self.unrolled and self.is_heavy(*side) for side in sides]
        if any(heavy):
            counts = (scope.get(node.args[0])[0], scope.otherwise(node.args[0]))
            if all(heavy):
                found = [parts_of((0.0,) * SIZES[branch.items[k].type]) for k in live]
            else:
                found = self.computed(*sides[heavy.index(False)])
            for side, count, is_zone in zip(sides, counts, heavy):
                if is_zone:
                    states = [(branch.items[k].name or "picked", branch.items[k].type, parts) for k, parts in zip(live, found)]
                    found = self.zone(count, states, self.outside(*side), lambda _, __, side=side: self.computed(*side))
        else:
            then, other = (self.computed(*side) for side in sides)
            items = [branch.items[k] for k in live]
            found = [scope.select(node.args[0], a, b, item.type, item.name) for a, b, item in zip(then, other, items)]
        for k, parts in zip(live, found):
            scope.values[branch.items[k]] = parts

    def outside(self, region: Region, results, without=()) -> list[Node]:
        """What a zone around a region has to hold."""
        found = self.outline(region, results)
        return [node for node in (*found.reads, *found.passes) if node not in without]

    def is_heavy(self, region: Region, results) -> bool:
        found = self.outline(region, results)
        return bool(found.looks) or found.statements >= ZONE_FROM

    def loop(self, node: Node) -> None:
        loop, live = node.data, self.plan.live[node]
        states = [(loop.states[k].name, loop.states[k].type, self.scope.get(node.args[k])) for k in live]
        found = (self.unrolled_loop if self.unrolled else self.kept_loop)(node, loop, live, states)
        for k, parts in zip(live, found):
            self.scope.values[loop.items[k]] = parts

    def body(self, loop, live, step: Source, states: list[Parts]) -> tuple[list[Parts], Source]:
        """(new states, 1 where the loop goes on) of one step."""
        self.scope.values[loop.index] = (step,)
        self.scope.values.update({loop.states[k]: parts for k, parts in zip(live, states)})
        new = self.computed(loop.body, self.results(loop, live))
        return new[: len(live)], self.scope.logic("not", new[-1][0]) if loop.has_stop else 1.0

    def results(self, loop, live) -> list[Node]:
        return [loop.body.results[k] for k in live] + [loop.body.results[-1]] * loop.has_stop

    def kept_loop(self, node: Node, loop, live, states) -> list[Parts]:
        """EEVEE's: a zone that repeats as often as the ray's own count, and once it has stopped does nothing."""
        count = float(loop.count) if loop.count is not None else self.scope.build.math("CEIL", self.scope.get(node.args[-1])[0])
        own = {loop.states[k] for k in live}
        reads = self.outside(loop.body, self.results(loop, live), own)
        around = [n for n in reads if n is not loop.index]
        if not loop.has_stop:
            return self.zone(count, states, around, lambda step, parts: self.body(loop, live, step, parts)[0])

        def step_if_running(step, parts):
            def one_step(_, inner):
                new, goes_on = self.body(loop, live, self.scope.get(loop.index)[0], inner[:-1])
                return [*new, (goes_on,)]

            self.scope.values[loop.index] = (step,)
            inside = [(name, kind, p) for (name, kind, _), p in zip(running, parts)]
            return self.zone(parts[-1][0], inside, reads, one_step)

        running = [*states, ("running", "float", (1.0,))]
        return self.zone(count, running, around, step_if_running)[:-1]

    def unrolled_loop(self, node: Node, loop, live, states) -> list[Parts]:
        """Cycles': as many steps as any ray needs, frozen once the ray's own are over."""
        build = self.scope.build
        most, own = (loop.count, None) if loop.count is not None else self.bound(node.args[-1])
        may_end = loop.has_stop or own is not None
        states = [*states, ("running", "float", (1.0,))] if loop.has_stop else states

        def step(iteration, parts):
            now = self.waiting(iteration, states, parts)
            new, goes_on = self.body(loop, live, now, parts[: len(live)])
            if not may_end:
                return new
            going = parts[-1][0] if loop.has_stop else None
            if own is not None:
                within = build.math("LESS_THAN", now, self.scope.get(node.args[-1])[0])
                going = within if going is None else build.math("MULTIPLY", going, within)
            frozen = build.math("SUBTRACT", 1.0, going)
            kinds = [loop.states[k].type for k in live]
            new = [self.scope.keep(going, frozen, a, b, kind) for a, b, kind in zip(new, parts, kinds)]
            return [*new, (build.math("MULTIPLY", going, goes_on),)] if loop.has_stop else new

        return self.zone(float(most), states, [], step)[: len(live)]

    def waiting(self, iteration: Source, states, parts: list[Parts]) -> Source:
        """The iteration, made to wait for the one before it: zones are unrolled and Cycles computes what it can at once, so
        the table rows of all iterations would lie on its stack of 255 floats together."""
        state = next((p[0] for (_, kind, _), p in zip(states, parts) if kind == "float"), None)
        if state is None:
            return iteration
        nothing = self.scope.build.math("MINIMUM", self.scope.build.math("ABSOLUTE", state), 0.0)
        return self.scope.build.math("ADD", iteration, nothing)

    def bound(self, count: Node) -> tuple[int, bool | None]:
        """(steps to be unrolled, True where rays differ in how many they need or None); (0, True) where zones are kept."""
        if not self.unrolled:
            return 0, True
        uniforms = Names("uniform", f"the asset of {self.program.name}", self.asset.uniforms)
        least, most = range_of(count, lambda node: float(uniforms[node.data]))
        if most >= MOST_STEPS:
            raise KernelError(
                f"{self.program.name}: the loop count {count.describe()} differs per ray; Cycles needs one, or k.min with a constant"
            )
        return max(0, int(np.ceil(most))), None if least == most else True
