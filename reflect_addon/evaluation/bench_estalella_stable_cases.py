"""What virtual objects and their searches are hard pressed by: reflectors, things around them, eyes.

Each case is a reflector about the origin, about one unit wide, among the same things: a floor; a box with a corner on the reflector and
one that pokes into it; boxes on the line from the eye to the middle, before it and behind; and a wall a million units off. All of it is
scaled, and moved off by the same share.
"""

from collections.abc import Collection
from dataclasses import dataclass, replace

import numpy as np

from ..core.camera import Camera
from ..core.snapshot import Mesh, SceneSnapshot
from .stability_scene import MATTE, MIRROR, Shape, ball, box, broken, grid, scene_of, torus

PIXELS = 64
EYE = np.array([0.6, -3.0, 1.1])
FAR_OFF = 1e6
BEVEL = 0.01  # of the cube's edge
SCALES = (1e-4, 1.0, 1e5)
LIFT = 1e-4  # units that an eye "on the surface" is above it: its camera has to have a near plane


@dataclass(frozen=True)
class Case:
    """center: the reflector's middle, world; size: of a unit, m; reflector: its shape."""

    name: str
    scene: SceneSnapshot
    reflector: Shape
    size: float
    cameras: tuple[Camera, ...]
    maps: int = 64  # texels of the reflector's maps


def cases() -> tuple[Case, ...]:
    """All of them; none needs a file."""
    round_one, hole = _turned(ball(0.5, rings=24)), _turned(torus(0.36, 0.14, steps=24))
    return (
        *(_case(f"ball, a unit is {size:g} m", round_one, size) for size in SCALES),
        _case("ellipsoid 50:1", _stretched(round_one, (1, 1 / 50, 1 / 50))),
        _case("ellipsoid 1:50", _stretched(round_one, (1, 1, 1 / 50))),
        _case(f"cube with a {BEVEL:.0%} bevel", bevelled(BEVEL)),
        _case("torus", hole),
        _case("ball turned inside out", _turned(round_one)),
        _case("torus turned inside out", _turned(hole)),
        _case("flat square", _square()),
        _case("every triangle thrice, and some without area", broken(round_one)),
        _case("three sheets at one edge", _sheets()),
        _case("one triangle", (np.array([[-0.5, 0, -0.4], [0.5, 0, -0.4], [0, 0.1, 0.5]]), np.array([[0, 1, 2]]))),
        _case("no area at all", (np.array([[-0.5, 0, 0], [0, 0, 0], [0.5, 0, 0.0]]), np.array([[0, 1, 2], [0, 0, 1]]))),
        _case("map of 16 texels", round_one, maps=16),
    )


