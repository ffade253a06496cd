"""How many steps a kernel's loops take, counted by the very code that runs: in NumPy, in a shader, in shader nodes.

    tests = trace_rays(asset, counted(method.trace), rays, 0.0, 0.0).radiance[:, 0]

popescu-2006 3.1 states its cost in intersections per ray, which are the steps of loops over billboards. The kernel is
recorded with one more state in every loop and one more result of every branch, a running sum; nothing else changes.
"""

import inspect
from collections.abc import Callable
from dataclasses import replace

from .graph import Graph
from .program import Hit
from .recorder import Recorder


def counted(trace: Callable) -> Callable:
    """The kernel trace(k, asset, ray) -> Hit whose radiance is the number of loop steps, three times."""

    def counting(k, asset, ray) -> Hit:
        counter = _CountingRecorder(k.graph)
        hit = trace(counter, asset, ray)
        return replace(hit, radiance=k.vec3(counter.steps))

    counting.__module__ = trace.__module__
    return counting


class _CountingRecorder(Recorder):
    def __init__(self, graph: Graph):
        super().__init__(graph)
        self.steps = 0.0  # so far, where recording is

    def loop(self, count, state: tuple, body: Callable) -> tuple:
        def counting(i, *states):
            *own, self.steps = states
            self.steps = self.steps + 1.0
            new, stop = body(i, *own)
            return (*new, self.steps), stop

        parameters = list(inspect.signature(body).parameters.values())
        named = [inspect.Parameter("steps", inspect.Parameter.POSITIONAL_OR_KEYWORD)]
        counting.__signature__ = inspect.Signature(parameters + named)
        *results, self.steps = super().loop(count, (*state, self.steps), counting)
        return tuple(results)

    def branch(self, condition, then: Callable, other: Callable) -> tuple:
        before = self.steps

        def counting(side):
            def run():
                self.steps = before
                return *side(), self.steps

            return run

        *results, self.steps = super().branch(condition, counting(then), counting(other))
        return tuple(results)
