"""`auto`: a plan is made, what it takes is baked, and what was baked is proved on rays that no choice has seen.

Assets lie in a folder of their own (load.PLANNED) below those that were asked for by name, with the plan beside them, so that trying `auto` replaces nothing.
Where a proof fails the next dearer candidate is baked and proved in its place.
"""

import shutil
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import bpy

from ..core import methods
from ..core.asset_places import asset_name
from ..core.camera import Camera
from ..core.errors import ReflectError
from ..core.planning.choose import Choice
from ..core.planning.errors import measured
from ..core.planning.goal import Goal
from ..core.planning.plan import Plan, inputs_of, read_plan, row_of, words, write_plan
from ..core.planning.shown import draws, mirrored_views, shown
from ..core.progress import Progress, teller
from ..core.snapshot import SceneSnapshot
from .bake import bake_assets, chosen_reflectors
from .freshness import settings_for
from .load import PLANNED, load_assets
from .planner import plan
from .properties import by_hand
from .raytrace import trace

PLANNING = 0.1  # share of the work


def bake_auto(
    scene: bpy.types.Scene, snapshot: SceneSnapshot, folder: Path, *, reflectors: list[str] | tuple[str, ...] = (), settings: dict[str, object] | None = None,
    progress: Progress | None = None, tracer: Callable | None = None, again: bool = False, views: Sequence[Camera] = (),
) -> list[Path]:  # fmt: skip
    """Plans, bakes and proves, for the named reflectors or all; returns the assets' folders. settings: of `auto` and of the bakes; views: planner.plan's.
    ReflectError as scene/bake.py's."""
    chosen = chosen_reflectors(snapshot, reflectors)
    say = teller(progress, "The bake")
    settings, below = settings or {}, Path(folder) / PLANNED
    goal = Goal.of(settings_for(methods.AUTO, settings))
    names = [i.name for i in chosen]
    bake = partial(bake_assets, snapshot, settings=settings, tracer=tracer or partial(trace, scene=scene), again=again)
    earlier = _earlier(below)
    if earlier and not again and earlier.is_for(goal, inputs_of(snapshot), words(settings) + words(by_hand(scene, chosen)), names):
        return _bake_planned(earlier, names, below, bake, say)
    made, choices = plan(scene, snapshot, goal, settings, lambda s, t: say(PLANNING * s, f"planning: {t}"), chosen, earlier, views)
    for sentence in made.warnings:
        say(PLANNING, f"Warning: {sentence}")
    proved = _bake_and_prove(snapshot, choices, goal, below, bake, lambda s, t: say(PLANNING + (1 - PLANNING) * s, t))
    rows = {one.choice.seen.reflector.name: replace(row_of(one.choice), measured=one.measured) for one in proved}
    paths = list(dict.fromkeys(path for one in proved for path in one.paths))
    if reflectors and earlier:  # others keep what they have
        rows = {row.reflector: row for row in earlier.rows} | rows
        if (earlier.goal, earlier.inputs) != (made.goal, made.inputs):
            made = replace(made, inputs="")  # of several goals or scenes: for none of them, and planned again when all is asked for
    else:
        _remove_others(below, paths)
    write_plan(replace(made, rows=tuple(rows.values())), below)
    say(1.0, "Baked")
    return paths


def _earlier(below: Path) -> Plan | None:
    try:
        return read_plan(below)
    except ReflectError:
        return None  # damaged: planned again


def _bake_planned(made: Plan, names: list[str], below: Path, bake: Callable, say: Progress) -> list[Path]:
    """What the plan of an earlier bake has: nothing, where all of it is fresh."""
    by_method: dict[str, dict[str, dict]] = {}
    for row in made.rows:
        if row.reflector in names:
            by_method.setdefault(row.method, {})[row.reflector] = row.own_settings()
    paths = []
    for number, (method, some) in enumerate(by_method.items()):
        paths += bake((method,), below, reflectors=tuple(some), own_settings=some, progress=lambda s, t, n=number: say((n + s) / len(by_method), t))
    return paths


@dataclass(frozen=True)
class _Proved:
    """What was baked for one reflector."""

    choice: Choice
    measured: float  # in the goal's unit
    paths: tuple[Path, ...]


def _bake_and_prove(snapshot: SceneSnapshot, choices: list[Choice], goal: Goal, below: Path, bake: Callable, say: Progress) -> list[_Proved]:
    """Rounds: all that is chosen, method by method; then, where a promise was not kept, the next dearer candidate."""
    proved: dict[str, _Proved] = {}
    todo, share, left, shared = choices, 0.0, 1.0, {}
    while todo:
        by_method: dict[str, list[Choice]] = {}
        for choice in todo:
            by_method.setdefault(choice.taken.method, []).append(choice)
        whole = sum(c.taken.bake_seconds for c in todo) or 1.0
        todo, part = [], 0.7 * left
        for method, some in by_method.items():
            names = tuple(c.seen.reflector.name for c in some)
            step = part * sum(c.taken.bake_seconds for c in some) / whole
            own = {c.seen.reflector.name: dict(c.taken.changes) for c in some}
            paths = bake((method,), below, reflectors=names, own_settings=own, progress=lambda s, t, share=share, step=step: say(share + s * step, t))
            share += step
            assets = load_assets(snapshot, method, below, alone=True)
            for choice in some:
                name = choice.seen.reflector.name
                views = mirrored_views(snapshot, choice.seen, shared) if draws(method) else None
                error = measured(shown(assets[name], choice.seen.held_out, goal.unit, views)[0], goal.unit).p95
                proved[name] = _Proved(choice, error, tuple(p for p in paths if p.name in {asset_name(k, n) for k in methods.with_required((method,)) for n in (name, "")}))
                if goal.tolerance and error > goal.tolerance and (other := _dearer(choice, goal)):
                    todo.append(other)
        left = 1.0 - share
    return [proved[c.seen.reflector.name] for c in choices]


def _dearer(choice: Choice, goal: Goal) -> Choice | None:
    """The cheapest of those that cost more and promise to keep the tolerance."""
    some = [c for c in choice.candidates if c.errors is not None and c.cost > choice.taken.cost and c.promised <= goal.tolerance]
    if not some:
        return None
    taken = min(some, key=lambda c: (c.cost, c.bytes))
    return replace(choice, taken=taken, reason=f"{choice.taken.label()} did not keep {goal.tolerance:g} {goal.unit} on rays that it was not planned with.")


def _remove_others(below: Path, kept: list[Path]) -> None:
    """Deletes assets of earlier plans."""
    names = {path.name for path in kept}
    for path in below.iterdir():
        if path.is_dir() and path.name.partition("-")[0] in methods.names() and path.name not in names:
            shutil.rmtree(path, ignore_errors=True)
