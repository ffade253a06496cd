"""What recursive mirrors are hard pressed by: where the eye is, how mirrors stand to each other, how many and how large they are.

Each case is some mirrors about the origin, a unit or so wide, over the same floor with the same three dull things. An eye that is not told
otherwise stands before them. All of it is scaled, and moved off by the same share.
"""

from dataclasses import dataclass, replace

import numpy as np

from ..core.camera import Camera
from ..core.snapshot import SceneSnapshot
from .bench_estalella_stable_cases import smooth
from .stability_scene import MATTE, MIRROR, Shape, ball, box, grid, scene_of, torus

SIZE = (96, 54)  # px
EYE, AIM = np.array([0.5, -3.0, 1.0]), np.array([0.0, 0.0, 0.1])
AT = np.array([3.0, -2.0, 1.0])  # units that everything is moved off
NEAR, FAR = 0.01, 100.0  # units
SCALES = (1e-4, 1e5)  # m of a unit
CROWD = 50
OFF = 1e-7  # units beside a plane: less than float32 tells apart there


@dataclass(frozen=True)
class Case:
    name: str
    scene: SceneSnapshot
    cameras: tuple[Camera, ...]
    size: float = 1.0  # m of a unit
    curved: bool = False  # live cube maps are drawn


def cases() -> tuple[Case, ...]:
    """All of them; none needs a file."""
    wall, other = pane(2, 1.6, (0, 0.6, 0.1), (0, -1, 0)), pane(2, 1.6, (0, -3.6, 0.1), (0, 1, 0))
    plane, level = 0.6, np.array([0.0, 1.0, 0.0])
    ahead = np.array([0.4, plane, 0.3])
    corner = {
        "Left": pane(1.2, 1.2, (-0.6, 0.0, 0.1), (1, 0, 0)), "Back": pane(1.2, 1.2, (0.0, 0.6, 0.1), (0, -1, 0)),
        "Bottom": pane(1.2, 1.2, (0.0, 0.0, -0.5), (0, 0, 1)),
    }  # fmt: skip
    inner, outer = turned(ball(0.35, rings=16)), ball(1.2, rings=16)
    nested = {"Inner": inner, "Outer": outer}
    return (
        case("the eye in the mirror's plane", {"Wall": wall}, *(eye((-2.5, plane + d, 0.3), ahead + d * level) for d in (0.0, OFF, -OFF))),
        case("the eye behind an open mirror", {"Wall": wall}, eye((0.5, 3.0, 1.0))),
        case("the eye behind a mirror with a back", {"Wall": wall}, eye((0.5, 3.0, 1.0)), more={"Back": box((2.2, 0.1, 1.8), (0, 0.7, 0.1))}),
        case("the eye on the mirror's edge", {"Wall": wall}, eye((1.0, 0.6 - 1e-3, 0.9), (0.0, 0.2, 0.1)), eye((1.0, 0.6, 0.9), (0.0, 0.2, 0.1))),
        case("at a grazing angle", {"Wall": wall}, eye((-2.5, 0.45, 0.3), (1.0, 0.6, 0.1))),
        case("two mirrors that meet at an edge", {n: corner[n] for n in ("Left", "Back")}, eye()),
        case("three mirrors that meet in a corner", corner, eye((1.5, -2.0, 1.4))),
        case("a sharp wedge of mirrors", {"One": pane(2, 1, (0, 0.1, 0), (0.05, -1, 0)), "Other": pane(2, 1, (0, -0.06, 0), (-0.05, 1, 0))}, eye((2.5, 0.02, 0.1))),
        case("two mirrors that face each other", {"Wall": wall, "Other": other}, eye()),
        case("mirrors through one another", {f"M{k}": pane(1.4, 1.2, (0, 0, 0.1), (s, -1, 0)) for k, s in enumerate((0.7, -0.7))}, eye()),
        case("the same mirror twice", {"One": wall, "Same": wall}, eye()),
        case("mirrors of a pixel", {f"M{k}": pane(0.05, 0.05, (0.2 * k - 1, 0.4, 0.1 + 0.05 * k), (0.2 * (k - 5), -1, 0)) for k in range(10)}, eye()),
        case(f"{CROWD} mirrors in a ring", ring(), eye((0.4, -0.3, 0.3), (1.0, 0.2, 0.1))),
        *(case(f"a corner, a unit is {size:g} m", corner, eye((1.5, -2.0, 1.4)), size=size) for size in SCALES),
        case("cut by the near plane", {"Wall": wall, "Left": corner["Left"]}, eye((-0.45, 0.35, 0.2), (0.3, 0.6, 0.1), near=0.3)),
        case("an orthographic eye", corner, eye((1.5, -2.0, 1.4), tall=3.0)),
        case("a ball in a ring", {"Ball": turned(ball(0.3, rings=16)), "Ring": turned(torus(0.8, 0.2, steps=16))}, eye(), curved=True),
        case("a ball in a ball, the eye between", nested, eye((0.0, -0.85, 0.2), (0.0, 0.0, 0.0)), curved=True),
        case("a ball in a ball, the eye outside", nested, eye(), curved=True),
        case("a mirror in a ball", {"Ball": outer, "Pane": pane(0.6, 0.6, (0, 0.3, 0), (0.2, -1, 0))}, eye((0.2, -0.8, 0.2), (0, 0, 0)), curved=True),
    )  # fmt: skip


