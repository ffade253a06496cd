"""What "What it must show" is measured with: the product's own rays, assets and answers of one scene, and the truth."""

from collections.abc import Callable
from copy import deepcopy
from dataclasses import dataclass, replace
from functools import partial
from hashlib import sha256

import bpy
import numpy as np

from reflect_addon.core import metrics
from reflect_addon.core.lamp_hits import with_lamps
from reflect_addon.core.look import Look
from reflect_addon.core.rays import Answer, Hits, RayMap, Rays
from reflect_addon.evaluation import eye
from reflect_addon.evaluation.backends import GpuBackend
from reflect_addon.evaluation.frame import open_frame
from reflect_addon.evaluation.truth import lifted
from reflect_addon.scene.bake import bake_assets, chosen_reflectors
from reflect_addon.scene.camera import camera_of
from reflect_addon.scene.intersect import intersector
from reflect_addon.scene.load import load_assets
from reflect_addon.scene.look import read_look
from reflect_addon.scene.raytrace import trace


@dataclass(frozen=True)
class Measured:
    """The answers of some methods to one frame's rays, and what Cycles says of the same rays."""

    ray_map: RayMap
    rays: Rays
    truth: Hits
    answers: dict[str, Answer]
    look: Look
    diagonal: float

    def mask(self) -> np.ndarray:
        return self.ray_map.covered()

    def picture(self, radiance: np.ndarray) -> np.ndarray:
        """(H, W, 3) display-encoded: the reflector's pixels on black."""
        frame = np.zeros((*self.mask().shape, 3), np.float32)
        frame[self.mask()] = radiance
        return self.look.apply(frame)

    def flip(self, method: str, truth: np.ndarray | None = None) -> float:
        """truth: (N, 3) radiance of the rays, Cycles' when it is None."""
        truth = self.truth.radiance if truth is None else truth
        value, note = eye.flip(self.picture(self.answers[method].radiance), self.picture(truth), self.mask())
        assert value is not None, note
        return value

    def median_relative(self, method: str, truth: np.ndarray | None = None) -> float:
        truth = self.truth.radiance if truth is None else truth
        return metrics.median_relative(self.answers[method].radiance, truth)

    def rmse(self, method: str) -> float:
        return metrics.rmse(self.answers[method].radiance, self.truth.radiance)

    def hit_errors(self, method: str) -> metrics.HitErrors:
        return metrics.hit_errors(self.answers[method], self.truth, self.rays, self.diagonal)


class Remembered:
    """`trace` for tests that ask one scene the same questions again: those get the answer that was traced."""

    def __init__(self):
        self._answers: dict[tuple, Hits] = {}

    def __call__(self, rays: Rays, hide=(), samples: int = 1, *, scene, progress=None, **more) -> Hits:
        asked = tuple(sha256(np.ascontiguousarray(part)).digest() for part in (rays.origin, rays.direction))
        key = (*asked, frozenset(hide), samples, *sorted(more.items()))
        if key not in self._answers:
            self._answers[key] = trace(rays, hide, samples, scene=scene, progress=progress, **more)
        return deepcopy(self._answers[key])


def measure(
    methods: tuple[str, ...], folder, size=(128, 96), truth_samples: int = 1, settings: dict | None = None,
    reflectors: tuple[str, ...] = (), tracer: Callable[..., Hits] = trace,
) -> Measured:
    """Bakes, draws and traces the open file's scene as `evaluate` does. settings None: the methods' defaults; reflectors: those
    that are baked and whose rays are asked, all of them by default.

    What lies fresh in the folder from another call is not baked again."""
    scene = bpy.context.scene
    with open_frame(scene, None) as snapshot:
        camera = camera_of(scene, None, *size)
        ray_map = GpuBackend.ray_map(snapshot, camera)
        chosen = chosen_reflectors(snapshot, reflectors)
        names = [i.name for i in snapshot.reflectors()]
        asked = np.isin(ray_map.reflector, [names.index(i.name) for i in chosen])
        ray_map = replace(ray_map, reflector=np.where(asked, ray_map.reflector, -1))
        rays = lifted(ray_map, snapshot.diagonal())
        truth = tracer(rays, samples=truth_samples, seed=1, scene=scene)
        truth = with_lamps(truth, rays, snapshot, intersector(snapshot))
        look = read_look(scene)
        answers = {}
        bake_assets(snapshot, methods, folder, reflectors=reflectors, settings=settings, tracer=partial(tracer, scene=scene))
        for method in methods:
            assets = load_assets(snapshot, method, folder)
            assert set(assets) == {i.name for i in chosen}, f"{method} was not baked for every reflector"
            answers[method] = GpuBackend(snapshot, assets, look, camera, ray_map).answer()
        return Measured(ray_map, rays, truth, answers, look, snapshot.diagonal())
