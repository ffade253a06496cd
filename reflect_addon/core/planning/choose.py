"""Which of its candidates each reflector gets.

Rule. With a tolerance: the cheapest that keeps it, or else the one that comes nearest. Without: the one that shows its points best, or a cheaper one
that is CLOSE to it, at no more cost than the best single method for all reflectors. Where a budget is exceeded the choice that gives up
the least error for what it saves is made cheaper, until it is kept or nothing is left to be saved.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from .candidate import Candidate
from .errors import EXACT, WRONG
from .goal import Goal
from .samples import Seen

CLOSE = 1.03  # of the least error: as good


@dataclass(frozen=True)
class LeftOut:
    """What a reflector does not have, and what it would have cost."""

    what: str
    why: str
    cost: float  # look-ups a ray
    bytes: int
    bake_seconds: float


@dataclass(frozen=True)
class Choice:
    """What one reflector gets."""

    seen: Seen
    candidates: tuple[Candidate, ...]
    taken: Candidate
    reason: str  # a sentence
    by_hand: bool = False  # whether its method was chosen by hand
    left_out: tuple[LeftOut, ...] = ()

    def kept(self, goal: Goal) -> bool:
        return not goal.tolerance or self.taken.promised <= goal.tolerance


def choose(seen: Sequence[Seen], candidates: Sequence[Sequence[Candidate]], goal: Goal) -> tuple[list[Choice], list[str]]:
    """(a choice for each reflector, sentences on what cannot be had)."""
    choices = [_choice(one, tuple(some), goal) for one, some in zip(seen, candidates, strict=True)]
    if not goal.tolerance:
        choices = _no_dearer_than_single(choices, goal)
    said = []
    for name, limit, unit in (("cost", goal.cost, "look-ups a ray"), ("bytes", goal.megabytes * 1e6, "bytes"), ("bake_seconds", goal.bake_seconds, "s of baking")):
        if limit:
            choices = _within(choices, name, limit, goal)
            if (spent := total(choices, name)) > limit:
                said.append(f"The budget of {limit:,.4g} {unit} cannot be kept: the least is {spent:,.4g}.")
    missed = [c for c in choices if not c.kept(goal)]
    if missed:
        worst = max(missed, key=lambda c: c.taken.promised)
        said.append(
            f"The tolerance of {goal.tolerance:g} {goal.unit} cannot be promised for {len(missed)} of {len(choices)} reflectors; the worst is "
            f"{worst.seen.reflector.name} by {worst.taken.label()}: {_error(worst.taken, goal)}."
        )
    return choices, said


def total(choices: Sequence[Choice], name: str) -> float:
    """What a plan spends: `cost` is the mean over what is seen, `bytes` and `bake_seconds` are sums."""
    if name != "cost":
        return float(sum(getattr(c.taken, name) for c in choices))
    shares = sum(c.seen.share for c in choices)
    return sum(c.taken.cost * c.seen.share for c in choices) / shares if shares else max((c.taken.cost for c in choices), default=0.0)


def error(choices: Sequence[Choice]) -> float:
    """The mean error of what is seen."""
    shares = sum(c.seen.share for c in choices)
    return sum(c.taken.errors.mean * c.seen.share for c in choices) / shares if shares else 0.0


def _choice(seen: Seen, candidates: tuple[Candidate, ...], goal: Goal) -> Choice:
    there = [c for c in candidates if c.errors is not None]
    alone = {c.pruned for c in candidates if c.errors is None}
    if len(there) == 1:
        return Choice(seen, candidates, there[0], f"{next(iter(alone), 'nothing else was tried')}.".capitalize())
    if goal.tolerance:
        good = [c for c in there if c.promised <= goal.tolerance]
        if good:
            taken = min(good, key=_price)
            return Choice(seen, candidates, taken, f"The cheapest that keeps {goal.tolerance:g} {goal.unit}: {_told(taken, goal)}{_instead(there, taken, goal)}.")
        taken = min(there, key=lambda c: (*c.far_off(), *_price(c)))
        return Choice(seen, candidates, taken, f"None keeps {goal.tolerance:g} {goal.unit} safely; the nearest: {_told(taken, goal)}{_instead(there, taken, goal)}.")
    least = min(c.errors.mean for c in there)
    taken = min((c for c in there if c.errors.mean <= max(CLOSE * least, EXACT)), key=_price)
    return Choice(seen, candidates, taken, f"Shows its points best: {_told(taken, goal)}{_instead(there, taken, goal)}.")


def _price(candidate: Candidate) -> tuple[float, int]:
    return candidate.cost, candidate.bytes


def _told(candidate: Candidate, goal: Goal) -> str:
    return f"{_error(candidate, goal)}, {candidate.cost:.2g} look-ups"


def _error(candidate: Candidate, goal: Goal) -> str:
    if candidate.promised >= WRONG[goal.unit]:
        return f"{candidate.errors.wrong:.1%} of its rays miss what is there"
    return f"95 % of its rays within {max(candidate.promised, 0.01):.2g} {goal.unit}"


def _instead(there: list[Candidate], taken: Candidate, goal: Goal) -> str:
    """What the next cheaper one would have been."""
    cheaper = [c for c in there if _price(c) < _price(taken)]
    if not cheaper:
        return ""
    other = min(cheaper, key=lambda c: c.errors.mean)
    return f"; {other.label()} for {other.cost:.2g}: {_error(other, goal)}"


def _no_dearer_than_single(choices: list[Choice], goal: Goal) -> list[Choice]:
    """At no more cost than the one method that is best for all, and never worse than it."""
    singles = []
    for method in {c.method for one in choices for c in one.candidates if c.errors is not None}:
        row = [next((c for c in one.candidates if c.method == method and c.is_plain and c.errors is not None), None) for one in choices]
        # Where a method was not tried the choice is already as good.
        singles.append([replace(one, taken=c or one.taken, reason=f"{method} is the best single method.") for one, c in zip(choices, row, strict=True)])
    least = min(map(error, singles), default=0.0)
    good = [s for s in singles if error(s) <= max(CLOSE * least, EXACT)]
    best = min(good, key=lambda s: total(s, "cost"), default=choices)
    mixed = _within(choices, "cost", max(total(best, "cost"), 1.0), goal)
    return mixed if error(mixed) <= max(CLOSE * error(best), EXACT) else [_as_good(one, goal) for one in best]


def _as_good(one: Choice, goal: Goal) -> Choice:
    """The cheapest that is no worse than what is taken."""
    taken = min((c for c in one.candidates if c.errors is not None and c.errors.mean <= one.taken.errors.mean), key=_price)
    if _price(taken) >= _price(one.taken):
        return one
    return replace(one, taken=taken, reason=f"As near as {one.taken.label()}, the best single method: {_told(taken, goal)}.")


def _within(choices: list[Choice], name: str, limit: float, goal: Goal) -> list[Choice]:
    """Made cheaper until the budget holds, or nothing is left to be saved."""
    choices = list(choices)
    while total(choices, name) > limit * (1 + 1e-9):
        steps = [
            (_loss(one, c, name), k, c)
            for k, one in enumerate(choices)
            for c in one.candidates
            if c.errors is not None and getattr(c, name) < getattr(one.taken, name) and (name != "cost" or one.seen.share > 0)
        ]
        if not steps:
            break
        _, k, c = min(steps, key=lambda step: step[0])
        words = {"cost": "time", "bytes": "memory", "bake_seconds": "bake time"}[name]
        choices[k] = replace(choices[k], taken=c, reason=f"For the budget of {words}, instead of {choices[k].taken.label()}: {_told(c, goal)}.")
    return choices


def _loss(one: Choice, other: Candidate, name: str) -> float:
    """Error that is given up for each unit that is saved."""
    weight = max(one.seen.share, 1e-9)
    saved = (getattr(one.taken, name) - getattr(other, name)) * (weight if name == "cost" else 1.0)
    return (other.errors.mean - one.taken.errors.mean) * weight / saved
