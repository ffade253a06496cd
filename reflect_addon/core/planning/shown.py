"""How far off what a stand-in shows is, and at what work: by its kernel, and, of a method that draws planar mirrors, by their mirrored views.

A mirrored view is the scene drawn from the eye's mirror image [nielsen-2002 3.1]: what a pixel of it shows is what the pixel's ray meets, so that rays
off a planar mirror have no error. It costs no look-ups but a second picture: its pixels, and the triangles of all that is drawn.
Limits. That error is geometry's and not measured: no kernel answers for what is drawn. Shading normals that are up to mirror_planes.BENT off their plane's count as the plane's. A view in a view counts as one more of the same size.
"""

from dataclasses import dataclass

import numpy as np

from .. import methods, surface_radiance
from ..asset import Asset
from ..kernel import Counts
from ..methods import recursive
from ..mirror_planes import MirrorPlane
from ..rays import Rays
from ..reflected_samples import LIFT, LIFT_ROUNDING
from ..snapshot import SceneSnapshot
from ..surface_asset import TRIANGLE_BYTES
from .errors import errors_of
from .samples import Sample, Seen

LOOK_UP = 4.0  # operations on a number that a fetched texel costs as much as
# Operations that a view's pixel and its triangle take as long as, where depth maps take 1,700 a ray (two mirrors and a ball, 0.2 and 1.8 megapixels, llvmpipe: 0.85 and 0.5 us).
PIXEL, TRIANGLE = 800.0, 500.0
_PLANES = "planar mirrors"  # in `shared`
REFINED = 20  # times as many triangles have surfaces as the meshes of a room
PICTURE = 1920 * 1080  # px
ANYWHERE = 0.05  # of the picture: a reflector of which no camera says how large it is seen


@dataclass(frozen=True)
class Views:
    """The planar mirrors of a reflector, and what drawing their views takes."""

    planes: tuple[MirrorPlane, ...]
    near: float  # m: rays start so near to their plane
    work: float  # operations of a ray
    bytes: int  # its part of what all views draw
    paths: float  # the same of the bake's

    def show(self, rays: Rays) -> np.ndarray:
        """(N,) bool: which rays start on one of the planes, on the side that mirrors."""
        found = np.zeros(len(rays), bool)
        for plane in self.planes:
            from_plane = rays.origin.astype(np.float64) - plane.origin
            off = np.maximum(self.near, 2 * LIFT_ROUNDING * np.abs(rays.origin).max(-1))
            on = (np.abs(from_plane @ plane.normal) <= off) & (rays.direction @ plane.normal > 0)
            for a, b in zip(plane.outline, np.roll(plane.outline, -1, axis=0), strict=True):
                inwards = np.cross(plane.normal, b - a)
                on &= (rays.origin - a) @ inwards >= -off * np.linalg.norm(inwards)
            found |= on
        return found


def mirrored_views(scene: SceneSnapshot, seen: Seen, shared: dict) -> Views | None:
    """None for a reflector that has no planar mirror. shared: BakeJob's, or another of one scene, which keeps the planes."""
    if _PLANES not in shared:
        shared[_PLANES] = [plane for plane in recursive.drawn_mirrors(scene)[0] if isinstance(plane, MirrorPlane)]
    planes, reflectors = shared[_PLANES], scene.reflectors()
    own = tuple(plane for plane in planes if reflectors[plane.reflector].name == seen.reflector.name)
    if not own:
        return None
    names = {reflectors[plane.reflector].object_name for plane in planes}
    truth, rays = seen.planned.truth, max(len(seen.planned.rays), 1)
    met = [np.count_nonzero(truth.hit & (truth.object == k)) / rays for k, name in enumerate(truth.object_names) if name in names]
    triangles = sum(len(scene.meshes[i.mesh].triangles) for i in scene.instances if i.visible_glossy)
    pixels = max(PICTURE * (seen.share if seen.by_cameras else ANYWHERE), 1.0)
    drawn = max(triangles, min(REFINED * triangles, int(recursive.SURFACES["surface_triangles"])))
    work = PIXEL * (1 + sum(met)) + TRIANGLE * drawn * (1 + np.count_nonzero(met)) / pixels
    mirrors, paths = len(names), 2 * surface_radiance.DEFAULTS["surface_paths"]  # for refining, and for calming
    return Views(own, 4 * LIFT * scene.diagonal(), float(work), TRIANGLE_BYTES * drawn // mirrors, paths / mirrors)


def shown(asset: Asset, sample: Sample, unit: str, views: Views | None) -> tuple[np.ndarray, float]:
    """(errors as errors_of's, operations of a ray). views: of its reflector, where the asset's method draws them."""
    errors, counts = errors_of(asset, sample, unit)
    if views is None or not draws(asset.kind):
        return errors, work_of(counts)
    drawn = views.show(sample.rays)
    share = float(drawn.mean()) if len(drawn) else 1.0
    return np.where(drawn, 0.0, errors), share * views.work + (1 - share) * work_of(counts)


def draws(method: str) -> bool:
    """Whether what a plan takes of it is drawn and not looked up."""
    return method not in methods.gathering()


def work_of(counts: Counts) -> float:
    """Operations a ray."""
    return counts.operations_per_ray + LOOK_UP * counts.fetches_per_ray
