"""`environment`: the environment map, the baseline that every other method is measured against.

Problem. A reflected ray must be answered at the cost of one look-up.
Idea. The reflected scene is infinitely far away, so only the ray's direction counts [BN76; popescu-2006 section 1].
The map is a cube traced from one point, the reflector's centre unless another is given, with the reflector itself
hidden.
Limits. No parallax and no contact: what is near the reflector appears too deep inside it. Exact for the sky.
Hit points: the position shown is that of the surface which the texel was captured from, so its error is the very
parallax error that the method makes.
"""

import numpy as np

from .. import cubemap, spaces
from ..asset import Asset
from ..kernel import Hit
from .job import BakeJob

NAME = "environment"
LABEL = "Environment Map"
REQUIRES = ()
DEFAULTS = {"resolution": 256, "samples": 16}


def bake(job: BakeJob) -> Asset:
    """A cube map of `resolution` texels along a face's edge from settings["center"] or the reflector's centre."""
    return capture(job, NAME, hide=(job.reflector.object_name,))


def capture(job: BakeJob, kind: str, hide: tuple[str, ...]) -> Asset:
    """The cube-map part of an asset: image, scales and the centre it was traced from."""
    n = int(job.settings["resolution"])
    cubemap.check_resolution(n)
    center = np.asarray(job.settings.get("center") or job.center(), np.float64)
    hits = job.trace(cubemap.bundle(center, n), hide=hide, samples=int(job.settings["samples"]))
    image, uniforms = cubemap.assemble(center, n, hits)
    return Asset(
        kind=kind,
        reflector=job.reflector.name,
        images={"radiance_tx": image},
        uniforms={**uniforms, "center": tuple(map(float, center))},
        settings=dict(job.settings),
    )


def trace(k, asset, ray) -> Hit:
    """Answer by direction alone."""
    k.cite("popescu-2006 3.1 step 3: EM(r)")
    return answer(k, asset, ray.direction, ray.spread, spaces.STATUS_HIT)


def answer(k, asset, direction, angle, status) -> Hit:
    """Kernel shared by every method that ends in the cube map: what it shows along `direction` from its centre."""
    radiance, distance = cubemap.look_up(k, asset, direction, angle)
    position = asset.uniforms["center"] + k.normalize(direction) * distance
    return Hit(radiance=radiance, position=position, coverage=1.0, status=status)
