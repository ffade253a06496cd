"""The ground's colour in the environment map [popescu-2006 3.2: "Whenever possible, the color texture of the billboard is
stored in the environment map"]: where it must be mended, and whether it is fine enough.

What stands on the ground and has a stand-in of its own is not in the map, but its shadow is, and the darkness under it.
Rays never reach what an object stands on; its flat stand-in uncovers it. So that part gets the radiance around it.
A texel of the map is as wide on the ground as the eye at E sees it; other points of the reflector may see it wider. Where
a quad of the ground near the reflector would be seen clearly finer, there is one.
"""

from dataclasses import replace

import numpy as np

from . import cubemap
from .billboard_capture import covered, fill_unseen
from .billboard_fit import FINEST, FLAT, Quad
from .ground_box import Ground
from .ground_fit import without
from .job import BakeJob
from .rays import Hits, Rays
from .reflected_samples import points_on

# A quad is worth its memory and its step of the loop where texels look this many times narrower, in the mean.
WORTH = 1.5
# Reflected rays that say so.
SAMPLES = 4000
# Widths of quads that are tried, in radii of the reflector.
WIDTHS = (2.0, 4.0, 8.0, 16.0)


def in_the_map(
    job: BakeJob, ground: Ground, quads: list[Quad], hidden: tuple[str, ...]
) -> tuple[list[Quad], tuple[str, ...]]:
    """(quads, hidden) of a bake whose ground is in the map: without the ground's, but with a finer one near the reflector
    where that pays."""
    quads, hidden = without(job, ground, quads, hidden)
    finer = finer_quad(job, ground, int(job.settings["resolution"]))
    return ([*quads, finer] if finer else quads), hidden


def mended(job: BakeJob, ground: Ground) -> BakeJob:
    """The job with a tracer that fills what other objects cover of the ground, in bundles of cube maps from its centre."""

    def trace(rays: Rays, hide=(), samples: int = 1) -> Hits:
        hits = job.trace(rays, hide=hide, samples=samples)
        side = np.sqrt(len(rays) / 6)
        if side != int(side) or not np.array_equal(rays.direction, cubemap.bundle(ground.center, int(side) - 2).direction):
            return hits  # probes of the sky
        at = ground.local(hits.position)
        on = hits.hit & (np.abs(at[:, 2] - ground.low[2]) <= FLAT * np.linalg.norm(at, axis=-1))
        on &= np.all((at[:, :2] > ground.low[:2]) & (at[:, :2] < ground.high), axis=1)
        hidden = np.zeros(len(rays), bool)
        hidden[on] = covered(job, square(ground, 1.0), hits.position[on].astype(np.float64))
        if not hidden.any():
            return hits
        texels = np.concatenate([hits.radiance, on[:, None]], 1).astype(np.float32).reshape(int(side), 6, int(side), 4)
        unseen = hidden.reshape(texels.shape[:3])
        for face in range(6):
            image = texels[:, face].copy()
            fill_unseen(image, ~unseen[:, face])
            texels[:, face] = image
        return replace(hits, radiance=np.ascontiguousarray(texels[..., :3]).reshape(-1, 3))

    return replace(job, trace=trace)


def finer_quad(job: BakeJob, ground: Ground, resolution: int) -> Quad | None:
    """A quad of the ground around the reflector, where rays see its texels finer than the map's, WORTH in the mean.

    Measured on rays from the reflector's surface in all directions that it faces: a texel of the map covers a square of
    the ground as large as its solid angle says, and neither counts as finer than FINEST."""
    if len(ground.members) != 1:
        return None  # the world's picture has no surface to trace, and a ground of many pieces would need many quads
    rng = np.random.default_rng(11)
    start, _, _, normal = points_on(job.scene, job.reflector, SAMPLES, rng)
    direction = rng.normal(size=start.shape)
    direction /= np.linalg.norm(direction, axis=-1, keepdims=True)
    direction *= np.where(np.einsum("nx,nx->n", direction, normal) < 0, -1.0, 1.0)[:, None]
    start, along = ground.local(start), direction @ ground.axes.T
    with np.errstate(divide="ignore", invalid="ignore"):
        travelled = (ground.low[2] - start[:, 2]) / along[:, 2]
        met = start + along * travelled[:, None]
    inside = (travelled > 0) & np.all((met[:, :2] > ground.low[:2]) & (met[:, :2] < ground.high), axis=1)
    if not inside.any():
        return None
    met, travelled, slant = met[inside], travelled[inside], -along[inside, 2]
    away = np.linalg.norm(met, axis=-1)
    in_map = (2.0 / resolution) * away * np.sqrt(away / -ground.low[2])
    to_angle = np.sqrt(slant) / travelled
    low, high = job.scene.bounds([job.reflector])
    radius = float(np.linalg.norm(high - low)) / 2
    texels = 2 ** int(np.log2(int(job.settings["texels"])))
    best, chosen = np.log(WORTH), None
    for width in WIDTHS:
        half = min(width * radius, float(np.abs(np.concatenate([ground.low[:2], ground.high])).min()))
        near = np.abs(met[:, :2]).max(1) <= half
        with_quad = np.where(near, 2 * half / texels, in_map)
        gain = np.log(np.maximum(in_map * to_angle, FINEST) / np.maximum(with_quad * to_angle, FINEST)).mean()
        if gain > best:
            best, chosen = gain, square(ground, half)
    return chosen


def square(ground: Ground, half: float) -> Quad:
    """A square of the ground around the point under the centre; the surface may be off the plane by FLAT."""
    at = ground.world(np.array([0.0, 0.0, ground.low[2]]))
    above = FLAT * 2 * half
    u, v, normal = (tuple(map(float, axis)) for axis in ground.axes)
    name = ground.members[0] if ground.members else ""
    return Quad(name, tuple(map(float, at)), u, v, normal, half, half, None, above, 2 * above, True)
