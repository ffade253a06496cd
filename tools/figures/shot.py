"""One scene from one camera: its mirrored rays, what Cycles says of them, and what any method with any settings shows.

Both sides answer single rays (evaluation/truth.py) and are put into the same Cycles frame with the same reflectance, so
that a difference is the reflection's. `filtered` asks the method with the pixel's footprint, as the viewport does.
Bakes share what they trace: of two settings that differ in how a depth map is simplified, only the first one asks Cycles.
"""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import bpy
import numpy as np

from reflect_addon.core import methods, metrics, shading
from reflect_addon.core import settings as words
from reflect_addon.core.asset import Asset, asset_of
from reflect_addon.core.kernel import Hit, evaluate, record_function
from reflect_addon.core.lamp_hits import with_lamps
from reflect_addon.core.rays import Answer, Hits, Rays
from reflect_addon.core.snapshot import SceneSnapshot
from reflect_addon.evaluation import eye
from reflect_addon.evaluation.backends import GpuBackend
from reflect_addon.evaluation.maps import difference_map
from reflect_addon.evaluation.truth import SEEDS, lifted
from reflect_addon.gpu.fill import trace_rays
from reflect_addon.gpu.renderer import Renderer
from reflect_addon.scene.bake import bake_assets
from reflect_addon.scene.load import load_assets
from reflect_addon.scene.camera import camera_of
from reflect_addon.scene.intersect import intersector
from reflect_addon.scene.look import read_look
from reflect_addon.scene.raytrace import primary, trace

from .sheet import short

WHITE = Asset(kind="white", reflector="", images={}, uniforms={}, options={}, settings={}, requires=())
# Rays of one pixel's side whose mean is the frame that a picture with footprints is judged by.
FINE = 4


def white(k, asset, ray) -> Hit:
    """A kernel that mirrors 1 everywhere: what resolve makes of it is the reflectance."""
    return Hit(radiance=k.vec3(1.0), position=ray.origin, coverage=1.0, status=1.0)


@dataclass(frozen=True)
class Scores:
    """Of an answer against the truth; None where nothing can be judged."""

    flip: float | None
    median: float | None  # relative difference of radiance
    relmse: float | None
    hit_p50: float | None  # over the scene's diagonal
    hit_p95: float | None
    wrong: float | None  # share of rays: missed and false hits

    def words(self) -> str:
        hit = "no hit points" if self.hit_p95 is None else f"hit p95 {short(self.hit_p95)}"
        return f"FLIP {short(self.flip)}, {hit}"


