"""How fine the surfaces that reflectors show need to be: as the reflectors see them.

Problem. A share of an object's own size is the wrong measure where it is looked at from a reflector: a chequered floor of
eight metres needs millimetres below a ball that stands on it and none behind the house, a screw on the wall needs nothing.
Idea. Lengths are angles as seen from the nearest reflector. Errors weigh by the solid angle that they cover, so the
edges that spend a given number of triangles best are those of one angle all over. No edge is split below `surface_angle`
radians, none is left that covers more than WIDEST of them, whatever the radiance says (smooth light over a whole wall stays
within the noise at any single point), and what faces away from all reflectors is left as it is.
The distance is to the reflector's bounding box and half of its middle side more: what a convex mirror shows of things near
it is small, as from a point in its middle, and what touches a mirror would need no end of triangles.
Limits. Boxes are seen through: what another thing hides is subdivided as if it were not. A mirror's parts do not count as
its own surroundings, however concave it is.
"""

import numpy as np

from .mirrors import mirror_of
from .snapshot import Instance, SceneSnapshot
from .surface_soup import Lengths, Soup, normals

# An edge is split whatever it shows when it covers more than this many times the finest angle.
WIDEST = 32
# An edge that covers less than this many times the finest angle is not looked at where its ends agree.
SURE = 4
# Of an object's size: where it touches a reflector nothing else ends the subdivision.
LEAST = 1 / 1024
# A mirror that reflects at least this share as a metal has no light of its own worth a subdivision.
BARE = 0.95


def lengths_of(
    scene: SceneSnapshot, instances: tuple[Instance, ...], angle: float
) -> Lengths:
    """What surface_refine.py asks: no edge that covers less is split, none between is looked at where its ends agree.

    angle: radians, of the shortest edges as seen from the nearest reflector. instances: the soup's owners."""
    reflectors = scene.reflectors()
    boxes = np.array([scene.bounds([r]) for r in reflectors]).reshape(-1, 2, 3)
    middle, half = boxes.mean(1), np.ptp(boxes, axis=1) / 2
    names = [r.name for r in reflectors]
    own = np.array([names.index(i.name) if i.name in names else -1 for i in instances], int)
    plain = np.array([_bare(scene, i) for i in instances], bool)
    size = np.array([np.ptp(scene.bounds([i]), axis=0).max() for i in instances])

    def lengths(soup: Soup) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        towards, corner = normals(soup), soup.points[soup.place[:, 0]]
        # How far the boxes reach to the seen side of each triangle's plane.
        above = towards @ middle.T + np.abs(towards) @ half.T - np.einsum("tx,tx->t", towards, corner)[:, None]
        shows = (above > 0) & (own[soup.owner][:, None] != np.arange(len(boxes)))
        nearest = np.full(len(towards), np.inf)
        for index in range(len(boxes)):
            beside = np.maximum(np.abs(soup.points - middle[index]) - half[index], 0)
            distance = np.sqrt(np.einsum("px,px->p", beside, beside)) + np.median(half[index])
            mine = np.flatnonzero(shows[:, index])
            nearest[mine] = np.minimum(nearest[mine], distance[soup.place[mine]].min(1))
        seen = np.isfinite(nearest)
        least = np.where(seen & ~plain[soup.owner], np.maximum(angle * nearest, LEAST * size[soup.owner]), np.inf)
        return least, SURE * least, WIDEST * least

    return lengths


def _bare(scene: SceneSnapshot, instance: Instance) -> bool:
    mirror = mirror_of(scene, instance)
    return mirror is not None and mirror.whole and mirror.material.metallic * mirror.material.specular_weight >= BARE
