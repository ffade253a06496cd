"""Which mirror is drawn from which view, how large and where: the passes of nielsen-2002 as data, before anything is drawn.

DrawScene of Figs 4 to 6 calls itself for each reflector that it meets. The calls are a tree of views: grown by tree_growth.py, one for a frame
or several (reflection_passes.py), read by a renderer that knows no mirrors. A renderer goes through `children` from ROOT, draws a child into
the target of its level and uses it at once, so that one target a level is enough [3.1, Fig 3].
"""

from dataclasses import dataclass, field

from .camera import Camera
from .curved_views import CurvedMirror
from .mirror_outline import Polygon
from .mirror_planes import MirrorPlane

ROOT = -1
# Why a mirror that the pseudocode would draw is not drawn.
BEHIND, OUTSIDE, COVERED, SMALL, FAINT, DEPTH, MOST = REASONS = (
    "behind",  # the eye does not see the side that mirrors
    "outside",  # of the picture, or not before the parent's mirror
    "covered",  # not where the parent is seen
    "small",  # fewer pixels than least_pixels
    "faint",  # weight times share of the picture below least_energy
    "depth",  # seen, but too deep
    "most",  # seen, but enough were drawn
)  # fmt: skip


@dataclass(frozen=True)
class Culling:
    """Each can be switched off, so that its effect can be measured."""

    back_faces: bool = True
    frustum: bool = True  # mirrors outside of the picture
    window: bool = True  # mirrors outside of what is seen of their parent; where frustum is off this does its work too
    area: bool = True
    energy: bool = True
    scissor: bool = True  # a view draws only the pixels where its mirror is seen
    size: bool = True  # a curved mirror's one view is as large as the mirror is seen
    coarse_meshes: bool = True  # from the second level on surfaces have no more triangles than pixels show (coarse_surface.py)


NOTHING_CULLED = Culling(False, False, False, False, False, False, False, False)
BACK_FACES_ONLY = Culling(True, False, False, False, False, False, False, False)


@dataclass(frozen=True)
class TreeSettings:
    depth: int = 4  # reflections along a path; 0: none
    most: int = 64  # views of a tree
    least_pixels: float = 1.0  # px^2 of the camera's picture
    least_energy: float = 1e-4  # weight times share of the picture
    side: int = 256  # px of a curved mirror's one view, at most
    culling: Culling = field(default_factory=Culling)


@dataclass(frozen=True)
class Node:
    """One view to draw. A planar mirror's has the pixels of its parent's picture: pixel (x, y) of it is what is shown there; a rough one's may
    have `finer` x `finer` for each of them."""

    mirror: int  # into Tree.mirrors
    parent: int  # into Tree.nodes, ROOT for the camera's own picture
    depth: int  # 1: seen by the camera; its target is that of level depth - 1
    camera: Camera
    window: tuple[int, int, int, int]  # x, y, width, height, px of the parent's picture: where it is shown
    drawn: tuple[int, int, int, int]  # px of its own picture that need be drawn
    polygon: Polygon  # px of the parent's picture, what is seen of the mirror: exact, within window
    weight: float  # product of reflectances from the eye, this mirror's included
    share: float  # of the camera's picture
    path: tuple[int, ...]  # mirrors from the eye to this one: what a view is called from frame to frame
    finer: int = 1  # px of its picture along one of its parent's
    facing: bool = True  # False: from behind, drawn only as back faces are not culled; shows nothing

    @property
    def energy(self) -> float:
        return self.weight * self.share


@dataclass(frozen=True)
class Ended:
    """A mirror that is seen and not drawn."""

    mirror: int
    parent: int
    reason: str  # SMALL, FAINT, DEPTH or MOST
    window: tuple[int, int, int, int]  # px of the parent's picture
    energy: float


@dataclass(frozen=True)
class Tree:
    root: Camera
    mirrors: tuple[MirrorPlane | CurvedMirror, ...]
    nodes: tuple[Node, ...]  # depth first: a parent before its children, a branch before the next one
    children: dict[int, tuple[int, ...]]  # of each node and of ROOT, into nodes, by mirror
    culled: dict[str, int]  # reason -> mirrors, every one of them present
    ended: tuple[Ended, ...]

    @property
    def left_out(self) -> dict[str, float]:
        """Reason -> energy; what is not seen has none."""
        return {reason: sum(e.energy for e in self.ended if e.reason == reason) for reason in (SMALL, FAINT, DEPTH, MOST)}

    @property
    def pixels(self) -> int:
        """px drawn by all views."""
        return sum(node.drawn[2] * node.drawn[3] for node in self.nodes)

    @property
    def levels(self) -> int:
        """Targets that drawing needs: one for each depth [Fig 3]."""
        return len({node.depth for node in self.nodes})
