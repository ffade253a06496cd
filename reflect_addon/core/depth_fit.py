"""Depth maps of one object: the views that may be taken of it and what each would show [popescu-2006 sections 4 and 6]."""

from dataclasses import dataclass

import numpy as np

from .billboard_fit import FINEST, LEAST_TEXELS
from .depth_camera import DepthCamera
from .rays import Rays


@dataclass(frozen=True, eq=False)
class DepthView:
    """A depth map to be captured. The attributes that billboard_fit.Quad has mean the same here."""

    instance: str
    camera: DepthCamera
    own: bool = False  # of the reflector itself: rays start on its surface
    detail: int = 1  # times the texels that are asked for: what a reflector's rays meet of itself is near
    reach: float = float("inf")
    shared: bool = False
    has_relief: bool = False  # a ray meets the surface itself, not a plane before it

    def height(self, points: np.ndarray) -> np.ndarray:
        """(N,) zeros: how far the surface lies off what a ray meets."""
        return np.zeros(len(points))

    def size(self, texels: int) -> tuple[int, int]:
        return texels, texels

    def enough(self, most: int, viewers: tuple[np.ndarray, np.ndarray]) -> int:
        """Texels a side, a power of two, at most `most`: none seen under less than FINEST by anybody in the box of viewers."""
        camera = self.camera
        center = camera.eye + camera.forward * (camera.hither + camera.yon) / 2
        half = camera.texel(2)
        beside = np.maximum(np.maximum(viewers[0] - center, center - viewers[1]), 0)
        distance = np.linalg.norm(beside) - half
        wanted = self.detail * 2 * half / (FINEST * max(distance, 1e-9 * half))
        return int(min(most * self.detail, 2 ** np.ceil(np.log2(max(wanted, LEAST_TEXELS)))))

    def rays(self, texels: int) -> Rays:
        return self.camera.rays(texels)[0]

    def depth(self, distance: np.ndarray) -> np.ndarray:
        """(w, w) float32 q from distances (w * w,) or (w, w) along rays(w), inf = nothing: NaN there."""
        w = int(np.sqrt(distance.size))
        z = distance.ravel() * self.camera.rays(w)[1]
        q = np.where(np.isfinite(z), self.camera.normalised(np.where(np.isfinite(z), z, 1.0)), np.nan)
        return np.clip(q, 0.0, 1.0).astype(np.float32).reshape(w, w)