def _case(name: str, reflector: Shape, size: float = 1.0, **more) -> Case:
    points, faces = reflector
    corners = points[faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    facing = corners[(((EYE - corners.mean(1)) * normal).sum(-1) / np.maximum(np.linalg.norm(normal, axis=-1), 1e-30)).argmax()]
    touched = facing.mean(0)
    shapes = {
        "Mirror": (reflector, MIRROR),
        "Floor": (grid(np.stack([*np.meshgrid(np.linspace(-2, 2, 9), np.linspace(-2, 2, 9), indexing="ij"), np.full((9, 9), -0.7)], -1)), MATTE),
        "Touching": (box((0.4, 0.4, 0.4), facing[0] + 0.2 * np.array([1, 1, 1])), MATTE),
        "Poking": (box((0.3, 0.1, 0.1), (-0.5, 0.0, 0.1)), MATTE),
        "Behind": (box((0.1, 0.1, 0.1), -0.4 * EYE), MATTE),
        "Before": (box((0.02, 0.02, 0.02), 0.4 * EYE), MATTE),
        "Far": (grid(np.array([[[-1, 0, -1], [-1, 0, 1]], [[1, 0, -1], [1, 0, 1]]]) * FAR_OFF + [0, -FAR_OFF, 0]), MATTE),
    }
    at = np.array([3.0, -2.0, 1.0])
    placed = {n: (((p + at) * size, f), m) for n, ((p, f), m) in shapes.items()}
    scene = replace(smooth(scene_of(placed)), light_hash="day")
    eyes = (EYE, touched + LIFT * (EYE - touched))
    cameras = (
        *(camera((eye + at) * size, at * size, size) for eye in eyes), camera((EYE + at) * size, at * size, size, tall=1.4 * size),
    )  # fmt: skip
    return Case(name, scene, (placed["Mirror"][0]), size, cameras, **more)


def camera(eye: np.ndarray, target: np.ndarray, size: float, tall: float | None = None) -> Camera:
    """Looks from eye at target, the z axis up; orthographic where `tall` says how much it sees, m."""
    back = (eye - target) / max(np.linalg.norm(eye - target), 1e-300)
    side = np.cross([0, 0, 1.0] if abs(back[2]) < 0.999 else [0, 1.0, 0], back)
    side /= np.linalg.norm(side)
    world, clip = np.eye(4), np.zeros((4, 4))
    world[:3, :3], world[:3, 3] = np.stack([side, np.cross(back, side), back], -1), eye
    near, far = 1e-5 * size, 1e3 * size
    if tall is None:
        clip[0, 0] = clip[1, 1] = 3.0
        clip[2, 2:], clip[3, 2] = ((far + near) / (near - far), 2 * far * near / (near - far)), -1
    else:
        clip[0, 0] = clip[1, 1] = 2 / tall
        clip[2, 2:], clip[3, 3] = (-2 / (far - near), -(far + near) / (far - near)), 1
    return Camera(world, clip, PIXELS, PIXELS)


def smooth(scene: SceneSnapshot, which: Collection[int] = (0,)) -> SceneSnapshot:
    """The same with corner normals of these meshes the means of those around their vertices, as far as there are any."""
    return replace(scene, meshes=tuple(_smooth(mesh) if index in which else mesh for index, mesh in enumerate(scene.meshes)))


def _smooth(mesh: Mesh) -> Mesh:
    corners = mesh.positions[mesh.triangles].astype(np.float64)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    total = np.zeros((len(mesh.positions), 3))
    np.add.at(total, mesh.triangles, normal[:, None])
    total /= np.maximum(np.linalg.norm(total, axis=-1, keepdims=True), 1e-300)
    return replace(mesh, corner_normals=total[mesh.triangles].astype(np.float32))


def bevelled(bevel: float, steps: int = 4) -> Shape:
    """A cube of edge 1 with rounded edges of radius `bevel`, `steps` facets around each."""
    flat = 0.5 - bevel
    turn = np.tan(np.arange(1, steps // 2 + 1) * np.pi / (2 * steps))
    along = np.concatenate([-(flat + bevel * turn)[::-1], np.linspace(-flat, flat, 5), flat + bevel * turn])
    u, v = np.meshgrid(along, along, indexing="ij")
    points, faces, first = [], [], 0
    for axis in range(3):
        for side in (-1.0, 1.0):
            made, found = grid(np.roll(np.stack([np.full_like(u, side * 0.5), u, v], -1), axis, -1))
            core = np.clip(made, -flat, flat)
            off = made - core
            points.append(core + bevel * off / np.linalg.norm(off, axis=-1, keepdims=True))
            faces.append((found if side < 0 else found[:, ::-1]) + first)
            first += len(made)
    points = np.concatenate(points)
    _, one, where = np.unique(np.round(points, 9), axis=0, return_index=True, return_inverse=True)
    return points[one], where.ravel()[np.concatenate(faces)]


def _stretched(shape: Shape, by) -> Shape:
    return shape[0] * np.asarray(by), shape[1]


def _turned(shape: Shape) -> Shape:
    """The same with its other side out."""
    return shape[0], shape[1][:, ::-1]


def _square() -> Shape:
    return grid(np.array([[[-0.5, 0.0, -0.5], [-0.5, 0.0, 0.5]], [[0.5, 0.0, -0.5], [0.5, 0.0, 0.5]]]))


def _sheets() -> Shape:
    """Three half planes that meet in the z axis, as no solid has."""
    ends = [[np.cos(a), np.sin(a)] for a in (-2.2, -1.2, 1.4)]
    points = [[0, 0, -0.5], [0, 0, 0.5], *([0.5 * x, 0.5 * y, z] for x, y in ends for z in (-0.5, 0.5))]
    faces = [face for i in (2, 4, 6) for face in ((0, i, 1), (1, i, i + 1))]
    return np.array(points, float), np.array(faces)
