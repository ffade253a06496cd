"""Stand-ins that follow their objects without a new table, as kernel functions [popescu-2006 section 3, 4.3].

Problem. The overlay moves rows of `billboard_buf` and uploads the table again (billboard_follow.py). A material in a Blender without the
add-on has nobody who does that: its table is an image, as it was baked.
Idea. For each thing that may move the kernel takes a motion, three uniforms of four numbers, and moves a row's columns as they are fetched
(row_motion.py). So all that reads rows follows: rays, levels, mirrors, highlights.
Which rows belong to whom is known when the kernel is recorded: each run of rows of one thing is a loop of its own, and the loops of what
stays compute nothing more.
  * Flat quads and depth maps go along with their object, turned as it is.
  * The quad of a volume goes along and faces the reflector; the picture on it stays (row_motion.py).
  * Normals of mirrors turn with them.
A reflector that moves needs none of this but for maps of itself and the quads that face it: rays are the world's.
Limits. Light, shadows, lamps that highlights are of, and what is part of the backdrop stay as baked. A quad that faces the reflector shows
a thing that turns from one side. Each thing that moves costs a loop in the shader.
"""

from collections.abc import Collection, Iterator
from dataclasses import dataclass, replace

import numpy as np

from .asset import Asset
from .row_motion import AXES, COLUMNS, FACES, FOLLOWS, Motion, middle_of, motion_uniforms, turned_to, uniform_name


@dataclass(frozen=True)
class Mover:
    """Rows first..last-1, which follow motion number `number`."""

    number: int
    first: int
    last: int
    how: str  # RIGID, MAP or FACES


@dataclass(frozen=True)
class Run:
    """A mover's rows and its motion, in a kernel that is being recorded."""

    mover: Mover
    motion: Motion


def with_movers(asset: Asset, moving: Collection[str]) -> tuple[Asset, tuple[str, ...]]:
    """(the asset whose kernel takes motions, the instances that these are of, by number) for those of `moving` that it has rows of, or that
    turn its rows as its reflector (options "movers", and "seer": the reflector's number, -1 where it stands); all at rest. The asset itself where there are none."""
    own = next((part for part in asset.parts if part.kind == "reflector"), None)
    turns = own is not None and own.instance in moving
    rows = [part for part in asset.parts if part.kind in FOLLOWS and "billboard_buf" in asset.images]
    rows = [part for part in rows if part.instance in moving or (turns and FOLLOWS[part.kind] == FACES)]
    if not rows:
        return asset, ()
    faces = any(FOLLOWS[part.kind] == FACES for part in rows)
    names = tuple(dict.fromkeys([part.instance for part in rows] + [own.instance] * (faces and turns)))
    movers: list[Mover] = []
    uniforms: dict[str, tuple[float, ...]] = {}
    for part in sorted(rows, key=lambda p: p.row):
        new = Mover(names.index(part.instance), part.row, part.row + 1, FOLLOWS[part.kind])
        if new.how != FACES and movers and replace(movers[-1], first=part.row, last=part.row + 1) == new and movers[-1].last == part.row:
            new = replace(new, first=movers.pop().first)
        elif new.how == FACES:
            uniforms[f"stands{part.row}"], uniforms[f"seer{part.row}"] = middle_of(asset.images["billboard_buf"][part.row])
        movers.append(new)
    for number in range(len(names)):
        uniforms |= motion_uniforms(number, np.eye(4), (0.0, 0.0, 0.0))
    seer = names.index(own.instance) if faces and turns else -1
    options = {**asset.options, "movers": tuple(movers), "seer": seer}
    return replace(asset, options=options, uniforms={**asset.uniforms, **uniforms}), names


def in_motion(k, asset):
    """The asset of a kernel with the motions of its movers computed, once for all that reads rows. The asset itself where nothing moves."""
    if "movers" not in asset.options:
        return asset
    k.cite("stand-ins of what moves: from where they were baked to where their objects are")
    numbers = {mover.number for mover in asset.options["movers"]} | {asset.options["seer"]} - {-1}
    rigid = {number: _rigid(k, asset, number) for number in sorted(numbers)}
    runs = tuple(Run(m, _facing(k, asset, m, rigid) if m.how == FACES else rigid[m.number]) for m in asset.options["movers"])
    return replace(asset, options={**asset.options, "runs": runs})


def _rigid(k, asset, number: int) -> Motion:
    rows = [asset.uniforms[uniform_name(number, axis)] for axis in AXES]
    return Motion(*rows, k.name("scale", k.length(rows[0].xyz)))


def _facing(k, asset, mover: Mover, rigid: dict[int, Motion]) -> Motion:
    stood, seer = (asset.uniforms[f"{name}{mover.first}"] for name in ("stands", "seer"))
    now = seer if asset.options["seer"] < 0 else rigid[asset.options["seer"]].place(k, seer)
    return turned_to(k, rigid[mover.number], stood, seer, now)


def runs(asset, first: int, last: int) -> Iterator[tuple[object, int, int]]:
    """(the asset as rows `first` to before `last` see it, first, last), one for each run of rows that move alike; for one loop each."""
    at = first
    for run in asset.options["runs"] if "runs" in asset.options else ():
        low, high = max(first, run.mover.first), min(last, run.mover.last)
        if low < high:
            if at < low:
                yield _still(asset), at, low
            yield replace(asset, options={**asset.options, "runs": (run,), "one_run": True}), low, high
            at = high
    if at < last:
        yield _still(asset), at, last


def _still(asset):
    if "runs" not in asset.options:
        return asset
    return replace(asset, options={**asset.options, "runs": ()})


def moved(k, asset, field: str, row, texel):
    """A row's column where its object is now."""
    if "runs" not in asset.options or field not in COLUMNS:
        return texel
    if "one_run" in asset.options:
        (run,) = asset.options["runs"]
        return COLUMNS[field](k, run.motion, run.mover.how, texel)
    for run in asset.options["runs"]:
        texel = k.select(_belongs(run, row), COLUMNS[field](k, run.motion, run.mover.how, texel), texel)
    return texel


def turned(k, asset, row, normal):
    """A normal of row `row` as its object is turned now."""
    for run in asset.options["runs"] if "runs" in asset.options else ():
        normal = k.select(_belongs(run, row), run.motion.turn(k, normal), normal)
    return normal


def _belongs(run: Run, row):
    return (row > run.mover.first - 0.5) & (row < run.mover.last - 0.5)
