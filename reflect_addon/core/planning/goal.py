"""What a plan is asked for: a tolerance, and what may be spent to keep it."""

from dataclasses import dataclass

# Share of a reflector's rays that a tolerance is promised for.
PROMISED = 0.95


@dataclass(frozen=True)
class Goal:
    """A budget of 0 is no budget. tolerance 0: as good as it gets."""

    tolerance: float  # degrees that PROMISED of a reflector's rays may be off, seen from where they start
    cost: float = 0.0  # of a ray, in look-ups of an environment map, as a mean over all reflectors' pixels
    megabytes: float = 0.0  # on the GPU, of all assets
    bake_seconds: float = 0.0  # of all bakes

    @staticmethod
    def of(settings: dict[str, object]) -> "Goal":
        """From settings of `auto` (core/methods/auto.py)."""
        return Goal(*(float(settings[name]) for name in ("tolerance", "cost", "megabytes", "bake_seconds")))
