"""What a bake may use: the scene as arrays, a tracer, an intersector and its settings. No bpy."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from .asset import Asset
from .rays import Hits
from .snapshot import Instance, SceneSnapshot
from .unfinished import Unfinished


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
    shared: dict = field(default_factory=dict)  # what bakes of one run have in common (flat billboards, a bare sky, which views a reflector needs)
    together: tuple[Instance, ...] = ()  # with the setting `shared`: all reflectors of the bake, which one asset is for
    # bounds(instance) -> (low, high), each (3,) float64 world, of its whole way over the scene's frames
    bounds: Callable[[Instance], tuple[np.ndarray, np.ndarray]] | None = None
    camera_bounds: Callable[[], tuple[np.ndarray, np.ndarray] | None] | None = None  # the same of the scene's camera
    earlier: Asset | None = None  # what an earlier bake made with these settings, of another state of the scene
    unfinished: Unfinished = field(default_factory=Unfinished)  # parts that outlast an interruption
    stage: Callable[[float, float, str], None] = lambda low, high, text: None  # which share of the bake trace() does next

    def reflectors(self) -> tuple[Instance, ...]:
        """Those that the asset is for."""
        return self.together or (self.reflector,)

    def way(self, instance: Instance) -> tuple[np.ndarray, np.ndarray]:
        """bounds(instance), or where nobody knows the frames, where it is now."""
        return self.bounds(instance) if self.bounds else self.scene.bounds([instance])

    def camera_way(self) -> tuple[np.ndarray, np.ndarray] | None:
        """camera_bounds(), or where nobody knows the frames, where the camera is now; None without a camera."""
        return self.camera_bounds() if self.camera_bounds else self.camera_now()

    def camera_now(self) -> tuple[np.ndarray, np.ndarray] | None:
        """(low, high), both where the scene's camera stands."""
        place = self.scene.camera
        return None if place is None else (np.array(place, float), np.array(place, float))

    def center(self) -> np.ndarray:
        """(3,) float64: centre of the reflector's bounding box, where its maps are captured from."""
        low, high = self.scene.bounds([self.reflector])
        return (low + high) / 2
