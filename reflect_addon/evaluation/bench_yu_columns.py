"""`columns` while its ball moves: what a light field shows against Cycles, frame by frame, without another bake.

A frame's rays are those of the ray map of the scene's own camera, their truth is traced; `environment` is baked again at every
frame, where the ball then is.
"""

from dataclasses import dataclass, replace
from functools import partial

import bpy
import numpy as np

from ..core import light_field_stored, metrics
from ..core.asset import Asset
from ..core.job import BakeJob
from ..core.kernel import record, run_numpy
from ..core.lamp_hits import with_lamps
from ..core.light_field import SLABS, cell_of
from ..core.look import Look
from ..core.methods import environment, light_field
from ..core.rays import Answer, Hits, Rays
from ..core.snapshot import SceneSnapshot
from ..core.spaces import cube_coordinates
from ..scene.camera import camera_of
from ..scene.intersect import intersector
from ..scene.raytrace import trace
from .backends import GpuBackend
from .flicker import flicker as of_frames
from .frame import open_frame
from .truth import lifted

SCAN = 50  # planes, evenly in 1 / z from the sky to the nearest of NEAREST percent of what views see
NEAREST = 99.0


@dataclass(frozen=True)
class Frame:
    """One frame's rays and what is true of them."""

    snapshot: SceneSnapshot
    mask: np.ndarray  # (H, W) bool: pixels that show the reflector
    rays: Rays  # of these pixels
    truths: tuple[Hits, ...]  # that differ in their noise

    def rmse(self, asset: Asset) -> float:
        return metrics.rmse(answer(asset, self.rays).radiance, self.truths[0].radiance)


def frame_of(scene: bpy.types.Scene, number: int, size: tuple[int, int], samples: int, truths: int = 1) -> Frame:
    """samples: Cycles' paths a ray of each truth."""
    with open_frame(scene, number) as snapshot:
        seen = GpuBackend.ray_map(snapshot, camera_of(scene, None, *size))
        rays, intersect = lifted(seen, snapshot.diagonal()), intersector(snapshot)
        hits = [trace(rays, samples=samples, seed=seed, scene=scene) for seed in range(1, truths + 1)]
        found = tuple(with_lamps(h, rays, snapshot, intersect) for h in hits)
        return Frame(snapshot, seen.covered(), Rays(seen.origin[seen.covered()], rays.direction), found)


def environment_at(scene: bpy.types.Scene, number: int, **settings) -> Asset:
    """`environment` of the scene's only reflector, baked where it is at this frame."""
    with open_frame(scene, number) as snapshot:
        (reflector,) = snapshot.reflectors()
        asked = {**environment.DEFAULTS, **settings}
        return environment.bake(BakeJob(snapshot, reflector, partial(trace, scene=scene), intersector(snapshot), asked))


def answer(asset: Asset, rays: Rays) -> Answer:
    """The method's answer to single rays, in NumPy."""
    method = light_field if asset.kind == light_field.NAME else environment
    return run_numpy(record(method.trace, asset), asset, rays)


def with_depth(asset: Asset, depth: bool) -> Asset:
    """The same slabs with each view's depths, or with one focal plane for all."""
    return replace(asset, options={**asset.options, "depth": depth})


def compressed(asset: Asset) -> Asset:
    """The same slabs as a bake with the setting `compressed` stores them."""
    images, code = light_field_stored.compressed(cell_of(asset), asset.images["light_field_tx"], asset.options["depth"])
    return replace(asset, images=images, uniforms={**asset.uniforms, **code}, options={**asset.options, "coded": True})


def with_planes(asset: Asset, q) -> Asset:
    """The same slabs with other focal planes, (6,) 1/m by face or one for all."""
    planes = np.broadcast_to(np.asarray(q, float), SLABS)
    return replace(asset, uniforms={**asset.uniforms, "focus": tuple(planes[0::2]), "focus_back": tuple(planes[1::2])})


def planes_of(asset: Asset) -> np.ndarray:
    """(6,) 1/m by face."""
    return np.stack([asset.uniforms["focus"], asset.uniforms["focus_back"]], -1).ravel()


@dataclass(frozen=True)
class Scan:
    """Square errors summed over each slab's own rays, (SLABS,)."""

    planes: np.ndarray  # (SCAN,) 1/m
    errors: np.ndarray  # (SCAN, SLABS)
    automatic: np.ndarray  # with the planes that the bake found
    sky: np.ndarray  # with all at the sky: no disparity

    def over_best(self) -> float:
        """RMSE over that of the best plane of each slab."""
        return float(np.sqrt(self.automatic.sum() / self.errors.min(0).sum()))

    def over_one(self) -> float:
        """RMSE over that of the best plane for all slabs together."""
        return float(np.sqrt(self.automatic.sum() / self.errors.sum(1).min()))

    def over_sky(self) -> float:
        return float(np.sqrt(self.automatic.sum() / self.sky.sum()))

    def shares(self) -> np.ndarray:
        """(SLABS,) of the square error, at the best planes."""
        best = self.errors.min(0)
        return best / best.sum()

    def by_slab(self) -> np.ndarray:
        """(SLABS,) RMSE over that of the slab's best plane; 1 for a slab that no ray goes to."""
        best = self.errors.min(0)
        return np.sqrt(np.where(best > 0, self.automatic / np.maximum(best, 1e-30), 1.0))


def scan(asset: Asset, frames: list[Frame], count: int = SCAN) -> Scan:
    """One focal plane after the other over the rays of some frames; the asset's own for comparison."""
    plain, cell = with_depth(asset, False), cell_of(asset)
    rays = Rays(*(np.concatenate([getattr(f.rays, part) for f in frames]) for part in ("origin", "direction")))
    truth = np.concatenate([f.truths[0].radiance for f in frames])
    slab = cube_coordinates(rays.direction * cell.weight)[0]

    def errors(planes) -> np.ndarray:
        off = np.square(answer(with_planes(plain, planes), rays).radiance - truth).sum(-1)
        return np.bincount(slab, off, SLABS)

    seen = plain.images["light_field_tx"][::4, ::4, 3].astype(np.float32)
    planes = np.linspace(0.0, float(np.percentile(seen[seen > 0], NEAREST)) / cell.size(), count)
    return Scan(planes, np.array([errors(p) for p in planes]), errors(planes_of(plain)), errors(0.0))


def flicker(asset: Asset, frames: list[Frame], look: Look) -> tuple[float, float]:
    """flicker.py's, of frames with two truths each."""
    shown = [[answer(asset, f.rays).radiance, *(t.radiance for t in f.truths)] for f in frames]
    return of_frames([f.mask for f in frames], shown, look)
