"""Rays, what they hit, and the ray map: the values that pass between capture, methods, truth and metrics."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Rays:
    """A bundle of world-space rays."""

    origin: np.ndarray  # (N, 3) float32, world, m
    direction: np.ndarray  # (N, 3) float32, world, unit length

    def __len__(self) -> int:
        return len(self.origin)


@dataclass(frozen=True)
class Hits:
    """The truth for a bundle of rays, from scene/raytrace.py."""

    radiance: np.ndarray  # (N, 3) float32, scene-linear Rec.709
    position: np.ndarray  # (N, 3) float32, world, m; origin + FAR * direction where nothing was hit
    normal: np.ndarray  # (N, 3) float32, world, unit; 0 where nothing was hit
    object: np.ndarray  # (N,) int32, index into object_names; -1 where nothing was hit
    hit: np.ndarray  # (N,) bool
    object_names: tuple[str, ...] = ()  # names of the original objects
    glossy: np.ndarray | None = None  # (N, 3) float32, the part of radiance that glossy lobes reflect, where it was asked for

    def part(self, rows) -> "Hits":
        """Some of them: rows is a slice, a mask or indices."""
        fields = (self.radiance, self.position, self.normal, self.object, self.hit)
        glossy = None if self.glossy is None else self.glossy[rows]
        return Hits(*(field[rows] for field in fields), self.object_names, glossy)


@dataclass(frozen=True)
class RayMap:
    """Per pixel the reflected ray of the reflector that is seen there (design, "One idea", step 1). Row 0 is the bottom."""

    origin: np.ndarray  # (H, W, 3) float32, world, m: the point on the reflector
    direction: np.ndarray  # (H, W, 3) float32, world, unit: mirror direction
    normal: np.ndarray  # (H, W, 3) float32, world, unit: shading normal, facing the viewer
    reflector: np.ndarray  # (H, W) int32, index into reflector_names; -1 = no reflector is seen here
    width: np.ndarray  # (H, W) float32, m: footprint of the pixel on the reflector
    spread: np.ndarray  # (H, W) float32: growth of the footprint per metre of travel
    reflector_names: tuple[str, ...] = ()

    def covered(self) -> np.ndarray:
        """(H, W) bool: pixels that have a ray."""
        return self.reflector >= 0

    def rays(self) -> Rays:
        """The rays of the covered pixels in row order."""
        mask = self.covered()
        return Rays(self.origin[mask], self.direction[mask])


@dataclass(frozen=True)
class Answer:
    """The reflection buffer: a method's answer per ray (or per pixel)."""

    radiance: np.ndarray  # (..., 3) float32, scene-linear
    coverage: np.ndarray  # (...,) float32 in [0, 1]
    position: np.ndarray  # (..., 3) float32, world, m: the point whose radiance is shown; origin + FAR * dir for the sky
    status: np.ndarray  # (...,) float32: spaces.STATUS_*
