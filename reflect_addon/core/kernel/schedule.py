"""Where each node of a program is computed: what all emitters share.

Only what the wanted outputs need is kept, loop states and branch results included. A node is computed in the innermost
region that contains all its uses (so a fetch that one side of a branch needs happens only there), and moved out of a
loop whose state it does not depend on, but never out of a branch (click-1995, "Global code motion, global value numbering").
"""

from dataclasses import dataclass, field

from .graph import Graph, KernelError, Node, Region

LEAVES = ("const", "input", "uniform", "index", "state", "item", "size")  # values that are there; never a statement


@dataclass
class Schedule:
    outputs: dict[str, Node]
    blocks: dict[Region, list[Node]] = field(default_factory=dict)  # statements, operands first
    live: dict[Node, tuple[int, ...]] = field(default_factory=dict)  # loop or branch -> results that are needed
    uses: dict[Node, list[Region]] = field(default_factory=dict)  # one entry per operand or result that reads the node

    @property
    def images(self) -> tuple[str, ...]:
        """The images that are read, in the order of their names."""
        return tuple(sorted({n.data for n in self.uses if n.op in ("fetch", "sample", "size")}))

    @property
    def has_loops(self) -> bool:
        return any(node.op == "loop" for block in self.blocks.values() for node in block)

    @property
    def uniforms(self) -> tuple[str, ...]:
        return tuple(sorted(n.data for n in self.uses if n.op == "uniform"))


def schedule(program, wanted=None) -> Schedule:
    """The plan for the wanted outputs (all by default), made once a program: who asks again gets the same, to be read only."""
    wanted = tuple(program.outputs) if wanted is None else tuple(wanted)
    for name in wanted:
        if name not in program.outputs:
            raise KernelError(f"{program.name} has no output '{name}' (there: {', '.join(program.outputs)})")
    if wanted not in program.plans:
        plan = Schedule({name: program.outputs[name] for name in wanted})
        _Placement(program.graph, plan).run()
        program.plans[wanted] = plan
    return program.plans[wanted]


class _Placement:
    def __init__(self, graph: Graph, plan: Schedule):
        self.graph, self.plan = graph, plan
        self.parent: dict[Region, Region | None] = {graph.root: None}
        self.depth: dict[Region, int] = {graph.root: 0}
        self.needed: dict[Node, set[int]] = {}
        self.known: Known = {}

    def run(self) -> None:
        plan = self.plan
        plan.blocks[self.graph.root] = []
        for node in plan.outputs.values():
            self.use(node, self.graph.root)
        for node in reversed(self.graph.nodes):  # users have larger ids, so all uses of a node are known when it comes
            if node in plan.uses:
                self.place(node)
        for block in plan.blocks.values():
            block.reverse()

    def use(self, node: Node, region: Region) -> None:
        self.plan.uses.setdefault(node, []).append(region)

    def place(self, node: Node) -> None:
        region = self.common(self.plan.uses[node])
        if node.op == "item":
            self.needed.setdefault(node.args[0], set()).add(node.data)
            self.use(node.args[0], region)
            return
        if node.op in LEAVES:
            return
        while region is not node.home and region.kind == "loop":
            region = self.parent[region]
        self.plan.blocks[region].append(node)
        if node.op == "loop":
            self.place_loop(node, region)
        elif node.op == "branch":
            self.plan.live[node] = live = tuple(sorted(self.needed[node]))
            for side in (node.data.then, node.data.other):
                self.enter(side, region)
                for k in live:
                    self.use(side.results[k], side)
            self.use(node.args[0], region)
        else:
            for arg in node.args:
                self.use(arg, region)

    def place_loop(self, node: Node, region: Region) -> None:
        loop = node.data
        self.plan.live[node] = live = tuple(sorted(live_states(node, self.needed[node], self.known)))
        self.enter(loop.body, region)
        for k in live:
            self.use(node.args[k], region)
            self.use(loop.body.results[k], loop.body)
        if loop.has_stop:
            self.use(loop.body.results[-1], loop.body)
        if loop.count is None:
            self.use(node.args[-1], region)

    def enter(self, body: Region, parent: Region) -> None:
        self.plan.blocks[body] = []
        self.parent[body], self.depth[body] = parent, self.depth[parent] + 1

    def common(self, regions: list[Region]) -> Region:
        first = regions[0]
        for other in regions[1:]:
            while first is not other:
                if self.depth[first] < self.depth[other]:
                    other = self.parent[other]
                else:
                    first = self.parent[first]
        return first


# (loop, one of its states) -> the states that it depends on. Loops in loops ask for the same again and again.
Known = dict[tuple[Node, int], set[int]]


def live_states(node: Node, wanted: set[int], known: Known) -> set[int]:
    """The loop states that the wanted ones depend on, through the body or through when it stops."""
    loop = node.data
    live = set(wanted)
    pending = [loop.body.results[k] for k in live] + ([loop.body.results[-1]] if loop.has_stop else [])
    own = {state: k for k, state in enumerate(loop.states)}
    first = min((state.id for state in loop.states), default=0)  # what was recorded before depends on none of them
    seen: set[Node] = set()
    while pending:
        current = pending.pop()
        if current.id < first or current in seen:
            continue
        seen.add(current)
        if current in own and own[current] not in live:
            live.add(own[current])
            pending.append(loop.body.results[own[current]])
        pending.extend(_dependencies(current, known))
    return live


def _dependencies(node: Node, known: Known) -> list[Node]:
    if node.op != "item":
        return list(node.args)
    owner, k = node.args[0], node.data
    if owner.op == "branch":
        return [owner.args[0], owner.data.then.results[k], owner.data.other.results[k]]
    if (owner, k) not in known:
        known[owner, k] = live_states(owner, {k}, known)
    inner, states = owner.data, known[owner, k]
    ends = [inner.body.results[-1]] if inner.has_stop else []
    counts = [owner.args[-1]] if inner.count is None else []
    return [owner.args[s] for s in states] + [inner.body.results[s] for s in states] + ends + counts
