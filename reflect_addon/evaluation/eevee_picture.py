"""One picture as EEVEE makes it, a method's node groups in the materials: `render --backend eevee`."""

from pathlib import Path

import bpy
import numpy as np

from ..core.camera import Camera
from ..core.errors import ReflectError
from ..core.processes import temporary_folder
from ..core.progress import Progress
from ..core.snapshot import SceneSnapshot
from ..scene.eevee_job import Groups, Job
from ..scene.exr import read_exr, stacked
from ..scene.raytrace import to_rec709
from .eevee_apart import draw_apart
from .peer import PROBE_SIDE


def eevee_picture(
    scene: bpy.types.Scene, snapshot: SceneSnapshot, camera_name: str, view: Camera, method: str, folder: Path, samples: int, say: Progress
) -> np.ndarray:
    """(H, W, 3) float32, linear Rec.709, row 0 at the bottom. folder: of the assets. ReflectError where the method has no node group."""
    size = (view.width, view.height)
    groups = (Groups(method, str(folder)),)
    job = Job(
        scene.name, camera_name, snapshot.frame, size, samples, PROBE_SIDE, (), (), (), (), (), groups, snapshot.diagonal(), shown=True
    )
    with temporary_folder("reflect-eevee-") as out:
        told = draw_apart(job, out, say)["groups"][0]
        if told["error"] is not None:
            raise ReflectError(told["error"], "Choose another method, or leave --backend eevee out.")
        for note in told["notes"]:
            say(1.0, f"Warning: {note}")
        return to_rec709(stacked(read_exr(out / "group0.exr"), "Combined", "RGB")).astype(np.float32)
