"""`sphere_proxy`: the environment lies on a sphere of finite size [Bjorke 2004; popescu-2006 section 2].

Problem. The environment map has no parallax.
Idea. Intersect the ray with a sphere of about the room's size around the map's centre, and look the map up in the
direction of that point. The radius is the solid-angle-weighted median of the map's own distances, which halves the
mean absolute error of the distance compared with any bounding sphere.
Limits. Right only for round surroundings; a corner of a room bends. Rays that start outside the sphere and miss it
fall back to their direction.
"""

import numpy as np

from .. import cubemap, spaces
from ..asset import Asset
from ..job import BakeJob
from ..kernel import Hit
from ..outlines import Outlines, of_center, of_sphere
from ..scene_items import geometry as inputs  # noqa: F401  distances are read, and no light
from ..weighted import weighted_median
from . import environment

NAME = "sphere_proxy"
LABEL = "Sphere Proxy"
REQUIRES = ("environment",)
BAKE_EFFORT = 0.1
READS_REQUIRED = True
DEFAULTS = {}


def bake(job: BakeJob) -> Asset:
    """The radius only; the cube map is the environment's."""
    radius = fit_radius(job.required[environment.NAME])
    uniforms = {"sphere_radius": radius}
    return Asset(NAME, job.reflector.name, {}, uniforms, settings=dict(job.settings), requires=REQUIRES)


def fit_radius(environment_asset: Asset) -> float:
    """Solid-angle-weighted median distance, m, of what the map sees; spaces.FAR under a bare sky."""
    points, weight = cubemap.surface_points(environment_asset.images["radiance_tx"], environment_asset.uniforms)
    if not len(points):
        return spaces.FAR
    distance = np.linalg.norm(points - environment_asset.uniforms["center"], axis=-1)
    return weighted_median(distance, weight)


def outlines(asset: Asset) -> Outlines:
    """The sphere, but for a bare sky."""
    radius = asset.uniforms["sphere_radius"]
    return of_center(asset) + (of_sphere(asset.uniforms["center"], radius) if radius < spaces.FAR else Outlines())


def trace(k, asset, ray) -> Hit:
    """The far intersection with the sphere; Bjorke 2004, eq. in "Localizing the environment"."""
    radius = asset.uniforms["sphere_radius"]
    # In units of the radius: squares of FAR would leave too few digits in float32.
    start = k.name("unit_start", (ray.origin - asset.uniforms["center"]) * (1.0 / radius))
    along = k.name("along", k.dot(start, ray.direction))
    # The point of the ray nearest to the centre: squares of `start` itself would cancel for far origins.
    nearest = k.name("nearest", start - ray.direction * along)
    discriminant = 1.0 - k.dot(nearest, nearest)
    distance = k.sqrt(k.max(discriminant, 0.0)) - along
    met = (discriminant >= 0.0) & (distance > 0.0)
    seen = k.select(met, start + ray.direction * distance, ray.direction)
    footprint = k.select(met, ray.width * (1.0 / radius) + ray.spread * distance, ray.spread)
    status = k.select(met, spaces.STATUS_HIT, spaces.STATUS_FELL_BACK)
    return environment.answer(k, asset, seen, footprint, status)
