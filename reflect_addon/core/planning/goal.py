"""What a plan is asked for: a tolerance, and what may be spent to keep it."""

from dataclasses import dataclass

# Share of a reflector's rays that a tolerance is promised for.
PROMISED = 0.95


@dataclass(frozen=True)
class Goal:
    """A budget of 0 is no budget. tolerance 0: as good as it gets."""

    tolerance: float  # that PROMISED of a reflector's rays may be off: degrees, seen from where they start, or pixels of the picture
    cost: float = 0.0  # of a ray, in look-ups of an environment map, as a mean over all reflectors' pixels
    megabytes: float = 0.0  # on the GPU, of all assets
    bake_seconds: float = 0.0  # of all bakes
    unit: str = "degrees"  # of errors: 'degrees' or 'pixels'
    views: bool = True  # whether planar mirrors may be drawn by mirrored views, which materials have none of

    @staticmethod
    def of(settings: dict[str, object]) -> "Goal":
        """From settings of `auto` (core/methods/auto.py)."""
        pixels = float(settings["pixels"])
        budgets = (float(settings[name]) for name in ("cost", "megabytes", "bake_seconds"))
        return Goal(pixels or float(settings["tolerance"]), *budgets, "pixels" if pixels else "degrees", bool(settings["mirrored_views"]))
