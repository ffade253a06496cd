"""What a mirrored view is drawn into: one set of targets a depth of recursion [nielsen-2002 3.1, Fig 3], and what of it a pass answers.

Targets are as large as what is seen of their level's mirrors (core/map_size.py): deep in a row of mirrors they are small. They grow at once, and
shrink or go only after PATIENCE frames without need of them, so that a camera's move seldom makes new ones.
"""

from dataclasses import dataclass

from ..core.camera import Camera
from ..core.map_size import targets_of
from ..core.reflection_tree import ROOT, Node
from .counts import Counts
from .targets import LevelTarget, RayMapTarget, ReflectionTarget

# Frames after which a target shrinks that need not be so large: a second or two of a camera that turns to and fro.
PATIENCE = 100


@dataclass(frozen=True)
class Seen:
    """What a camera sees of the reflectors, and where its answers go."""

    camera: Camera
    rays: RayMapTarget
    target: ReflectionTarget
    window: tuple[int, int, int, int] | None = None  # (x, y, width, height) px: nothing outside it is touched; None: all
    node: int = ROOT  # of the schedule; ROOT: the picture itself
    corner: tuple[int, int] = (0, 0)  # px of the schedule's picture where this one's pixel (0, 0) is


class Level:
    """The targets of one depth of recursion. beside: what stands in its reflection buffer beside radiance."""

    def __init__(self, size: tuple[int, int], beside: str | None, counts: Counts):
        self.size, self.beside, (width, height) = size, beside, size
        self.picture = LevelTarget(width, height, counts)
        self.rays = RayMapTarget(width, height, counts)
        self.answers = ReflectionTarget(width, height, beside, counts, depth=True)

    @property
    def bytes(self) -> int:
        return self.picture.bytes + self.rays.bytes + self.answers.bytes


class LevelTargets:
    """Of one renderer, by depth."""

    def __init__(self, counts: Counts):
        self._counts = counts
        self.by_depth: dict[int, Level] = {}
        self._whole = (0, 0)  # px of the picture that they were made for
        self._spare: dict[int, int] = {}  # by depth, frames in a row that needed no target as large

    def make_room(self, whole: tuple[int, int], nodes: tuple[Node, ...], beside: str | None, by_area: bool):
        """Targets that hold every one of these views. whole: px of the picture, which they have where sizes do not go by area."""
        if whole != self._whole:
            self.by_depth, self._whole, self._spare = {}, whole, {}
        held = {depth: level.size for depth, level in self.by_depth.items()}
        wanted = targets_of(nodes, whole, held, by_area)
        for depth in wanted.keys() | held.keys():
            size, before = wanted.get(depth, (0, 0)), held.get(depth, (0, 0))
            larger = max(size[0], before[0]), max(size[1], before[1])
            self._spare[depth] = self._spare.get(depth, 0) + 1 if size != larger else 0
            size = larger if self._spare[depth] <= PATIENCE else size
            if not any(size):
                del self.by_depth[depth]
            elif size != before or self.by_depth[depth].beside != beside:
                self.by_depth[depth] = Level(size, beside, self._counts)

    def __getitem__(self, depth: int) -> Level:
        return self.by_depth[depth]

    def bytes(self) -> int:
        """Memory on the GPU, one set a level."""
        return sum(level.bytes for level in self.by_depth.values())

    def free(self):
        self.by_depth = {}
