"""What evaluates a program in NumPy, used by run.py.

Values are tuples of component arrays, (n,) per ray or () where all rays agree. A loop drops rays that have stopped, a
branch computes each side for its own rays only, so work is what a GPU's lanes would do one by one, and is counted.
Nothing is repaired: a kernel that divides by zero gets its infinity, silently.
"""

import numpy as np

from ..asset_images import size_of, texels
from .graph import SIZES, KernelError, Node, Region
from .program import Names, Program, type_of
from .schedule import Schedule

ELEMENTWISE = {
    "add": np.add,
    "sub": np.subtract,
    "mul": np.multiply,
    "div": np.divide,
    "min": lambda a, b: np.where(b < a, b, a),  # as GLSL states it, so that nan passes the same way
    "max": lambda a, b: np.where(a < b, b, a),
    "neg": np.negative,
    "abs": np.abs,
    "floor": np.floor,
    "sqrt": np.sqrt,
    "exp2": np.exp2,
    "log2": np.log2,
    "lt": np.less,
    "le": np.less_equal,
    "eq": np.equal,
    "and": np.logical_and,
    "or": np.logical_or,
    "not": np.logical_not,
}


MOVES = {"swizzle", "vec", "fetch", "sample"}  # no arithmetic, or counted by themselves


class _Frame:
    """The values of one region for its n rays. picks: their indices in the parent frame, None for all of it."""

    def __init__(self, n: int, parent: "_Frame | None" = None, picks: np.ndarray | None = None):
        self.n, self.parent, self.picks = n, parent, picks
        self.values: dict[Node, tuple] = {}
        self.captured: dict[Node, tuple] = {}

    def get(self, node: Node) -> tuple:
        found = self.values.get(node) or self.captured.get(node)
        if found is None:
            found = self.parent.get(node)
            if self.picks is not None:
                found = _take(found, self.picks)
            self.captured[node] = found
        return found

    def narrowed(self, keep: np.ndarray) -> "_Frame":
        """This frame for the rays of the index array only; what it has captured is not looked up again."""
        frame = _Frame(len(keep), self.parent, keep if self.picks is None else self.picks[keep])
        frame.captured = {node: _take(value, keep) for node, value in self.captured.items()}
        return frame


def _take(value: tuple, picks: np.ndarray) -> tuple:
    return tuple(c[picks] if c.ndim else c for c in value)


class _Root(_Frame):
    """The outermost frame: also makes constants."""

    def __init__(self, n: int, machine: "Machine"):
        super().__init__(n)
        self.machine = machine

    def get(self, node: Node) -> tuple:
        found = self.values.get(node)
        if found is None:
            found = self.values[node] = self.machine.leaf(node)
        return found


