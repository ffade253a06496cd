"""`environment`: the environment map, the baseline that every other method is measured against.

Problem. A reflected ray must be answered at the cost of one look-up.
Idea. The reflected scene is infinitely far away, so only the ray's direction counts [BN76; popescu-2006 section 1].
The map is a cube traced from one point, the reflector's centre unless another is given, with the reflector itself
hidden (clear_center.py: beside what stands in the centre).
Limits. No parallax and no contact: what is near the reflector appears too deep inside it. Exact for the sky.
Under a bare sky the map is the whole answer, so there its resolution doubles until a look-up is as good as the eye asks
(`sky_error`): a noiseless sky takes one path a texel, and 512 texels so cost less than 256 with the default's 16.
Such a sky shows every reflector the same, so its finer maps are traced once in a run of bakes, whatever methods ask for them (BakeJob.shared).
Each reflector still traces the first map and the probes: they say that nothing stands in its way, and that it is the same sky.
Hit points: the position shown is that of the surface which the texel was captured from, so its error is the very
parallax error that the method makes. A lamp's texel shows the lamp, so there it is the lamp's (core/lamp_hits.py).
"""

from dataclasses import dataclass, field

import numpy as np

from .. import cubemap, spaces
from ..asset import Asset
from ..clear_center import clear_center
from ..job import BakeJob
from ..kernel import Hit, record, run_numpy
from ..lamp_hits import with_lamps
from ..metrics import median_relative
from ..outlines import of_center as outlines  # noqa: F401  the method's own (methods/__init__.py)
from ..rays import Rays

NAME = "environment"
LABEL = "Environment Map"
REQUIRES = ()
# sky_error: what the median relative error may be on the worst face of a map that sees nothing but the sky; 0 = any.
DEFAULTS = {"resolution": 256, "samples": 16, "sky_error": 0.0075}

# The finest map that sky_error leads to: 75 MB.
FINEST = 1024
# Random directions in which the error is measured: some 330 a face put the median within a twentieth of itself.
PROBES = 2000
# Two paths along one ray that differ by more than this share of the brightest radiance are noise, not rounding.
NOISE = 1e-5
# What a run of bakes knows of its bare sky in BakeJob.shared.
SKY = "bare sky"


@dataclass(frozen=True)
class _Sky:
    """The bare sky that one reflector's probes saw, and its maps finer than the first: 100 MB at most."""

    probed: np.ndarray  # (PROBES, 3) float32, radiance
    # texels along an edge -> (image, uniforms) of cubemap.assemble, the same from wherever the map is captured
    maps: dict[int, tuple[np.ndarray, dict[str, float]]] = field(default_factory=dict)


def bake(job: BakeJob) -> Asset:
    """A cube map of `resolution` texels along a face's edge from settings["center"] or the reflector's centre."""
    return capture(job, NAME, hide=(job.reflector.object_name,))


def capture(job: BakeJob, kind: str, hide: tuple[str, ...], center: np.ndarray | None = None) -> Asset:
    """The cube-map part of an asset: image, scales and the centre it was traced from. center: (3,), None = clear_center's."""
    n = int(job.settings["resolution"])
    cubemap.check_resolution(n)
    center = clear_center(job, hide) if center is None else center
    asset = None
    if job.settings["sky_error"] and _sees_nothing_else(job, hide):
        asset = _bare_sky(job, kind, center, n, hide)
    if asset is None:
        rays = cubemap.bundle(center, n)
        hits = job.trace(rays, hide=hide, samples=int(job.settings["samples"]))
        hits = with_lamps(hits, rays, job.scene, job.intersect, hide)
        asset = _asset(job, kind, center, *cubemap.assemble(center, n, hits))
    return asset


def _asset(job: BakeJob, kind: str, center: np.ndarray, image: np.ndarray, uniforms: dict[str, float]) -> Asset:
    return Asset(
        kind=kind,
        reflector=job.reflector.name,
        images={"radiance_tx": image},
        uniforms={**uniforms, "center": tuple(map(float, center))},
        settings=dict(job.settings),
    )


