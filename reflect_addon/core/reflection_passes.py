"""The passes of a frame by the two methods of nielsen-2002, as trees of views.

View-dependent [Fig 5]: one tree from the camera, curved mirrors in it by one approximate view each.
View-independent [Fig 6]: before the picture, six faces of a cube map for each curved mirror, each drawn with planar recursion one level down;
curved mirrors in any view show the maps that they have, so they are leaves. Fig 6 makes all of them in each frame; "in static environments"
(2.3) they are kept, and a frame without anything that moved makes none: `remade` says whose are made.
Maps are double buffered: a face may show the very mirror that it is drawn for, whose map must be whole then (3.2). So faces are drawn beside
the maps, and a map takes all six over at once, which the paper's table of memory does not count.
"""

from dataclasses import dataclass, replace

from .camera import Camera
from .curved_views import CurvedMirror, cube_views
from .mirror_planes import MirrorPlane
from .mirrored_view import far_of
from .reflection_tree import Tree, TreeSettings
from .tree_growth import grow


@dataclass(frozen=True)
class Face:
    """One face of a curved mirror's cube map: its tree's root is the face's camera, in which the mirror itself is hidden."""

    curved: int  # into the frame's curved mirrors
    face: int  # 0..5
    tree: Tree


@dataclass(frozen=True)
class Passes:
    """A frame: its faces are drawn first."""

    curved: tuple[CurvedMirror, ...]
    faces: tuple[Face, ...]
    main: Tree

    @property
    def planar(self) -> int:
        """Planar reflections generated."""
        return sum(isinstance(tree.mirrors[n.mirror], MirrorPlane) for tree in self.trees for n in tree.nodes)

    @property
    def pixels(self) -> int:
        """px drawn before and beside the picture itself."""
        return sum(tree.pixels for tree in self.trees) + sum(f.tree.root.width * f.tree.root.height for f in self.faces)

    @property
    def trees(self) -> tuple[Tree, ...]:
        return (*(face.tree for face in self.faces), self.main)


def view_dependent(
    camera: Camera, planes: tuple[MirrorPlane, ...], curved: tuple[CurvedMirror, ...], settings: TreeSettings, before: Tree | None = None
) -> Passes:
    """before: the last frame's tree, whose sizes are kept while they serve."""
    return Passes(curved, (), grow(camera, (*planes, *curved), settings, before=before))


def view_independent(
    camera: Camera,
    planes: tuple[MirrorPlane, ...],
    curved: tuple[CurvedMirror, ...],
    settings: TreeSettings,
    remade: dict[int, int],
    border: int = 0,
) -> Passes:
    """remade: the curved mirrors whose maps are made in this frame, in order, and the px of a face's side of each; border: px around a face.
    A map serves every view that may come, so its energy is that of a picture full of it."""
    faces = []
    for index, side in remade.items():
        # A face is small: a mirror of as many of the picture's pixels is as large a part of it.
        per_face = replace(settings, least_pixels=settings.least_pixels * side * side / (camera.width * camera.height))
        for face, view in enumerate(cube_views(curved[index], side, far_of(camera), border)):
            faces.append(Face(index, face, grow(view, planes, per_face, depth=1, weight=curved[index].mean)))
    return Passes(curved, tuple(faces), grow(camera, planes, settings))
