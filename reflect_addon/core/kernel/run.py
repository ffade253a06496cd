"""The NumPy emitter: a program for many rays at once. The reference, and it runs without a GPU."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from ..rays import Answer, Rays
from .graph import SIZES, KernelError
from .numpy_machine import Machine
from .program import Program
from .schedule import schedule

CHUNK = 1 << 16  # rays at a time: temporaries of a few hundred nodes stay in cache-sized pieces


@dataclass
class Counts:
    """Deterministic work, summed over rays; a bilinear sample counts as its four fetches."""

    rays: int = 0
    fetches: dict[str, int] = field(default_factory=dict)  # image -> texels read
    steps: int = 0  # iterations of loops, nested ones included
    operations: int = 0  # on single numbers, what all rays have in common left out

    @property
    def fetches_per_ray(self) -> float:
        return sum(self.fetches.values()) / max(self.rays, 1)

    @property
    def operations_per_ray(self) -> float:
        return self.operations / max(self.rays, 1)

    @property
    def steps_per_ray(self) -> float:
        return self.steps / max(self.rays, 1)


def run_numpy(
    program: Program, asset, rays: Rays, width=None, spread=None, dtype=np.float32, counts: Counts | None = None
) -> Answer:
    """A recorded method's Answer, (N, ...) of dtype. width, spread: (N,) or a number, 0 by default (core.rays.RayMap)."""
    inputs = {"origin": rays.origin, "direction": rays.direction}
    for name, value in (("width", width), ("spread", spread)):
        inputs[name] = np.broadcast_to(np.asarray(0.0 if value is None else value), (len(rays),))
    return Answer(**evaluate(program, inputs, asset, dtype=dtype, counts=counts))


def evaluate(
    program: Program, inputs: Mapping[str, np.ndarray], asset=None, wanted=None, dtype=np.float32, counts=None
) -> dict[str, np.ndarray]:
    """The wanted outputs (all by default), (N,) or (N, components), floats of dtype. inputs: name -> (N,) or (N, components).

    asset needs .images and .uniforms with what the program reads; dtype float64 gives a yardstick for rounding.
    """
    plan = schedule(program, wanted)
    columns = {name: np.asarray(inputs[name]) for name in program.inputs}
    count = len(next(iter(columns.values())))
    for name, node in program.inputs.items():
        shape = (count,) if SIZES[node.type] == 1 else (count, SIZES[node.type])
        if columns[name].shape != shape:
            raise KernelError(f"{program.name}: input '{name}' has the shape {columns[name].shape}, wanted {shape}")
    machine = Machine(program, plan, asset, np.dtype(dtype).type, counts)
    parts = []
    with np.errstate(all="ignore"):
        for start in range(0, max(count, 1), CHUNK):
            parts.append(machine.run({name: column[start : start + CHUNK] for name, column in columns.items()}))
    return {name: np.concatenate([part[name] for part in parts]) for name in plan.outputs}
