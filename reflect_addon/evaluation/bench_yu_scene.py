"""What the targets of yu-2005 are measured on: light fields of `columns`, and mirrors of the paper's numbers of faces.

A light field is baked by `reflect bake` in a process of its own, so that its time and its peak memory are its own. The mirrors
stand where the ball of `columns` does, as wide as it: the paper, too, "scaled the reflected objects to fit them into the
bounds of the light field slabs".
"""

import importlib.util
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np
from mathutils import Matrix, Vector

from ..core.asset import Asset
from ..core.asset_files import load_asset
from ..core.asset_places import asset_name
from ..core.camera import Camera
from ..core.errors import ReflectError
from ..core.methods import light_field
from ..core.snapshot import SceneSnapshot
from ..scene.camera import camera_of
from .frame import open_frame

SAMPLES = Path(__file__).resolve().parents[2] / "sample_blends"
BALL = "Mirror sphere"  # of `columns`
RADIUS = 0.5  # m, of the mirrors: the ball has 0.55
# A process between, which is small: what a process reports as its largest memory starts at what its parent has.
APART = """
import resource, subprocess, sys
code = subprocess.run(sys.argv[1:], stdout=subprocess.DEVNULL).returncode
used = resource.getrusage(resource.RUSAGE_CHILDREN)
print(code, used.ru_maxrss * (1 if sys.platform == 'darwin' else 1024))
"""
CLI = "import sys; sys.path.insert(0, sys.argv.pop(1)); from {package}.cli import main; sys.exit(main())"


@dataclass(frozen=True)
class Baked:
    """A light field and what its bake took."""

    asset: Asset
    peak: int  # bytes, the most memory of the process that baked and saved it


@dataclass(frozen=True)
class Shape:
    """A mirror in the room of `columns`, and a camera that it fills the view of."""

    name: str
    faces: int  # triangles
    snapshot: SceneSnapshot
    camera: Camera


def columns() -> bpy.types.Scene:
    """The sample scene, opened. ReflectError where there is none."""
    path = SAMPLES / "columns.blend"
    if not path.is_file():
        raise ReflectError(f"{path} is missing.", "The targets of yu-2005 are measured in a checkout of the project.")
    bpy.ops.wm.open_mainfile(filepath=str(path))
    return bpy.context.scene


def baked_apart(folder: Path, **settings) -> Baked:
    """The light field of `columns` with these settings; ReflectError when the bake fails."""
    package, root = __package__.rpartition(".")[0], Path(__file__).resolve().parents[2]
    bake = [sys.executable, "-c", CLI.format(package=package), str(root), "bake", str(SAMPLES / "columns.blend")]
    given = [part for name, value in settings.items() for part in ("--set", f"{name}={value}")]
    bake += ["--methods", light_field.NAME, "--out", str(folder), *given]
    done = subprocess.run([sys.executable, "-c", APART, *bake], capture_output=True, text=True)
    code, peak = map(int, done.stdout.split())
    if code:
        raise ReflectError(f"The bake of columns failed: {done.stderr.strip().splitlines()[-1]}", "Bake it by itself to see why.")
    return Baked(load_asset(Path(folder) / asset_name(light_field.NAME, BALL)), peak)


def shapes(size: tuple[int, int]) -> list[Shape]:
    """Mirrors of about the faces of the paper's Table 2: a teapot, a ball, and two closed shapes of bumps for its hippo and its
    skull, in `columns` at its first frame."""
    return [_placed(*made, size) for made in (
        ("teapot", *teapot()), ("sphere", *bumpy(100, 100, 0.0, 1)), ("bumps like the hippo's", *bumpy(208, 125, 0.12, 3)),
        ("bumps like the skull's", *bumpy(267, 114, 0.06, 7)),
    )]  # fmt: skip


def bumpy(around: int, rings: int, height: float, bumps: int) -> tuple[np.ndarray, list]:
    """(vertices (V, 3), faces) of a closed ball with bumps, 2 `around` (`rings` - 1) triangles when its quads are halved."""
    down, turn = np.meshgrid(np.arange(1, rings) * np.pi / rings, np.arange(around) * 2 * np.pi / around, indexing="ij")
    points = np.stack([np.sin(down) * np.cos(turn), np.sin(down) * np.sin(turn), np.cos(down)], -1).reshape(-1, 3)
    points = np.concatenate([points, [[0, 0, 1], [0, 0, -1]]])
    points *= 1 + height * np.sin(bumps * points).prod(-1, keepdims=True)
    top, bottom, last = len(points) - 2, len(points) - 1, (rings - 2) * around
    faces = []
    for j in range(around):
        k = (j + 1) % around
        faces += [(top, j, k), (bottom, last + k, last + j)]
        faces += [(i * around + j, (i + 1) * around + j, (i + 1) * around + k, i * around + k) for i in range(rings - 2)]
    return points, faces


def teapot() -> tuple[np.ndarray, list]:
    """(vertices (V, 3), faces) of the checkout's own: 32 patches with spout and handle."""
    spec = importlib.util.spec_from_file_location("teapot_data", SAMPLES / "teapot_data.py")
    data = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(data)
    return data.tessellate(6)


def with_mirror(name: str, vertices: np.ndarray, faces: list) -> tuple[bpy.types.Scene, bpy.types.Object]:
    """(`columns` with this mirror of width 2 RADIUS in its ball's place, smooth, a camera that it fills the view of)."""
    scene = columns()
    ball = scene.objects[BALL]
    points = np.asarray(vertices, float)
    low, high = points.min(0), points.max(0)
    points = (points - (low + high) / 2) * (2 * RADIUS / (high - low).max())
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(points.tolist(), [], faces)
    mesh.polygons.foreach_set("use_smooth", [True] * len(mesh.polygons))
    mesh.materials.append(ball.data.materials[0])
    ball.data = mesh
    camera = bpy.data.objects.new("Close", bpy.data.cameras.new("Close"))
    scene.collection.objects.link(camera)
    at = ball.matrix_world.translation
    camera.matrix_world = Matrix.Translation(at + Vector((0.5, -1.5, 0.5)))
    camera.rotation_euler = (at - camera.location).to_track_quat("-Z", "Y").to_euler()
    camera.data.lens = 55
    bpy.context.view_layer.update()
    return scene, camera


def _placed(name: str, vertices: np.ndarray, faces: list, size: tuple[int, int]) -> Shape:
    scene, camera = with_mirror(name, vertices, faces)
    with open_frame(scene, None) as snapshot:
        instance = snapshot.named()[BALL]
        return Shape(name, len(snapshot.meshes[instance.mesh].triangles), snapshot, camera_of(scene, camera, *size))
