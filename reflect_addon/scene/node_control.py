"""Loops and branches of a kernel as Repeat zones.

Problem. A kernel branches and loops; a shader tree is a list of nodes that are all computed.
Idea. EEVEE keeps Repeat zones as loops of the shader, and how often one repeats may be a value of the ray. So a loop is a zone. Both sides of a
branch are computed and the right one is kept, but the loops within a side repeat only where it is taken: its condition is a `gate`, by which
their counts are multiplied. A loop that stops early goes on in blocks, the first of FIRST steps, since most rays stop there, and a block begins
only while the ray is running; within it a ray that has stopped keeps its states. (A side, or a step, in a zone of 0 or 1 turns was tried:
software OpenGL runs a loop's body once more than it repeats, so one turn cost two and zones in zones four.) All that a zone reads goes in as one of its items, changed or not:
Blender 5.2 writes a zone's nodes in the order of their links, and what only the inside asks for is declared inside, where what comes after
the zone cannot see it ("undeclared" in the shader's log, and a pink surface).
Cycles unrolls zones and wants constant counts. `unrolled` groups therefore repeat as often as any ray may need (core/kernel/bounds.py), a
flag freezing the states once the ray is done.
Limits. An infinite value in the side of a branch that is not taken spoils the result.
"""

import numpy as np

from ..core.kernel import KernelError
from ..core.kernel.bounds import range_of
from ..core.kernel.graph import Node, Region
from ..core.kernel.program import Names
from ..core.kernel.recorder import MOST_STEPS
from .node_operations import NodeScope, Parts, part_kinds
from .node_tree import Source

FIRST, BLOCK = 4, 16  # steps of a loop that stops: up to the first look at whether the ray still runs, and to each further one
FEW = 8  # most steps of a loop without such looks: each costs a step or two