def _sees_nothing_else(job: BakeJob, hide: tuple[str, ...]) -> bool:
    others = (*job.scene.instances, *job.scene.lamps)
    return all(i.object_name in hide or not i.visible_glossy for i in others)


def _bare_sky(job: BakeJob, kind: str, center: np.ndarray, n: int, hide: tuple[str, ...]) -> Asset | None:
    """The map at the first resolution that meets sky_error; None where something else is seen or the sky has noise.

    What the snapshot does not know (hair, volumes) shows in the first bundle, which carries every probe twice.
    """
    direction = np.random.default_rng(5).normal(size=(PROBES, 3))
    direction = (direction / np.linalg.norm(direction, axis=-1, keepdims=True)).astype(np.float32)
    probes = Rays(np.broadcast_to(np.float32(center), direction.shape).copy(), direction)
    hits = job.trace(_joined(cubemap.bundle(center, n), probes, probes), hide=hide, samples=1)
    first, second = hits.radiance[-2 * PROBES : -PROBES], hits.radiance[-PROBES:]
    if hits.hit.any() or np.abs(first - second).max() > NOISE * np.abs(first).max():
        return None
    image, uniforms = cubemap.assemble(center, n, hits.part(slice(0, -2 * PROBES)))
    face = spaces.cube_coordinates(direction)[0]
    while True:
        asset = _asset(job, kind, center, image, uniforms)
        shown = run_numpy(record(trace, asset), asset, probes).radiance
        error = max(median_relative(shown[face == f], first[face == f]) or 0.0 for f in range(6))
        if error <= job.settings["sky_error"] or n >= FINEST:
            return asset
        # An interpolation's error falls with the square of the resolution.
        steps = np.ceil(np.log2(error / job.settings["sky_error"]) / 2)
        n = min(n * 2 ** int(max(steps, 1)), FINEST)
        image, uniforms = _finer(job, first, center, n, hide)


def _finer(job: BakeJob, probed: np.ndarray, center: np.ndarray, n: int, hide: tuple[str, ...]) -> tuple[np.ndarray, dict[str, float]]:
    """The map of n texels along an edge of the sky that was probed: the run's, where it has one of a sky that is the same to the bit."""
    sky = job.shared.get(SKY)
    if sky is None or not np.array_equal(sky.probed, probed):
        sky = job.shared[SKY] = _Sky(probed.copy())  # alone: `probed` is a view of all that was traced
    if n not in sky.maps:
        hits = job.trace(cubemap.bundle(center, n), hide=hide, samples=1)
        found = cubemap.assemble(center, n, hits)
        if hits.hit.any():
            return found  # something so thin that the first map missed it, and at its distance from here
        sky.maps[n] = found
    return sky.maps[n]


def _joined(*bundles: Rays) -> Rays:
    return Rays(*(np.concatenate([getattr(b, name) for b in bundles]) for name in ("origin", "direction")))


def trace(k, asset, ray) -> Hit:
    """Answer by direction alone."""
    k.cite("popescu-2006 3.1 step 3: EM(r)")
    return answer(k, asset, ray.direction, ray.spread, spaces.STATUS_HIT)


def answer(k, asset, direction, angle, status) -> Hit:
    """Kernel shared by every method that ends in the cube map: what it shows along `direction` from its centre."""
    radiance, distance = cubemap.look_up(k, asset, direction, angle)
    # A null direction shows the middle of the first face (cubemap.look_up), and so says where that is.
    towards = k.select(k.dot(direction, direction) > 0.0, k.normalize(direction), k.vec3(1.0, 0.0, 0.0))
    position = asset.uniforms["center"] + towards * distance
    return Hit(radiance=radiance, position=position, coverage=1.0, status=status)
