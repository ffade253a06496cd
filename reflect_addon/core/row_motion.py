"""How one row of `billboard_buf` moves, as kernel functions: billboard_atlas.moved_row's and depth_atlas.moved_map_row's rules.

Problem. A row holds planes, axes, sizes and places of a stand-in; a kernel that is to move it must change each column by its own rule.
Idea. A motion is three uniforms of four numbers, the rows of now_from_baked relative to the asset's centre; COLUMNS says what it makes of
each column, of a quad or of a depth map's camera. A volume's quad is a picture from one side: it goes along in its middle and its size, and
is turned by the smallest turn that lets it face the reflector where both are now, as a bake would place it (3.1: perpendicular to the
line between the two middles).
Limits. One size for all directions, as in remake.is_rigid: what is stretched is shown as large as its x axis.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np

from .billboard_atlas import ROW
from .kernel import Program, evaluate, record_function

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


def uniform_name(number: int, axis: str) -> str:
    return f"move{number}_{axis}"


def motion_uniforms(number: int, world_from_world: np.ndarray, center) -> dict[str, tuple[float, ...]]:
    """The uniforms of a motion (4, 4). center: of the asset."""
    relative = np.asarray(world_from_world, np.float64).copy()
    relative[:3, 3] += relative[:3, :3] @ np.asarray(center, np.float64) - center
    return {uniform_name(number, axis): tuple(map(float, row)) for axis, row in zip(AXES, relative)}


def middle_of(row: np.ndarray) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """(middle of a quad, the point before it that it faces), relative to the asset's centre, which is the reflector's middle, or beside it."""
    row = row.astype(np.float64)
    planes = row[[ROW["plane"], ROW["u"], ROW["v"]]]
    middle = np.linalg.solve(planes[:, :3], [planes[0, 3], -planes[1, 3], -planes[2, 3]])
    normal = planes[0, :3]
    return tuple(map(float, middle)), tuple(map(float, middle + normal * max(-(middle @ normal), 1e-3 * np.linalg.norm(middle))))


def turned_to(k, own: Motion, stood, before, now) -> Motion:
    """The motion of a quad that goes along with its object in its middle and size, and is turned by the smallest turn that lets it face the
    reflector. stood: its middle, before: the reflector's, when it was baked; now: the reflector's now."""
    stands = k.name("stands", own.place(k, stood))
    a, b = k.normalize(before - stood), k.normalize(now - stands)
    axis, c = k.name("axis", k.cross(a, b)), k.name("c", k.dot(a, b))
    part = k.name("part", axis / k.max(1.0 + c, LEAST_TURN))
    x = k.vec3(c + part.x * axis.x, part.x * axis.y - axis.z, part.x * axis.z + axis.y)
    y = k.vec3(part.y * axis.x + axis.z, c + part.y * axis.y, part.y * axis.z - axis.x)
    z = k.vec3(part.z * axis.x - axis.y, part.z * axis.y + axis.x, c + part.z * axis.z)
    rows = [k.name(f"turn_{name}", row * own.scale) for name, row in zip(AXES, (x, y, z))]
    where = (stands.x, stands.y, stands.z)
    return Motion(*(k.vec4(row, at - k.dot(row, stood)) for row, at in zip(rows, where)), own.scale)


@cache
def _turning() -> Program:
    """turned_to as a program, recorded once: `faced` is asked on each frame of what moves."""

    def function(k, scope, x, y, z, stood, before, now):
        made = turned_to(k, Motion(x, y, z, k.length(x.xyz)), stood, before, now)
        return {axis: getattr(made, axis) for axis in AXES}

    return record_function(function, dict.fromkeys(AXES, "vec4") | dict.fromkeys(("stood", "before", "now"), "vec3"))


def faced(row: np.ndarray, world_from_world: np.ndarray, seer, center) -> np.ndarray:
    """(4, 4) float64, world_from_world: how the quad of a row goes along with its object and faces the reflector, whose middle is now at
    `seer` (3,), world."""
    stood, before = middle_of(row)
    rows = motion_uniforms(0, world_from_world, center)
    given = {axis: rows[uniform_name(0, axis)] for axis in AXES}
    given |= {"stood": stood, "before": before, "now": np.asarray(seer, np.float64) - center}

    found = evaluate(_turning(), {name: np.array([value]) for name, value in given.items()}, dtype=np.float64)
    relative = np.vstack([*(found[axis][0] for axis in AXES), [0.0, 0.0, 0.0, 1.0]])
    relative[:3, 3] += center - relative[:3, :3] @ np.asarray(center, np.float64)
    return relative


def _plane(k, motion: Motion, how: str, texel):
    normal = motion.turn(k, texel.xyz)
    if how == MAP:
        return _axis(k, motion, how, texel)
    return k.vec4(normal, texel.w * motion.scale + k.dot(normal, motion.shift(k)))


def _axis(k, motion: Motion, how: str, texel):
    axis = motion.turn(k, texel.xyz)
    if how == MAP:  # metres along an axis of the camera
        return k.vec4(axis, texel.w * motion.scale - k.dot(axis, motion.shift(k)))
    axis = axis * motion.shrink(k)  # half sides of the quad
    return k.vec4(axis, texel.w - k.dot(axis, motion.shift(k)))


def _detail(k, motion: Motion, how: str, texel):
    return k.vec4(texel.x, texel.y * motion.shrink(k), texel.z, texel.w)


def _eye(k, motion: Motion, how: str, texel):
    return k.vec4(motion.place(k, texel.xyz), texel.w * motion.shrink(k))


def _limits(k, motion: Motion, how: str, texel):
    return k.vec4(texel.xyz * motion.scale, texel.w)


def _ball(k, motion: Motion, how: str, texel):
    return k.vec4(motion.place(k, texel.xyz), texel.w * motion.scale)


COLUMNS = {"plane": _plane, "u": _axis, "v": _axis, "detail": _detail, "eye": _eye, "limits": _limits, "ball": _ball}