class Shot:
    """scene: the open file's. Only valid while evaluation.frame.open_frame of it is."""

    def __init__(self, scene: bpy.types.Scene, snapshot: SceneSnapshot, size, samples: int, texels: int, folder: Path):
        self.scene, self.snapshot, self.samples, self.texels, self.folder = scene, snapshot, samples, texels, folder
        self.camera = camera_of(scene, None, *size)
        self.ray_map = GpuBackend.ray_map(snapshot, self.camera)
        self.mask = self.ray_map.covered()
        self.rays = self.ray_map.rays()
        self.look = read_look(scene)
        self.diagonal = snapshot.diagonal()
        self._traced: dict[bytes, Hits] = {}

    # What Cycles says.

    @cached_property
    def truth(self) -> Hits:
        """Of the covered pixels' rays."""
        rays = lifted(self.ray_map, self.diagonal)
        hits = trace(rays, samples=self.samples, seed=SEEDS[0], scene=self.scene)
        return with_lamps(hits, rays, self.snapshot, intersector(self.snapshot))

    @cached_property
    def frame(self):
        """What the camera sees, one ray a pixel (scene.raytrace.Primary); what is around the mirrors is all pictures' alike."""
        return primary(self.camera, samples=max(self.samples // 2, 1), seed=SEEDS[0], scene=self.scene)

    @cached_property
    def fine_frame(self) -> tuple[np.ndarray, np.ndarray]:
        """((H, W, 3) display-encoded: the mean of FINE x FINE rays a pixel, (H, W) bool: all of them meet a reflector)."""
        w, h = self.camera.width, self.camera.height
        seen = primary(
            camera_of(self.scene, None, w * FINE, h * FINE), max(self.samples // 8, 1), seed=1, scene=self.scene
        )
        wanted = {i.object_name for i in self.snapshot.reflectors()}
        mirrors = np.isin(seen.object, [i for i, name in enumerate(seen.object_names) if name in wanted])
        blocks = seen.combined.reshape(h, FINE, w, FINE, 3).mean((1, 3))
        return self.look.apply(blocks), mirrors.reshape(h, FINE, w, FINE).all((1, 3)) & self.mask

    # What a method says.

    def assets(self, method: str, **settings) -> dict[str, Asset]:
        """Reflector -> asset of the method, baked with these settings over its defaults, none finer than `texels`."""
        asked = {**methods.get(method).DEFAULTS, **settings}
        sides = {name for name in asked if words.of(methods.get(method), name).power_of_two}
        asked |= {name: min(asked[name], self.texels) for name in sides}
        asked = {name: value for name, value in asked.items() if name in settings or name in sides}
        place = self.folder / "-".join(f"{name}={value}" for name, value in sorted(asked.items()))
        bake_assets(self.snapshot, (method,), place, settings=asked, tracer=self._trace)
        return load_assets(self.snapshot, method, place)

    def answer(self, assets: dict[str, Asset], kernel=None, filtered: bool = False) -> Answer:
        """For the covered pixels in row order. kernel: another one than the method's own."""
        owner = self.ray_map.reflector[self.mask]
        out = Answer(*(np.zeros((len(self.rays), *s), np.float32) for s in ((3,), (), (3,), ())))
        for index, instance in enumerate(self.snapshot.reflectors()):
            chosen = owner == index
            if not chosen.any():
                continue
            asset = asset_of(assets, instance)
            footprint = (self.ray_map.width[self.mask][chosen], self.ray_map.spread[self.mask][chosen])
            part = trace_rays(
                asset, kernel or methods.get(asset.kind).trace, Rays(self.rays.origin[chosen], self.rays.direction[chosen]),
                *(footprint if filtered else (0.0, 0.0)),
            )  # fmt: skip
            for name in ("radiance", "coverage", "position", "status"):
                getattr(out, name)[chosen] = getattr(part, name)
        return out

    def _trace(self, rays, hide=(), samples=1, progress=None):
        key = np.float32(rays.origin).tobytes() + np.float32(rays.direction).tobytes() + repr((hide, samples)).encode()
        if key not in self._traced:
            self._traced[key] = trace(rays, hide, samples, scene=self.scene, progress=progress)
        return self._traced[key]

    # Pictures and numbers.

    @cached_property
    def reflectance(self) -> np.ndarray:
        """(N, 3) of the covered pixels, by the resolve pass itself."""
        names = {i.name: WHITE for i in self.snapshot.reflectors()}
        renderer = Renderer(self.snapshot, names, kernel=lambda _: white)
        found = renderer.picture(self.camera)[..., :3][self.mask]
        renderer.free()
        return found

    def picture(self, seen: Answer | Hits, fresnel: bool = True, half_distance: float | None = None) -> np.ndarray:
        """(H, W, 3) display-encoded, row 0 at the bottom: these reflections in Cycles' frame.

        fresnel False: perfect mirrors instead of the materials. half_distance: of the attenuation, m."""
        return self.look.apply(self.linear(seen, fresnel, half_distance))

    def linear(self, seen: Answer | Hits, fresnel: bool = True, half_distance: float | None = None) -> np.ndarray:
        """The same scene-linear."""
        share = self.reflectance if fresnel else np.ones_like(self.reflectance)
        if half_distance is not None:
            distance = np.linalg.norm(seen.position.astype(np.float64) - self.rays.origin, axis=-1)
            program = record_function(shading.attenuation, shading.ATTENUATION_INPUTS)
            inputs = {
                "distance": distance.astype(np.float32),
                "half_distance": np.full(len(distance), half_distance, np.float32),
            }
            share = share * evaluate(program, inputs)["attenuation"][:, None]
        out = self.frame.combined.copy()
        below = np.maximum(self.frame.combined - self.frame.glossy, 0)[self.mask] if fresnel else 0.0
        out[self.mask] = below + share * np.nan_to_num(seen.radiance, nan=0.0, posinf=0.0, neginf=0.0)
        return out

    def difference(
        self, picture: np.ndarray, truth: np.ndarray | None = None, mask: np.ndarray | None = None
    ) -> np.ndarray:
        """(H, W, 3) false colours (evaluation/maps.py). truth: the picture to compare with, that of the truth's rays else."""
        truth = self.picture(self.truth) if truth is None else truth
        return difference_map(picture, truth, self.mask if mask is None else mask)

    def scores(self, answer: Answer, picture: np.ndarray | None = None, truth: np.ndarray | None = None) -> Scores:
        picture = self.picture(answer) if picture is None else picture
        found = metrics.hit_errors(answer, self.truth, self.rays, self.diagonal)
        return Scores(
            eye.flip(picture, self.picture(self.truth) if truth is None else truth, self.mask)[0],
            metrics.median_relative(answer.radiance, self.truth.radiance),
            metrics.relmse(answer.radiance, self.truth.radiance),
            found.hit_p50, found.hit_p95, found.false_hit + found.missed_hit,
        )  # fmt: skip