def case(name: str, mirrors: dict[str, Shape], *eyes: tuple, more: dict[str, Shape] | None = None, size: float = 1.0, curved: bool = False) -> Case:
    """eyes: as eye() makes them."""
    floor = np.stack([*np.meshgrid(np.linspace(-3, 3, 9), np.linspace(-4, 3, 9), indexing="ij"), np.full((9, 9), -0.7)], -1)
    dull = {
        "Floor": turned(grid(floor)), "Red": box((0.4, 0.4, 0.7), (-0.7, -1.3, -0.35)), "Green": turned(ball(0.25, (0.6, -1.0, -0.4))),
        "Far": box((6, 0.1, 2), (0, 4.5, 0.3)), **(more or {}),
    }  # fmt: skip
    placed = {**{n: (s, MIRROR) for n, s in mirrors.items()}, **{n: (s, MATTE) for n, s in dull.items()}}
    scene = scene_of({n: (((points + AT) * size, faces), material) for n, ((points, faces), material) in placed.items()})
    scene = smooth(scene, [index for index, name in enumerate(placed) if name in ("Ball", "Ring", "Inner", "Outer", "Green")])
    return Case(name, replace(scene, light_hash="day"), tuple(seen_from(size, *one) for one in eyes), size, curved)


def eye(place=EYE, aim=AIM, near: float = NEAR, tall: float | None = None) -> tuple:
    """tall: of an orthographic camera, units that it sees."""
    return np.array(place, float), np.array(aim, float), near, tall


def seen_from(size: float, place: np.ndarray, aim: np.ndarray, near: float, tall: float | None) -> Camera:
    back = (place - aim) / np.linalg.norm(place - aim)
    side = np.cross([0, 0, 1.0], back)
    side /= np.linalg.norm(side)
    world, clip = np.eye(4), np.zeros((4, 4))
    world[:3, :3], world[:3, 3] = np.stack([side, np.cross(back, side), back], -1), (place + AT) * size
    near, far, wide = near * size, FAR * size, SIZE[0] / SIZE[1]
    if tall is None:
        clip[0, 0], clip[1, 1] = 1.6 / wide * 1.2, 1.6 * 1.2
        clip[2, 2:], clip[3, 2] = ((far + near) / (near - far), 2 * far * near / (near - far)), -1
    else:
        clip[0, 0], clip[1, 1] = 2 / (tall * size * wide), 2 / (tall * size)
        clip[2, 2:], clip[3, 3] = (-2 / (far - near), -(far + near) / (far - near)), 1
    return Camera(world, clip, *SIZE)


def pane(width: float, height: float, place, toward) -> Shape:
    """A rectangle about a place that faces along `toward`, as open as a sheet: both its sides mirror."""
    normal = np.array(toward, float) / np.linalg.norm(toward)
    up = np.array([0, 0, 1.0]) if abs(normal[2]) < 0.99 else np.array([0, 1.0, 0])
    side = np.cross(up, normal)
    side /= np.linalg.norm(side)
    up = np.cross(normal, side)
    corners = [np.array(place) + sx * side * width / 2 + sy * up * height / 2 for sx, sy in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    return np.array(corners), np.array([[0, 1, 2], [0, 2, 3]])


def ring() -> dict[str, Shape]:
    """Mirrors around the middle that all look at it, and so at each other."""
    angles = 2 * np.pi * np.arange(CROWD) / CROWD
    return {f"M{k}": pane(0.16, 0.8, (1.6 * np.cos(a), 1.6 * np.sin(a), 0.1), (-np.cos(a), -np.sin(a), 0)) for k, a in enumerate(angles)}


def turned(shape: Shape) -> Shape:
    """The same with its other side out."""
    return shape[0], shape[1][:, ::-1]
