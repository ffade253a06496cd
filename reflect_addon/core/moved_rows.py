"""Stand-ins that follow their objects without a new table, as kernel functions [popescu-2006 section 3, 4.3].

Problem. The overlay moves rows of `billboard_buf` and uploads the table again (billboard_follow.py). A material in a Blender without the
add-on has nobody who does that: its table is an image, as it was baked.
Idea. For each thing that may move the kernel takes a motion, three uniforms of four numbers, and moves a row's columns as they are fetched,
by billboard_atlas.moved_row's and depth_atlas.moved_map_row's own rules. So all that reads rows follows: rays, levels, mirrors, highlights.
Which rows belong to whom is known when the kernel is recorded: each run of rows of one thing is a loop of its own, and the loops of what
stays compute nothing more.
  * Flat quads and depth maps go along with their object, turned as it is.
  * The quad of a volume is a picture from one side. It goes along with its middle and is turned towards the reflector, where that is now,
    as a bake would place it (3.1: perpendicular to the line between the two middles); the picture on it stays.
  * Normals of mirrors turn with them.
A reflector that moves needs none of this but for maps of itself and the quads that face it: rays are the world's.
Limits. One size for all directions, as in remake.is_rigid: what is stretched is shown as large as its x axis. Light, shadows, lamps that
highlights are of, and what is part of the backdrop stay as baked. A quad that faces the reflector shows a thing that turns from one side.
"""

from collections.abc import Collection, Iterator
from dataclasses import dataclass, replace

import numpy as np

from .asset import Asset
from .billboard_atlas import ROW

# How a kind of stand-in (remake.RULES) follows.
RIGID, MAP, FACES = "rigid", "map", "faces"
FOLLOWS = {
    "flat": RIGID, "flat_mirror": RIGID, "flat_glossy": RIGID,
    "map": MAP, "mirror_map": MAP, "glossy_map": MAP,
    "volume": FACES, "mirror": FACES, "glossy": FACES,
}  # fmt: skip
AXES = ("x", "y", "z")
LEAST_SCALE = 1e-20  # of a motion: an object that is deleted has a motion of zeros, and no ray meets its rows
LEAST_TURN = 1e-6  # 1 + cosine of a quad that has come to the reflector's other side, where no turn is the smallest


@dataclass(frozen=True)
class Mover:
    """Rows first..last-1, which follow motion number `number`. `middle`, `seer`: whether the quad faces the reflector."""

    number: int
    first: int
    last: int
    how: str  # RIGID, MAP or FACES


@dataclass(frozen=True)
class Motion:
    """now_from_baked relative to the asset's centre: rows (vec4) of a matrix that turns and scales by one number."""

    x: object
    y: object
    z: object
    scale: object

    def place(self, k, p):
        return k.vec3(*(k.dot(row.xyz, p) + row.w for row in (self.x, self.y, self.z)))

    def turn(self, k, d):
        """d turned; its length stays."""
        return k.vec3(*(k.dot(row.xyz, d) for row in (self.x, self.y, self.z))) * self.shrink(k)

    def shift(self, k):
        return k.vec3(self.x.w, self.y.w, self.z.w)

    def shrink(self, k):
        return 1.0 / k.max(self.scale, LEAST_SCALE)


@dataclass(frozen=True)
class Run:
    """A mover's rows and its motion, in a kernel that is being recorded."""

    mover: Mover
    motion: Motion


def uniform_name(number: int, axis: str) -> str:
    return f"move{number}_{axis}"


def with_movers(asset: Asset, moving: Collection[str]) -> tuple[Asset, tuple[str, ...]]:
    """(the asset whose kernel takes motions, the instances that these are of, by number) for those of `moving` that it has rows of, or whose
    motion turns its rows: all at rest. The asset itself where there are none."""
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
        if movers and replace(movers[-1], first=new.first, last=new.last) == new and movers[-1].last == new.first and new.how != FACES:
            new = replace(new, first=movers.pop().first)
        elif new.how == FACES:
            middle = _middle(asset.images["billboard_buf"][part.row])
            uniforms[f"stands{part.row}"], uniforms[f"seer{part.row}"] = middle
        movers.append(new)
    for number in range(len(names)):
        uniforms |= motion_uniforms(number, np.eye(4), (0.0, 0.0, 0.0))
    seer = names.index(own.instance) if faces and turns else -1
    options = {**asset.options, "movers": tuple(movers), "seer": seer}
    return replace(asset, options=options, uniforms={**asset.uniforms, **uniforms}), names


