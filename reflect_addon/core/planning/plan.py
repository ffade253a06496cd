"""A plan as it is kept: which stand-in each reflector has, what was promised, what was measured, and what else was tried. A JSON file beside the
assets that it names; reading it trusts nothing."""

import json
from collections.abc import Collection
from dataclasses import asdict, dataclass, replace
from pathlib import Path

from ..errors import ReflectError
from ..safe_write import write_whole
from ..scene_items import MATERIALS, MIRRORS, digest, geometry, mirrors
from ..snapshot import SceneSnapshot
from ..typed_json import typed
from .choose import Choice, LeftOut
from .goal import Goal

FORMAT = 2
FILE_NAME = "plan.json"
MAX_BYTES = 16 << 20


@dataclass(frozen=True)
class Tried:
    """One candidate of a reflector."""

    method: str
    settings: tuple[str, ...]  # NAME=VALUE, those in which it differs from what is asked for
    pruned: str  # why it was not tried; "": it was
    promised: float  # what 95 % of the planned rays keep within, in the goal's unit; this and the next three are: 0 where it was not tried
    mean: float  # each at most errors.ELSEWHERE
    wrong: float  # share of rays that show a surface for the sky or the sky for a surface
    cost: float  # look-ups of an environment map
    bytes: int  # as estimated
    bake_seconds: float  # as estimated


@dataclass(frozen=True)
class Row:
    """What one reflector gets."""

    reflector: str
    method: str
    settings: tuple[str, ...]  # NAME=VALUE, for this reflector alone
    reason: str
    by_hand: bool  # whether the method was chosen by hand
    share: float  # of what is seen
    promised: float  # in the goal's unit
    measured: float  # what 95 % of the rays that no choice has seen keep within, by the baked asset; -1: not baked yet
    tried: tuple[Tried, ...]
    left_out: tuple[LeftOut, ...]

    def is_taken(self, tried: Tried) -> bool:
        return (tried.method, tried.settings) == (self.method, self.settings)

    def own_settings(self) -> dict[str, object]:
        """For a bake of this reflector. ValueError where they are none."""
        return unworded(self.settings)


@dataclass(frozen=True)
class Plan:
    goal: Goal
    inputs: str  # scene_items.digest of what it was made for, see inputs_of
    settings: tuple[str, ...]  # NAME=VALUE, of the bakes, where they are not the methods' own; and OBJECT=METHOD of what was chosen by hand
    by_cameras: bool  # whether the scene's cameras say what is seen
    seconds: float  # that planning took
    rows: tuple[Row, ...]
    warnings: tuple[str, ...]  # what cannot be had

    def is_for(self, goal: Goal, inputs: str, settings: tuple[str, ...], reflectors: Collection[str]) -> bool:
        """Whether a plan for these would be this one, from wherever cameras look by now: nothing becomes old because a camera moved."""
        asked = goal == self.goal and inputs == self.inputs and settings == self.settings
        return asked and bool(inputs) and set(reflectors) <= {row.reflector for row in self.rows}

    def row_of(self, reflector: str) -> Row | None:
        return next((row for row in self.rows if row.reflector == reflector), None)


def inputs_of(scene: SceneSnapshot) -> str:
    """What a plan of the scene depends on: where rays end, what mirrors, and how; no light. "" for a scene that is not known."""
    ends = geometry(scene)
    looks = {i.name: repr([replace(scene.materials[m], name="") for m in i.materials]) for i in scene.instances}
    return digest({**ends, MATERIALS: looks, MIRRORS: mirrors(scene)}) if ends else ""


def row_of(choice: Choice) -> Row:
    """Before it is baked."""
    tried = tuple(
        Tried(
            c.method, words(dict(c.changes)), c.pruned, *((c.errors.promised, c.errors.mean, c.errors.wrong) if c.errors else (0.0, 0.0, 0.0)),
            float(c.cost), int(c.bytes), float(c.bake_seconds),
        )
        for c in choice.candidates
    )  # fmt: skip
    taken = choice.taken
    return Row(
        choice.seen.reflector.name, taken.method, words(dict(taken.changes)), choice.reason, choice.by_hand, choice.seen.share, taken.errors.promised, -1.0, tried,
        choice.left_out,
    )  # fmt: skip


def words(settings: dict[str, object]) -> tuple[str, ...]:
    """Settings as a plan keeps them."""
    return tuple(f"{name}={json.dumps(value)}" for name, value in sorted(settings.items()))


def unworded(given: tuple[str, ...]) -> dict[str, object]:
    """What `words` was made of. ValueError where it was not."""
    found = {name: json.loads(value) for name, _, value in (word.partition("=") for word in given)}
    return {name: tuple(value) if isinstance(value, list) else value for name, value in found.items()}


def document_of(plan: Plan) -> dict:
    """As JSON has it."""
    return json.loads(json.dumps({"what": "reflect plan", "format": FORMAT, **asdict(plan)}, allow_nan=False))


def plan_of(document) -> Plan:
    """The plan of a JSON value. ValueError says what is wrong."""
    if not isinstance(document, dict) or document.get("what") != "reflect plan":
        raise ValueError("it is no plan of Reflect's")
    if (format := document.get("format")) != FORMAT:
        raise ValueError(f"it has format {format}, this version reads {FORMAT}")
    return typed(Plan, {key: value for key, value in document.items() if key not in ("what", "format")}, "plan")


def write_plan(plan: Plan, folder: Path) -> None:
    write_whole(Path(folder) / FILE_NAME, (json.dumps(document_of(plan), indent=1, allow_nan=False) + "\n").encode())


def read_plan(folder: Path) -> Plan | None:
    """The plan in a folder of assets; None without one. ReflectError where it is damaged or of a newer version."""
    path = Path(folder) / FILE_NAME
    try:
        with path.open("rb") as file:
            content = file.read(MAX_BYTES + 1)
    except FileNotFoundError:
        return None
    except OSError as error:
        raise ReflectError(f"{path} could not be read ({error.strerror or error}).", "Make it readable, or bake again.") from error
    try:
        if len(content) > MAX_BYTES:
            raise ValueError("it is too large")
        return plan_of(json.loads(content))
    except (ValueError, RecursionError) as error:
        raise ReflectError(f"{path} is damaged: {error}.", "Bake again.") from error
