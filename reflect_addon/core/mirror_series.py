"""Mirrors that show each other beyond the last level: their rays go on through pictures that are already drawn.

Problem. Two mirrors that face each other show an endless row of rooms; views are drawn for some of them [nielsen-2002 3.1], and what answers beyond shows
where they end. Every further view costs a picture, however few pixels it has.
Idea. The mirrors at the end of a branch are those of its own views: each was looked through before, nearer to the eye. A view's picture holds the place
of all that its mirror sees, so a ray that leaves that mirror once more is followed through the picture as the rays of rough mirrors are
(mirror_march.py): it starts at the mirror's own surface, and only its direction is another than the eye's image had. Where it meets a mirror of
the branch it is reflected, loses what the mirror does not reflect, and goes on in that mirror's picture: a series of legs, each exact but for the
pixels it is read from. So no picture is added, the work is a few legs for each pixel of the last level that shows a mirror, and it does not depend
on frames before.
The series ends where something is met that is no mirror, where less than LEAST is left of it, and after LEGS, of which few pixels see the end.
Where we depart: the sum of a geometric series would serve two parallel mirrors only, and with an empty room between them.
Limits. Mirrors that are not in the branch, curved or rough ones, and what no picture of the branch sees are left to distance maps, a leg later than
they were. Pixels are not blended: far down, single ones stand for more than they show, without noise as long as the camera rests.
"""

from collections.abc import Sequence

import numpy as np

from . import mirror_march
from .camera import Camera
from .curved_views import CurvedMirror
from .glass_shapes import Pane
from .mirror_planes import MirrorPlane
from .reflection_tree import ROOT, Ended, Tree

# Pictures that a series may go through: of as many mirrors of the branch, the deepest first.
PICTURES = 3
# Legs of a ray, and what must be left of its light for another one.
LEGS, LEAST = 32, 1e-3
# Of each picture: rows of clip coordinates in px, relative to the eye; the eye, w the pixels' footprint; the way it looks; the window's low and
# high px; the plane, w how far from it a point of the mirror may be; its normal.
ROWS = ("row_x", "row_y", "row_w", "eye", "forward", "window", "plane_origin", "plane_normal")

INPUTS = {"picture": "float", **mirror_march.INPUTS}
IMAGES = tuple(name.replace("_tx", f"{i}_tx") for i in range(PICTURES) for name in mirror_march.IMAGES)


def march(k, scope, picture, **inputs):
    """mirror_march.march through one of the pictures, by its index: three fetches for one, and a third of the code."""

    def texel(name, at):
        first, *others = (k.fetch(scope.images[name.replace("_tx", f"{i}_tx")], at) for i in range(PICTURES))
        for i, other in enumerate(others, 1):
            first = k.select(picture > i - 0.5, other, first)
        return first

    return mirror_march.march(k, scope, **inputs, texel=texel)


def branch(tree: Tree, node: int, mirrors: Sequence[MirrorPlane | CurvedMirror]) -> dict[int, int]:
    """Sharp planar mirror -> its view nearest to `node` on the way from there to the eye, `node` first; PICTURES at most."""
    found: dict[int, int] = {}
    while node != ROOT and len(found) < PICTURES:
        index = tree.nodes[node].mirror
        mirror = mirrors[index]
        if index not in found and isinstance(mirror, MirrorPlane) and not isinstance(mirror, Pane) and mirror.roughness[1] == 0:
            found[index] = node
        node = tree.nodes[node].parent
    return found


def continued(tree: Tree, node: int, found: dict[int, int]) -> list[Ended]:
    """The mirrors that `node` sees without a view of their own, and that have one in the branch."""
    return [ended for ended in tree.ended if ended.parent == node and ended.mirror in found]


def rows_of(camera: Camera, plane: MirrorPlane, window: tuple[int, int, int, int], within: float) -> np.ndarray:
    """(len(ROWS), 4) float32 of one picture. camera: of its target; window: x, y, width, height px that were drawn; within: m from the plane."""
    eye, turn = camera.world_from_camera[:3, 3], np.eye(4)
    turn[:3, :3] = camera.world_from_camera[:3, :3].T
    clip = camera.clip_from_camera @ turn
    footprint = 2.0 / (abs(camera.clip_from_camera[1, 1]) * camera.height)
    x, y, width, height = window
    return np.array(
        [
            0.5 * camera.width * (clip[0] + clip[3]), 0.5 * camera.height * (clip[1] + clip[3]), clip[3], [*eye, footprint],
            [*-camera.world_from_camera[:3, 2], 0.0], [x, y, x + width, y + height], [*plane.origin, within], [*plane.normal, 0.0],
        ],
        np.float32,
    )  # fmt: skip
