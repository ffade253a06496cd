"""What a mirrored view is drawn into: one set of targets a depth of recursion [nielsen-2002 3.1, Fig 3], and what of it a pass answers.

Targets are as large as the widest view of their depth, in steps, and never shrink: deep in a row of mirrors they are small, and a camera's
move seldom makes new ones.
"""

from dataclasses import dataclass

import numpy as np

from ..core.camera import Camera
from ..core.reflection_tree import ROOT, Node
from .counts import Counts
from .targets import LevelTarget, RayMapTarget, ReflectionTarget

# Sizes that a target's side may have.
SIDES = 8


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
        self.bytes = self.picture.bytes + self.rays.bytes + self.answers.bytes


class LevelTargets:
    """Of one renderer, by depth."""

    def __init__(self, counts: Counts):
        self._counts, self.by_depth = counts, {}
        self._whole = (0, 0)  # px of the picture that they were made for

    def make_room(self, whole: tuple[int, int], nodes: tuple[Node, ...], beside: str | None):
        """Targets that hold every one of these views; sides grow in steps of an eighth of the whole picture's."""
        if whole != self._whole:
            self.by_depth, self._whole = {}, whole
        for depth in {node.depth for node in nodes}:
            level = self.by_depth.get(depth)
            held = level.size if level else (0, 0)
            drawn = np.max([node.drawn[2:] for node in nodes if node.depth == depth], axis=0)
            steps = np.maximum(np.ceil(np.array(whole) / SIDES), 1)
            size = tuple(int(max(h, min(np.ceil(d / s) * s, max(w, d)))) for h, d, s, w in zip(held, drawn, steps, whole, strict=True))
            if level is None or size != held or level.beside != beside:
                self.by_depth[depth] = Level(size, beside, self._counts)

    def __getitem__(self, depth: int) -> Level:
        return self.by_depth[depth]

    def bytes(self) -> int:
        """Memory on the GPU, one set a level."""
        return sum(level.bytes for level in self.by_depth.values())

    def free(self):
        self.by_depth = {}