def motion_uniforms(number: int, world_from_world: np.ndarray, center) -> dict[str, tuple[float, ...]]:
    """The uniforms of a motion (4, 4). center: of the asset."""
    relative = np.asarray(world_from_world, np.float64).copy()
    relative[:3, 3] += relative[:3, :3] @ np.asarray(center, np.float64) - center
    return {uniform_name(number, axis): tuple(map(float, row)) for axis, row in zip(AXES, relative)}


def _middle(row: np.ndarray) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """(middle of a quad, the point before it that it faces), relative to the asset's centre, which is the reflector's middle, or beside it."""
    row = row.astype(np.float64)
    planes = row[[ROW["plane"], ROW["u"], ROW["v"]]]
    middle = np.linalg.solve(planes[:, :3], [planes[0, 3], -planes[1, 3], -planes[2, 3]])
    normal = planes[0, :3]
    return tuple(map(float, middle)), tuple(map(float, middle + normal * max(-(middle @ normal), 1e-3 * np.linalg.norm(middle))))


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
    """The smallest turn that lets the quad face the reflector where both are now."""
    own, seer = rigid[mover.number], asset.uniforms[f"seer{mover.first}"]
    stood = asset.uniforms[f"stands{mover.first}"]
    stands = k.name("stands", own.place(k, stood))
    now = seer if asset.options["seer"] < 0 else rigid[asset.options["seer"]].place(k, seer)
    a, b = k.normalize(seer - stood), k.normalize(now - stands)
    axis, c = k.name("axis", k.cross(a, b)), k.name("c", k.dot(a, b))
    part = k.name("part", axis / k.max(1.0 + c, LEAST_TURN))
    x = k.vec3(c + part.x * axis.x, part.x * axis.y - axis.z, part.x * axis.z + axis.y)
    y = k.vec3(part.y * axis.x + axis.z, c + part.y * axis.y, part.y * axis.z - axis.x)
    z = k.vec3(part.z * axis.x - axis.y, part.z * axis.y + axis.x, c + part.z * axis.z)
    rows = [k.name(f"turn_{name}", row * own.scale) for name, row in zip(AXES, (x, y, z))]
    where = (stands.x, stands.y, stands.z)
    return Motion(*(k.vec4(row, at - k.dot(row, stood)) for row, at in zip(rows, where)), own.scale)


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
    if "runs" not in asset.options or field not in _COLUMNS:
        return texel
    if "one_run" in asset.options:
        (run,) = asset.options["runs"]
        return _COLUMNS[field](k, run, texel)
    for run in asset.options["runs"]:
        texel = k.select(_belongs(run, row), _COLUMNS[field](k, run, texel), texel)
    return texel


def turned(k, asset, row, normal):
    """A normal of row `row` as its object is turned now."""
    for run in asset.options["runs"] if "runs" in asset.options else ():
        normal = k.select(_belongs(run, row), run.motion.turn(k, normal), normal)
    return normal


def _belongs(run: Run, row):
    return (row > run.mover.first - 0.5) & (row < run.mover.last - 0.5)


def _plane(k, run: Run, texel):
    motion = run.motion
    normal = motion.turn(k, texel.xyz)
    if run.mover.how == MAP:
        return _axis(k, run, texel)
    return k.vec4(normal, texel.w * motion.scale + k.dot(normal, motion.shift(k)))


def _axis(k, run: Run, texel):
    motion = run.motion
    axis = motion.turn(k, texel.xyz)
    if run.mover.how == MAP:  # metres along an axis of the camera
        return k.vec4(axis, texel.w * motion.scale - k.dot(axis, motion.shift(k)))
    axis = axis * motion.shrink(k)  # half sides of the quad
    return k.vec4(axis, texel.w - k.dot(axis, motion.shift(k)))


def _detail(k, run: Run, texel):
    return k.vec4(texel.x, texel.y * run.motion.shrink(k), texel.z, texel.w)


def _eye(k, run: Run, texel):
    return k.vec4(run.motion.place(k, texel.xyz), texel.w * run.motion.shrink(k))


def _limits(k, run: Run, texel):
    return k.vec4(texel.xyz * run.motion.scale, texel.w)


def _ball(k, run: Run, texel):
    return k.vec4(run.motion.place(k, texel.xyz), texel.w * run.motion.scale)


_COLUMNS = {"plane": _plane, "u": _axis, "v": _axis, "detail": _detail, "eye": _eye, "limits": _limits, "ball": _ball}