class Machine:
    def __init__(self, program: Program, plan: Schedule, asset, real: type, counts):
        self.program, self.plan, self.real, self.counts = program, plan, real, counts
        self.images = Names("image", f"the asset of {program.name}", getattr(asset, "images", {}))
        self.uniforms = Names("uniform", f"the asset of {program.name}", getattr(asset, "uniforms", {}))

    def run(self, inputs: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
        n = len(next(iter(inputs.values())))
        frame = _Root(n, self)
        for name, node in self.program.inputs.items():
            column = inputs[name].astype(bool if node.type == "bool" else self.real, copy=False)
            frame.values[node] = (column,) if column.ndim == 1 else tuple(np.ascontiguousarray(column.T))
        if self.counts is not None:
            self.counts.rays += n
        self.block(self.program.graph.root, frame)
        out = {}
        for name, node in self.plan.outputs.items():
            parts = [np.broadcast_to(c, (n,)) for c in frame.get(node)]
            out[name] = parts[0].copy() if len(parts) == 1 else np.stack(parts, -1)
        return out

    def leaf(self, node: Node) -> tuple:
        if node.op == "const":
            return tuple(np.asarray(v, bool if node.type == "bool" else self.real) for v in node.data)
        if node.op == "uniform":
            value = self.uniforms[node.data]
            if type_of(value) != node.type and not (node.type == "bool" and type_of(value) == "float"):
                raise KernelError(f"uniform '{node.data}' is a {type_of(value)}; {self.program.name} reads a {node.type}")
            return tuple(np.asarray(v, bool if node.type == "bool" else self.real) for v in np.ravel(value))
        if node.op == "size":
            width, height = size_of(self.images[node.data])
            return (np.asarray(width, self.real), np.asarray(height, self.real))
        raise KernelError(f"{self.program.name}: {node.describe()} has no value here")

    def block(self, region: Region, frame: _Frame) -> None:
        for node in self.plan.blocks[region]:
            if node.op == "loop":
                self.loop(node, frame)
            elif node.op == "branch":
                self.branch(node, frame)
            else:
                value = frame.values[node] = self.operation(node, [frame.get(arg) for arg in node.args], frame.n)
                if self.counts is not None and node.op not in MOVES:
                    self.counts.operations += sum(c.size for c in value if c.ndim)

    def operation(self, node: Node, args: list[tuple], n: int) -> tuple:
        op = node.op
        if op in ELEMENTWISE:
            size = max(map(len, args))
            args = [a if len(a) == size else a * size for a in args]
            return tuple(np.asarray(ELEMENTWISE[op](*parts)) for parts in zip(*args))
        if op == "select":
            return tuple(np.where(args[0][0], a, b) for a, b in zip(*args[1:]))
        if op == "swizzle":
            return tuple(args[0]["xyzw".index(letter)] for letter in node.data)
        if op == "vec":
            return tuple(c for arg in args for c in arg)
        if op == "dot":
            return (np.asarray(sum((a * b for a, b in zip(args[0][1:], args[1][1:])), args[0][0] * args[1][0])),)
        if op == "cross":
            (ax, ay, az), (bx, by, bz) = args
            return tuple(map(np.asarray, (ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx)))
        x, y = args[0][0], args[1][0]
        if self.counts is not None:
            read = n * (4 if op == "sample" else 1)
            self.counts.fetches[node.data] = self.counts.fetches.get(node.data, 0) + read
        return (self.fetch if op == "fetch" else self.sample)(self.images[node.data], x, y)

    def fetch(self, image: np.ndarray, x: np.ndarray, y: np.ndarray) -> tuple:
        width, height = size_of(image)
        # A comparison, not a clip: nan becomes texel 0 rather than an address outside the image.
        column = np.where(x > 0, np.minimum(np.floor(x), width - 1), 0).astype(np.int64)
        row = np.where(y > 0, np.minimum(np.floor(y), height - 1), 0).astype(np.int64)
        found = texels(image, column, row).astype(self.real)
        return tuple(np.ascontiguousarray(np.moveaxis(found, -1, 0)))

    def sample(self, image: np.ndarray, x: np.ndarray, y: np.ndarray) -> tuple:
        half = self.real(0.5)
        left, bottom = np.floor(x - half), np.floor(y - half)
        fx, fy = x - half - left, y - half - bottom
        t00, t10 = self.fetch(image, left, bottom), self.fetch(image, left + 1, bottom)
        t01, t11 = self.fetch(image, left, bottom + 1), self.fetch(image, left + 1, bottom + 1)
        out = []
        for a, b, c, d in zip(t00, t10, t01, t11):
            low, high = a + (b - a) * fx, c + (d - c) * fx
            out.append(np.asarray(low + (high - low) * fy))
        return tuple(out)

    def branch(self, node: Node, frame: _Frame) -> None:
        condition = frame.get(node.args[0])[0]
        sides = ((node.data.then, condition), (node.data.other, ~condition))
        merged = {k: None for k in self.plan.live[node]}
        for region, mask in sides:
            if mask.all():
                inner = _Frame(frame.n, frame)
            elif not mask.any():
                continue
            else:
                picks = np.flatnonzero(mask)
                inner = _Frame(len(picks), frame, picks)
            self.block(region, inner)
            for k in merged:
                value = inner.get(region.results[k])
                merged[k] = value if inner.picks is None else _put(merged[k], frame.n, inner.picks, value)
        if frame.n == 0:
            merged = {k: self.nothing(region.results[k].type) for k in merged}
        frame.values.update({node.data.items[k]: value for k, value in merged.items()})

    def loop(self, node: Node, frame: _Frame) -> None:
        loop, live = node.data, self.plan.live[node]
        states = {k: frame.get(node.args[k]) for k in live}
        final: dict[int, tuple | None] = dict.fromkeys(live)
        inner = _Frame(frame.n, frame)
        step = 0
        while inner.n and (loop.count is None or step < loop.count):
            if loop.count is None:
                going = step < inner.get(node.args[-1])[0]
                inner, states = self.retire(inner, states, final, ~going, frame.n)
                if not inner.n:
                    break
            inner.values = {loop.states[k]: states[k] for k in live}
            inner.values[loop.index] = (np.asarray(step, self.real),)
            if self.counts is not None:
                self.counts.steps += inner.n
            self.block(loop.body, inner)
            states = {k: inner.get(loop.body.results[k]) for k in live}
            if loop.has_stop:
                stopped = inner.get(loop.body.results[-1])[0]
                inner.values = {}
                inner, states = self.retire(inner, states, final, stopped, frame.n)
            step += 1
        if inner.n:
            everything = np.ones((), bool)
            self.retire(inner, states, final, everything, frame.n)
        if frame.n == 0:
            final = {k: self.nothing(loop.states[k].type) for k in live}
        frame.values.update({loop.items[k]: value for k, value in final.items()})

    def retire(self, inner: _Frame, states: dict, final: dict, leaving: np.ndarray, n: int) -> tuple[_Frame, dict]:
        """Writes the states of the rays that leave into final; the frame and states of those that stay."""
        if not leaving.any():
            return inner, states
        if leaving.all():
            for k, value in states.items():
                final[k] = value if inner.picks is None else _put(final[k], n, inner.picks, value)
            return _Frame(0), states
        out, stay = np.flatnonzero(leaving), np.flatnonzero(~leaving)
        for k, value in states.items():
            where = out if inner.picks is None else inner.picks[out]
            final[k] = _put(final[k], n, where, _take(value, out))
        return inner.narrowed(stay), {k: _take(value, stay) for k, value in states.items()}

    def nothing(self, kind: str) -> tuple:
        return tuple(np.zeros(0, bool if kind == "bool" else self.real) for _ in range(SIZES[kind]))


def _put(target: tuple | None, n: int, picks: np.ndarray, value: tuple) -> tuple:
    if target is None:
        target = tuple(np.zeros(n, c.dtype) for c in value)
    for into, component in zip(target, value):
        into[picks] = component
    return target
