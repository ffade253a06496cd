"""Planar mirrors of a scene."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class MirrorPlane:
    """One side of the coplanar mirror-like faces of a reflector."""

    reflector: int  # into SceneSnapshot.reflectors()
    origin: np.ndarray  # (3,) float64 world, m: on the plane, amid the outline
    normal: np.ndarray  # (3,) float64 world, unit, towards the side that mirrors
    outline: np.ndarray  # (K, 3) float64 world, m: convex hull of its faces, counter-clockwise as seen from the side that mirrors
    specular: float  # largest channel of its reflectance straight on, 0..1
    grazing: float = 1.0  # its reflectance at 90 degrees, >= specular
    roughness: tuple[float, float] = (0.0, 0.0)  # smallest and largest of its materials, Blender's
