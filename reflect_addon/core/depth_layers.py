"""The layers of a scene as seen from one point: what lies behind what [Everitt 2001; GPU Gems 3, 17.2.1].

Problem. A map holds what its centre sees; a ray that starts beside the centre sees behind things.
Idea. Along each texel's direction the first surface is layer 0, what lies behind it layer 1, and so on. Rays find them:
each layer is traced from just behind the one before. Objects' far sides are surfaces like others.
Where we depart. A rasteriser shades a far side by its own normal. A path along the ray would meet it from inside, where
it is dark, so it is asked for its radiance from beyond, looking back at the centre. Which side shows is told by parity:
the side that the centre is on, and each surface of an object that the ray passes changes sides.
Limits. A sheet that a ray meets twice shows its other side the second time. Copies of one object (duplis) that stand in
each other count as one.
"""

from dataclasses import dataclass

import numpy as np

from .job import BakeJob
from .lamp_hits import with_lamps
from .rays import Rays

# The next layer is looked for this share of the scene's diagonal behind a surface: thinner things have one layer ...
STEP = 2e-5
# ... or this share of the largest coordinate, above float32's rounding.
STEP_ROUNDING = 8 * 2.0**-23


@dataclass(frozen=True)
class Layer:
    """What one layer's rays met, in the bundle's order."""

    radiance: np.ndarray  # (N, 3) float32; 0 where the layer has no surface
    position: np.ndarray  # (N, 3) float64, world, m; 0 where the layer has no surface
    hit: np.ndarray  # (N,) bool


def layers_behind(job: BakeJob, rays: Rays, count: int, hide: tuple[str, ...], samples: int) -> list[Layer]:
    """The layers behind what the rays meet first: at most `count`, each with a surface on at least one ray."""
    found: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []  # (rays, positions, shown from the centre's side)
    alive = np.arange(len(rays))
    origin, direction = rays.origin, rays.direction.astype(np.float64)
    passed: dict[str, np.ndarray] = {}  # object -> of each ray, whether it is on the other side of the object's surface
    for depth in range(count + 1):
        bundle = Rays(origin, rays.direction[alive])
        hits = with_lamps(job.trace(bundle, hide=hide, samples=1), bundle, job.scene, job.intersect, hide)
        alive, position, owner = alive[hits.hit], hits.position[hits.hit].astype(np.float64), hits.object[hits.hit]
        if not len(alive):
            break
        near_side = np.ones(len(alive), bool)
        for index in np.unique(owner[owner >= 0]):
            beyond = passed.setdefault(hits.object_names[index], np.zeros(len(rays), bool))
            own = owner == index
            near_side[own] = ~beyond[alive[own]]
            beyond[alive[own]] ^= True
        if depth:
            found.append((alive, position, near_side))
        origin = (position + direction[alive] * _step(job, position)).astype(np.float32)
    return _with_radiance(job, rays, found, hide, samples)


def _with_radiance(job, rays: Rays, found, hide, samples: int) -> list[Layer]:
    """The layers, their radiance traced as one bundle from just before the side that shows."""
    if not found:
        return []
    starts, along = [], []
    for alive, position, near_side in found:
        direction = rays.direction[alive] * np.where(near_side, 1.0, -1.0)[:, None]
        starts.append(position - direction * _step(job, position))
        along.append(direction)
    bundle = Rays(np.concatenate(starts).astype(np.float32), np.concatenate(along).astype(np.float32))
    shown = job.trace(bundle, hide=hide, samples=samples)
    layers, at = [], 0
    for alive, position, _ in found:
        layer = Layer(np.zeros((len(rays), 3), np.float32), np.zeros((len(rays), 3)), np.zeros(len(rays), bool))
        layer.radiance[alive] = shown.radiance[at : at + len(alive)]
        layer.position[alive], layer.hit[alive] = position, True
        layers.append(layer)
        at += len(alive)
    return layers


def _step(job: BakeJob, position: np.ndarray) -> np.ndarray:
    """(N, 1) how far, in m, rays start from a surface."""
    return np.maximum(STEP * job.scene.diagonal(), STEP_ROUNDING * np.abs(position).max(-1, keepdims=True))
