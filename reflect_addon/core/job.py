"""What a bake may use: the scene as arrays, a tracer, an intersector and its settings. No bpy."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from .asset import Asset
from .rays import Hits
from .snapshot import Instance, SceneSnapshot


@dataclass(frozen=True)
class BakeJob:
    """One method's bake for one reflector."""

    scene: SceneSnapshot
    reflector: Instance
    # trace(rays, hide=names of objects, samples=per ray): scene/raytrace.py; with glossy=True Hits.glossy is there too
    trace: Callable[..., Hits]
    # intersect(instance, rays) -> (N,) float64 distance to the instance's own triangles, inf = miss; with slots=(0, 2)
    # to those that show these of its materials only
    intersect: Callable[..., np.ndarray]
    settings: dict[str, object]
    required: dict[str, Asset] = field(default_factory=dict)  # kind -> asset of the same reflector (REQUIRES)
    shared: dict = field(default_factory=dict)  # what all reflectors of one bake have in common (flat billboards)

    def center(self) -> np.ndarray:
        """(3,) float64: centre of the reflector's bounding box, where its maps are captured from."""
        low, high = self.scene.bounds([self.reflector])
        return (low + high) / 2
