"""A stand-in that a plan may give a reflector: a method, the settings in which it differs from what is asked for, and what trying it told."""

from dataclasses import dataclass

import numpy as np

from .. import methods
from .errors import ELSEWHERE, Measured

Changes = tuple[tuple[str, object], ...]  # settings in which a stand-in differs from what is asked for, by name


@dataclass(frozen=True)
class Candidate:
    """One stand-in for one reflector."""

    method: str
    changes: Changes = ()
    errors: Measured | None = None  # None: not tried
    cost: float = 0.0  # of a ray, in look-ups of an environment map
    bytes: int = 0  # at the settings that are asked for
    bake_seconds: float = 0.0
    pruned: str = ""  # why it was not tried

    @property
    def promised(self) -> float:
        """In the goal's unit."""
        return np.inf if self.errors is None else self.errors.promised

    def far_off(self) -> tuple[float, float]:
        """What is nearest where nothing keeps a tolerance has the least of: what is promised, and, where that is ELSEWHERE anyway, the mean."""
        return min(self.promised, ELSEWHERE), self.errors.mean

    @property
    def is_plain(self) -> bool:
        """Whether it is its method as it is asked for, but for what no ray meets."""
        return all(name == WITHOUT for name, _ in self.changes)

    def label(self) -> str:
        """The method, and what is special, for people."""
        said = [f"{name} {value}" for name, value in self.changes if not isinstance(value, tuple)]
        said += [f"{len(value)} {name}" for name, value in self.changes if isinstance(value, tuple) and name != WITHOUT]
        return f"{self.method} ({', '.join(said)})" if said else self.method


WITHOUT, QUADS = "without", "quads"  # settings that name objects


def ladder() -> list[tuple[float, str, Changes]]:
    """What a plan chooses among, from cheap to dear: (effort, method, settings that differ)."""
    steps = []
    for name in methods.planned():
        method = methods.get(name)
        steps.append((getattr(method, "EFFORT", 1.0), name, ()))
        steps += [(effort, name, tuple(sorted(changes.items()))) for effort, changes in getattr(method, "VARIANTS", ())]
    return sorted(steps, key=lambda step: step[0])