class ControlFlow:
    """Of an emitter, which says: scope, the tree that is being written; computed(region, results), the parts of a region's results;
    outline(region, results); program, plan, asset, unrolled."""

    scope: NodeScope
    unrolled: bool
    gate: Source | None = None  # in the current tree: 1 where loops repeat, 0 where the side of a branch that they are in is not taken

    def zone(self, count: Source, states: list[tuple[str, str, Parts]], reads: list[Node], body) -> list[Parts]:
        """A Repeat zone. states: (name, type, what it begins with); reads: the nodes of the kernel that its body reads beside them;
        body(iteration, parts of each state) -> their new parts."""
        scope, gate = self.scope, self.gate
        if gate is not None:
            count = scope.build.math("MULTIPLY", count, gate)
        held = [] if self.unrolled else [(n.name or n.op, n.type, scope.get(n)) for n in reads]
        items = [*states, *held]
        labels = [(f"{name}{end}", kind) for name, type_, _ in items for kind, end in zip(part_kinds(type_), ("", " w"))]
        enter, leave = scope.build.zone(count, labels, [part for *_, parts in items for part in parts])

        def split(sockets):
            sockets = iter(sockets)
            return [tuple(next(sockets) for _ in part_kinds(type_)) for _, type_, _ in items]

        inside = split(enter.outputs[1:])
        outer = dict(scope.values), dict(scope.inverted), dict(scope.addresses)
        self.gate = None
        if held:
            scope.values.update(zip(reads, inside[len(states) :]))
            scope.inverted.clear()
            scope.addresses.clear()
        new = [*body(enter.outputs[0], inside[: len(states)]), *inside[len(states) :]]
        scope.values, scope.inverted, scope.addresses = outer
        self.gate = gate
        for socket, source in zip(leave.inputs, [part for parts in new for part in parts]):
            scope.build.plug(socket, source)
        scope.build.finish(leave)
        return split(leave.outputs)[: len(states)]

    def branch(self, node: Node) -> None:
        branch, live = node.data, self.plan.live[node]
        taken = self.scope.get(node.args[0])[0], self.scope.otherwise(node.args[0])
        then, other = (self.side(side, [side.results[k] for k in live], where) for side, where in zip((branch.then, branch.other), taken))
        for k, a, b in zip(live, then, other):
            item = branch.items[k]
            self.scope.values[item] = self.scope.select(node.args[0], a, b, item.type, item.name)

    def side(self, region: Region, results: list[Node], taken: Source) -> list[Parts]:
        """A side of a branch, its loops only where it is taken."""
        gate = self.gate
        if not self.unrolled and self.outline(region, results).loops:
            self.gate = taken if gate is None else self.scope.build.math("MULTIPLY", taken, gate)
        found = self.computed(region, results)
        self.gate = gate
        return found

    def outside(self, region: Region, results, without=()) -> list[Node]:
        """What a zone around a region has to hold."""
        found = self.outline(region, results)
        return [node for node in (*found.reads, *found.passes) if node not in without]

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
        return new[: len(live)], self.scope.build.math("SUBTRACT", 1.0, new[-1][0]) if loop.has_stop else 1.0

    def results(self, loop, live) -> list[Node]:
        return [loop.body.results[k] for k in live] + [loop.body.results[-1]] * loop.has_stop

    def kept_loop(self, node: Node, loop, live, states) -> list[Parts]:
        """EEVEE's: a zone that repeats as often as the ray's own count; one that stops in blocks, which begin while it runs."""
        build = self.scope.build
        count = float(loop.count) if loop.count is not None else build.math("CEIL", self.scope.get(node.args[-1])[0])
        reads = self.outside(loop.body, self.results(loop, live), {loop.index, *(loop.states[k] for k in live)})
        if not loop.has_stop:
            return self.zone(count, states, reads, lambda step, parts: self.body(loop, live, step, parts)[0])
        kinds = [kind for _, kind, _ in states]
        states = [*states, ("running", "float", (1.0,))]
        if self.steps(node, loop)[1] <= FEW:
            return self.zone(count, states, reads, lambda step, parts: self.step(loop, live, kinds, step, parts))[:-1]

        def block(number, parts):
            (running,), (count,) = parts[-2:]
            ends = build.math("MULTIPLY", number, float(BLOCK))
            end = build.math("MAXIMUM", ends, float(FIRST))
            begin = build.math("MINIMUM", ends, build.math("MAXIMUM", build.math("SUBTRACT", ends, float(BLOCK)), float(FIRST)))
            steps = build.math("MULTIPLY", running, build.math("SUBTRACT", build.math("MINIMUM", count, end), begin))
            inside = [(name, kind, part) for (name, kind, _), part in zip(states, parts)] + [("begin", "float", (begin,))]
            new = self.zone(steps, inside, reads, lambda step, inner: [
                *self.step(loop, live, kinds, build.math("ADD", step, inner[-1][0]), inner[:-1]), inner[-1]])  # fmt: skip
            return [*new[:-1], (count,)]

        if loop.count is not None:
            blocks = 1.0 + -(-loop.count // BLOCK)
        else:
            blocks = build.math("ADD", build.math("CEIL", build.math("MULTIPLY", count, 1.0 / BLOCK)), build.math("GREATER_THAN", count, float(FIRST)))
        return self.zone(blocks, [*states, ("count", "float", (count,))], reads, block)[:-2]

    def step(self, loop, live, kinds: list[str], step: Source, parts: list[Parts]) -> list[Parts]:
        """A step of a loop that stops, as it is where the ray has stopped: new states and whether it runs on."""
        *before, (running,) = parts
        build = self.scope.build
        self.gate = running
        new, goes_on = self.body(loop, live, step, before)
        self.gate = None
        stopped = build.math("SUBTRACT", 1.0, running)
        new = [self.scope.keep(running, stopped, a, b, kind) for a, b, kind in zip(new, before, kinds)]
        return [*new, (build.math("MULTIPLY", running, goes_on),)]

    def unrolled_loop(self, node: Node, loop, live, states) -> list[Parts]:
        """Cycles': as many steps as any ray needs, frozen once the ray's own are over."""
        build = self.scope.build
        least, most = self.steps(node, loop)
        if most >= MOST_STEPS:
            count = node.args[-1].describe()
            raise KernelError(f"{self.program.name}: the loop count {count} differs per ray; Cycles needs one, or k.min with a constant")
        own = least < most  # whether rays differ
        may_end = loop.has_stop or own
        states = [*states, ("running", "float", (1.0,))] if loop.has_stop else states

        def step(iteration, parts):
            now = self.waiting(iteration, states, parts)
            new, goes_on = self.body(loop, live, now, parts[: len(live)])
            if not may_end:
                return new
            going = parts[-1][0] if loop.has_stop else None
            if own:
                within = build.math("LESS_THAN", now, self.scope.get(node.args[-1])[0])
                going = within if going is None else build.math("MULTIPLY", going, within)
            frozen = build.math("SUBTRACT", 1.0, going)
            kinds = [loop.states[k].type for k in live]
            new = [self.scope.keep(going, frozen, a, b, kind) for a, b, kind in zip(new, parts, kinds)]
            return [*new, (build.math("MULTIPLY", going, goes_on),)] if loop.has_stop else new

        return self.zone(float(max(0, int(np.ceil(most)))), states, [], step)[: len(live)]

    def waiting(self, iteration: Source, states, parts: list[Parts]) -> Source:
        """The iteration, made to wait for the one before it: zones are unrolled and Cycles computes what it can at once, so
        the table rows of all iterations would lie on its stack of 255 floats together."""
        state = next((p[0] for (_, kind, _), p in zip(states, parts) if kind == "float"), None)
        if state is None:
            return iteration
        nothing = self.scope.build.math("MINIMUM", self.scope.build.math("ABSOLUTE", state), 0.0)
        return self.scope.build.math("ADD", iteration, nothing)

    def steps(self, node: Node, loop) -> tuple[float, float]:
        """(fewest, most) that any ray takes."""
        return self.bound(node.args[-1]) if loop.count is None else (loop.count, loop.count)

    def bound(self, count: Node) -> tuple[float, float]:
        """(fewest, most) steps that any ray takes by such a count."""
        uniforms = Names("uniform", f"the asset of {self.program.name}", self.asset.uniforms)
        return range_of(count, lambda uniform: float(uniforms[uniform.data]))
