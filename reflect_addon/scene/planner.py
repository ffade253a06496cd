"""A plan for the open scene: who sees which rays of each reflector, what they meet, and which stand-in each gets (core/planning/).

Nothing is rendered, so that a plan takes seconds where its bake takes minutes.
"""

import time
from collections.abc import Sequence
from dataclasses import replace

import bpy

from ..core import methods
from ..core.camera import Camera
from ..core.errors import ReflectError
from ..core.planning.candidate import Changes
from ..core.planning.candidates import Trial
from ..core.planning.choose import Choice, choose
from ..core.planning.goal import Goal
from ..core.planning.leave_out import left_out
from ..core.planning.plan import Plan, inputs_of, row_of, unworded, words
from ..core.progress import Progress
from ..core.snapshot import Instance, SceneSnapshot
from .freshness import settings_for
from .properties import KEPT, by_hand
from .views import jobs_without_light, views_of


def plan(
    scene: bpy.types.Scene, snapshot: SceneSnapshot, goal: Goal, settings: dict[str, object], say: Progress, reflectors: Sequence[Instance] | None = None,
    earlier: Plan | None = None, views: Sequence[Camera] = (),
) -> tuple[Plan, list[Choice]]:
    """settings: of the bakes, over the methods' defaults. reflectors: those that it is made for, all by default;
    earlier: the plan from which those that are locked keep what they have; views: what somebody sees beside the scene's camera. Returns it with what its rows were chosen by."""
    began = time.perf_counter()
    reflectors = snapshot.reflectors() if reflectors is None else reflectors
    chosen, job_of = by_hand(scene, reflectors), jobs_without_light(snapshot)
    say(0.0, "what is seen of each reflector")
    seen, by_cameras = views_of(scene, snapshot, reflectors, job_of, views)
    if goal.unit == "pixels" and not by_cameras:
        raise ReflectError(f"The scene {scene.name} has no camera, and so no pixels.", "Add a camera, or give a tolerance in degrees.")
    asked = lambda kind: settings_for(kind, settings)
    trials = [
        Trial(one, job_of(one.reflector), asked, goal, *_overruled(chosen.get(one.reflector.object_name, ""), one.reflector, earlier, settings))
        for one in seen
    ]
    found = []
    for number, trial in enumerate(trials):
        tell = lambda method, n=number, name=trial.seen.reflector.name: say(0.1 + 0.8 * n / len(trials), f"trying {method} for {name}")
        found.append(trial.candidates(tell))
    choices, warnings = choose(seen, found, goal)
    say(0.9, "what is left out")
    choices = [
        replace(choice, by_hand=choice.seen.reflector.object_name in chosen, left_out=left_out(trial, choice.taken))
        for choice, trial in zip(choices, trials, strict=True)
    ]
    seconds = time.perf_counter() - began
    return Plan(goal, inputs_of(snapshot), words(settings) + words(chosen), by_cameras, seconds, tuple(map(row_of, choices)), tuple(warnings)), choices


def _overruled(by_hand: str, reflector: Instance, earlier: Plan | None, settings: dict[str, object]) -> tuple[str, tuple[str, Changes] | None]:
    """Trial's `only` and `kept` of what was chosen for a reflector by hand. Locked without a plan that knows it: as if nothing was chosen."""
    if by_hand != KEPT:
        return by_hand, None
    row = earlier.row_of(reflector.name) if earlier else None
    if row is None or row.method not in methods.planned():
        return "", None
    then, changes = unworded(earlier.settings), row.own_settings()
    for kind in methods.with_required((row.method,)):
        for name, default in methods.get(kind).DEFAULTS.items():
            if (before := then.get(name, default)) != settings.get(name, default):
                changes.setdefault(name, before)  # all bakes had that, and have another value now
    return "", (row.method, tuple(sorted(changes.items())))
