"""The two passes before the resolve: the rays of a camera's reflector pixels, and the reflection buffer that holds their answers.

Both are drawn into targets that are kept from frame to frame, as long as the camera's size stays.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

from ..core.asset import Asset
from ..core.camera import Camera
from .answers import Answers
from .counts import Counts
from .level_targets import Seen
from .scene_on_gpu import SceneOnGpu
from .targets import RayMapTarget, ReflectionTarget
from .upload import triangle_batch
from .view import View


class ReflectionPasses:
    """All draw within state.drawing_state()."""

    def __init__(self, gpu, scene: SceneOnGpu, answers: Answers, counts: Counts):
        self.view, self.batch = View(), triangle_batch()
        self.rays: RayMapTarget | None = None  # drawn last
        self._gpu, self._scene, self._answers, self._counts = gpu, scene, answers, counts
        self._targets: dict[str | None, ReflectionTarget] = {}
        self._draws = False  # whether something is drawn into the reflection buffer, which then has depth

    def draw_rays(self, camera: Camera, background: Asset | None = None) -> RayMapTarget:
        """background: an asset that is asked for the camera's own rays where no reflector is seen."""
        if self.rays is None or (self.rays.width, self.rays.height) != (camera.width, camera.height):
            self.rays = RayMapTarget(camera.width, camera.height, self._counts)
            self._targets = {}
        self.view.set(camera)
        self._scene.raymap.draw(self.view, self.rays, self._gpu, self.batch if background is not None else None)
        return self.rays

    def draw_coarse_rays(self, camera: Camera, step: int) -> RayMapTarget:
        """Of every step-th pixel along each side, into a target of its own."""
        width, height = -(-camera.width // step), -(-camera.height // step)
        whole = replace(camera.part(0, 0, step * width, step * height), width=width, height=height)
        target = RayMapTarget(width, height, self._counts)
        self.view.set(whole)
        self._scene.raymap.draw(self.view, target, self._gpu)
        return target

    def draw_answers(self, camera: Camera, positions: bool, background: Asset | None = None) -> ReflectionTarget:
        """To the rays that were drawn last, which must be this camera's."""
        if self._answers.draws != self._draws:
            self._draws, self._targets = self._answers.draws, {}
        beside = self.beside(positions)
        if beside not in self._targets:
            self._targets[beside] = ReflectionTarget(camera.width, camera.height, beside, self._counts, depth=self._draws)
        target = self._targets[beside]
        self.plan(camera)
        self._answers.draw(Seen(camera, self.rays, target), background)
        return target

    def plan(self, camera: Camera):
        """Makes the mirrored views and cube maps that are due for a frame."""
        self._answers.plan(camera, self._scene.resolve, self._scene.attenuation is not None)

    def beside(self, positions: bool) -> str | None:
        """What the reflection buffer holds beside radiance: attenuation needs no more than a distance."""
        return "position" if positions else "distance" if self._scene.attenuation is not None else None

    @contextmanager
    def footprints(self, wanted: bool) -> Iterator[None]:
        """Whether pixels' rays have any."""
        views = self.view, self._answers.levels.view
        try:
            for view in views:
                view.has_footprints = wanted
            yield
        finally:
            for view in views:
                view.has_footprints = True

    def bytes(self) -> int:
        return sum(t.bytes for t in (self.rays, *self._targets.values()) if t is not None)

    def free(self):
        self.rays, self._targets = None, {}
