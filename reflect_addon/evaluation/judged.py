"""What a frame's methods are judged against: its ray map and the truth along its rays; and a row's scores against it."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import bpy
import numpy as np

from ..core import metrics
from ..core.camera import Camera
from ..core.errors import ReflectError
from ..core.lamp_hits import with_lamps
from ..core.look import Look
from ..core.progress import Progress
from ..core.rays import RayMap, Rays
from ..core.snapshot import SceneSnapshot
from ..scene.look import read_look
from . import eye
from .backends import GpuBackend, NumpyBackend
from .pictures import placed
from .truth import SEEDS, Truth, key_of, lifted, truth_of

# Whose ray map it is. EEVEE's pixels are those that the GPU draws.
RAY_MAPS: dict[str, Callable] = {"gpu": GpuBackend.ray_map, "numpy": NumpyBackend.ray_map, "eevee": GpuBackend.ray_map}


@dataclass(frozen=True)
class Judged:
    """What all methods of one frame are judged against."""

    scene: str
    camera_name: str
    camera: Camera
    snapshot: SceneSnapshot
    ray_map: RayMap
    rays: Rays  # of the covered pixels
    truth: Truth
    backend: str  # a key of RAY_MAPS
    truth_picture: np.ndarray  # (H, W, 3) display-encoded: the frame, its reflector pixels the truth of their rays
    look: Look
    diagonal: float
    samples: int


def judge(scene, snapshot, size, out, camera_name, samples, backend, say) -> Judged:
    """Ray map and truth of one frame."""
    from ..scene.camera import camera_of
    from ..scene.intersect import intersector
    from ..scene.raytrace import primary, trace

    camera_object = named_camera(scene, camera_name)
    camera = camera_of(scene, camera_object, *size)
    ray_map = RAY_MAPS[backend](snapshot, camera)
    diagonal = snapshot.diagonal()
    if not diagonal > 0:
        raise ReflectError(f"The scene {scene.name} has no extent.", "Give its objects faces and a size.")
    key = key_of(ray_map, camera, snapshot.geometry_hash, samples, bpy.app.version_string)
    say(0.05, f"tracing the truth with Cycles, {samples} samples, twice, and the frame")
    truth = truth_of(
        ray_map,
        camera,
        diagonal,
        samples,
        lambda rays, **more: trace(rays, scene=scene, progress=_guard(say), **more),
        lambda view, **more: primary(view, scene=scene, progress=_guard(say), **more),
        out / "truth" / f"{key}.npz",
    )
    if snapshot.lamps:
        rays = lifted(ray_map, diagonal)
        truth = replace(truth, hits=with_lamps(truth.hits, rays, snapshot, intersector(snapshot)))
    look = read_look(scene)
    label = Path(bpy.data.filepath).stem or scene.name
    mask = ray_map.covered()
    picture = look.apply(placed(truth.frame, mask, truth.hits.radiance))
    return Judged(
        label, (camera_object or scene.camera).name, camera, snapshot, ray_map, lifted(ray_map, 0.0), truth, backend, picture,
        look, diagonal, samples,
    )  # fmt: skip


def named_camera(scene: bpy.types.Scene, name: str | None) -> bpy.types.Object | None:
    """The named camera object; None stands for the scene's. ReflectError lists those there are."""
    if name is None:
        return None
    found = scene.objects.get(name)
    if found is None or found.type != "CAMERA":
        there = [o.name for o in scene.objects if o.type == "CAMERA"]
        raise ReflectError(
            f"There is no camera named '{name}' in the scene {scene.name}.",
            f"Choose among: {', '.join(there)}." if there else "Add a camera to the scene.",
        )
    return found


def whose(judged: Judged) -> dict:
    """The fields of a row that say what was drawn."""
    return {
        "scene": judged.scene,
        "camera": judged.camera_name,
        "frame": judged.snapshot.frame,
        "size": f"{judged.camera.width}x{judged.camera.height}",
        "blender": bpy.app.version_string,
        "pixels": int(judged.ray_map.covered().sum()),
    }


def truth_settings(judged: Judged) -> dict:
    return {"truth_samples": judged.samples, "truth_seeds": list(SEEDS)}


def scores_of(judged: Judged, radiance: np.ndarray) -> tuple[np.ndarray, dict, list[str]]:
    """(display-encoded picture with this radiance (N, 3) in the covered pixels, the row's errors of it, notes)."""
    mask, truth = judged.ray_map.covered(), judged.truth.hits.radiance
    picture = judged.look.apply(placed(judged.truth.frame, mask, radiance))
    flip, flip_note = eye.flip(picture, judged.truth_picture, mask)
    ssim, ssim_note = eye.ssim(picture, judged.truth_picture, mask)
    errors = {
        "rmse": metrics.rmse(radiance, truth),
        "relmse": metrics.relmse(radiance, truth),
        "median_relative": metrics.median_relative(radiance, truth),
        "flip": flip,
        "ssim": ssim,
        "floor_rmse": metrics.rmse(judged.truth.second_radiance, truth),
    }
    return picture, errors, [n for n in (flip_note, ssim_note) if n]


def _guard(say: Progress) -> Progress:
    """Passes a part's words on, at the share where the truth is traced."""
    return lambda share, text: say(0.05 + 0.3 * share, text)
