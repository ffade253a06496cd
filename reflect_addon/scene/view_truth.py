"""The truth of one view's reflections, traced once when it is asked for: what Cycles sees along the mirror ray of each reflector pixel.

Tracing takes seconds to minutes, and the window's Blender may lack what it needs: so a copy of the file goes to another process, as for a bake. The truth is
of that view, at that moment; from elsewhere there is none. Rough reflectors are shown as if they were smooth: one ray a pixel.
"""

import io
import json
import shutil
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np

from ..core.camera import Camera
from ..core.errors import ReflectError
from ..core.processes import remove_abandoned, signature
from ..core.progress import Progress
from ..core.rays import Rays
from ..core.reflected_samples import lifted
from ..core.safe_write import write_whole
from ..core.snapshot import SceneSnapshot
from .bake_job import save_copy
from .raymap_numpy import numpy_ray_map
from .worker import Worker
from .worker_command import reflect_command

SAMPLES = 32  # paths a pixel
SAME_VIEW = 1e-6  # relative to a matrix's largest number: a window's are float32
PREFIX = "reflect-truth-"


@dataclass(frozen=True, eq=False)
class ViewTruth:
    """picture: (H, W, 4) float32 of the camera's pixels, row 0 at the bottom: scene-linear radiance, and 1 where a reflector is seen."""

    camera: Camera
    picture: np.ndarray

    def is_of(self, camera: Camera) -> bool:
        """Whether it is the truth of this view, but for roundings."""
        own, other = self.camera.clip_from_world(), camera.clip_from_world()
        same = (camera.width, camera.height) == (self.camera.width, self.camera.height)
        return same and bool(np.abs(own - other).max() <= SAME_VIEW * np.abs(own).max())


def trace_view(snapshot: SceneSnapshot, camera: Camera, samples: int, trace: Callable, progress: Progress | None = None) -> np.ndarray:
    """ViewTruth.picture. trace: scene/raytrace.py's, bound to the scene."""
    rays = numpy_ray_map(snapshot, camera)
    mask, picture = rays.covered(), np.zeros((camera.height, camera.width, 4), np.float32)
    if mask.any():
        origin = lifted(rays.origin[mask], rays.normal[mask], snapshot.diagonal())
        picture[mask, :3] = trace(Rays(origin, rays.direction[mask]), samples=samples, progress=progress).radiance
        picture[mask, 3] = 1.0
    return picture


class Tracing:
    """A truth that another process traces; it and its files are gone when this is `close`d."""

    def __init__(self, scene: bpy.types.Scene, camera: Camera, preference: str = ""):
        """ReflectError where there is no usable worker, or no room for the copy of the file. preference: as start_bake's."""
        self.camera = camera
        place = Path(tempfile.gettempdir())
        remove_abandoned(place, PREFIX)
        self._folder = Path(tempfile.mkdtemp(prefix=f"{PREFIX}{signature()}-"))
        scratch = self._folder / "scratch"  # the worker's, which deletes it
        try:
            scratch.mkdir()
            blend = scratch / f"{Path(bpy.data.filepath).stem or 'unsaved'}.blend"
            (scratch / "view.json").write_text(json.dumps(camera.plain()))
            arguments = ["--view", str(scratch / "view.json"), "--out", str(self._result), "--scene", scene.name]
            command, environment = reflect_command(blend, "trace-view", arguments, preference)
            save_copy(blend)
            self.worker = Worker(command, scratch, environment, "truth")
        except BaseException:
            shutil.rmtree(self._folder, ignore_errors=True)
            raise

    @property
    def _result(self) -> Path:
        return self._folder / "truth.npy"

    def result(self) -> ViewTruth:
        """What came of it, when the worker has ended. ReflectError where it failed."""
        if self.worker.state.error is not None:
            raise self.worker.state.error
        try:
            return ViewTruth(self.camera, np.load(self._result))
        except (OSError, ValueError, EOFError) as error:
            raise ReflectError(f"The truth could not be read ({error}).", "Ask for it again.") from error

    def close(self) -> None:
        self.worker.stop()
        shutil.rmtree(self._folder, ignore_errors=True)


def write_picture(path: Path, picture: np.ndarray) -> None:
    content = io.BytesIO()
    np.save(content, picture)
    write_whole(path, content.getvalue())
