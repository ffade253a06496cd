"""What a reflector is not given, why, and what it would have cost."""

from .candidate import QUADS, WITHOUT, Candidate
from .candidates import Trial
from .choose import LeftOut

NAMED = 3  # objects that a sentence names


def left_out(trial: Trial, taken: Candidate) -> tuple[LeftOut, ...]:
    """Of what a reflector takes; with each thing put back it is tried once more, as coarsely as without."""
    changes, found = dict(taken.changes), []
    taken = trial.tried(taken.method, taken.changes) if changes.keys() & {WITHOUT, QUADS} else taken
    for name, words, why in (
        (WITHOUT, "{}", "no reflected ray meets {}"),
        (QUADS, "depth maps of {}", "a quad shows {} as well"),
    ):
        names = changes.get(name, ())
        if names:
            back = trial.tried(taken.method, tuple(c for c in taken.changes if c[0] != name))
            found.append(_left_out(words.format(_listed(names)), why.format("it" if len(names) == 1 else "them"), back, taken))
    return tuple(one for one in found if one.cost > 0 or one.bytes > 0 or one.bake_seconds > 0)


def _left_out(what: str, why: str, back: Candidate, taken: Candidate) -> LeftOut:
    return LeftOut(what, why, float(back.cost - taken.cost), int(back.bytes - taken.bytes), float(back.bake_seconds - taken.bake_seconds))


def _listed(names: tuple[str, ...]) -> str:
    return ", ".join(names[:NAMED]) + (f" and {len(names) - NAMED} more" if len(names) > NAMED else "")
