"""Light-field slabs around a cell: which rays they hold, and where in the atlas each lies [yu-2005 sections 3 and 5].

Problem. One environment map shows the scene from one point only.
Idea. Six arrays of views, one for each face of a box (the cell) that the reflector stays in. A ray belongs to the slab of its
largest component, meets that slab's camera plane at (s, t) and is found there by its slope, eq. (1). A box of length l needs
slabs of length 3 l for slopes up to 45 degrees, and no ray through it is missed (section 5, Fig. 7c).
  * Any box, not only cubes. Its axes are the world's; half the side of a slab along b is half_b + 2 half_a w_a / w_b for the axis a.
  * `weight` w: components are compared after being multiplied by it, so slopes of slab a reach w_a / w_b along b. With equal
    weights that is 45 degrees everywhere; with w_z = 1 / tan(theta) the slabs at the sides see theta up and down and those above
    and below are extended by l / tan(theta): the general extension of section 5.
Where we depart. The camera plane of a slab is the far side of the cell (-X for the slab +X), not the near one: as long, but what
is seen is farther from it by the cell's depth, so that neighbouring views differ less, and nothing outside the cell can lie on
the plane itself, where no view would show it. A texel's ray starts where it leaves the cell, so that what stands beside the cell,
before or behind a plane's extension, is seen from the cell and not from the plane. Texels whose line passes the cell are never
looked up and are not traced.

Atlas. Three slabs in a row and two rows, in spaces.py's order of faces; in a slab view (i, j) has its lower left texel at
(i, j) times `texels`. Texel centres 0 and texels - 1 of a view are its extreme slopes: a look-up inside needs no neighbour.
"""

from dataclasses import dataclass

import numpy as np

from .rays import Rays

SLABS = 6
ATLAS = (3, 2)  # slabs side by side, and above each other
# Slopes that views hold beyond those of the slab, as a share of them: what is near is seen by neighbouring views past their
# slab's limit. 1/16 is one view's step of 32 for what is as far from the plane as the slab is long.
MARGIN = 1 / 16


@dataclass(frozen=True)
class Cell:
    """A box with its slabs. Lengths in m, along the world's axes."""

    center: np.ndarray  # (3,) float64, world
    half: np.ndarray  # (3,) float64, > 0: half its sides
    views: int  # views along a slab's side
    texels: int  # texels along a view's side
    weight: np.ndarray = None  # (3,) float64, > 0; None = 1

    def __post_init__(self):
        object.__setattr__(self, "weight", np.ones(3) if self.weight is None else np.asarray(self.weight, float))
        if not ((np.asarray(self.half) > 0).all() and (self.weight > 0).all()):
            raise ValueError(f"a cell needs sides and weights above 0, not {self.half} and {self.weight}")
        if self.views < 2 or self.texels < 2:
            raise ValueError(f"a slab needs 2 views of 2 texels a side at least, not {self.views} of {self.texels}")

    def steepest(self, axis: int) -> np.ndarray:
        """(2,) the slopes up to which slab `axis` is chosen, along the next axis and the one after it."""
        return self.weight[axis] / self.weight[_others(axis)]

    def side(self, axis: int) -> np.ndarray:
        """(2,) m: half the sides of the slabs of an axis."""
        return self.half[_others(axis)] + 2 * self.half[axis] * self.steepest(axis)

    def step(self, axis: int) -> np.ndarray:
        """(2,) m between neighbouring views."""
        return 2 * self.side(axis) / (self.views - 1)

    def shape(self) -> tuple[int, int]:
        """(height, width) of the atlas in texels."""
        return ATLAS[1] * self.views * self.texels, ATLAS[0] * self.views * self.texels

    def contains(self, points: np.ndarray) -> np.ndarray:
        """(N,) bool: (N, 3) world points in the cell; a hair outside counts."""
        return (np.abs(np.asarray(points, float) - self.center) <= self.half * (1 + 1e-6)).all(-1)

    def uniforms(self) -> dict[str, float | tuple[float, ...]]:
        """What light_field_kernel.py reads: vec3 by axis, and of a slab's two directions one vec3 by axis each."""
        out = {"center": self.center, "cell_half": self.half, "cell_weight": self.weight}
        for n, name in enumerate("bc"):
            out[f"slab_side_{name}"] = [self.side(a)[n] for a in range(3)]
            out[f"slab_slope_{name}"] = [self.steepest(a)[n] * (1 + MARGIN) for a in range(3)]
        return {name: tuple(map(float, value)) for name, value in out.items()}


def _others(axis: int) -> list[int]:
    return [(axis + 1) % 3, (axis + 2) % 3]


def slab_origin(cell: Cell, face: int) -> tuple[int, int]:
    """(x, y) of a slab's lowest left texel in the atlas."""
    side = cell.views * cell.texels
    return face % ATLAS[0] * side, face // ATLAS[0] * side


def lines(cell: Cell, face: int) -> tuple[np.ndarray, np.ndarray]:
    """((H, W, 3), (H, W, 3)) float64 of the texels of a slab, H = W = views * texels: the point of the camera plane, from the
    cell's centre, and the direction, whose component along the slab's axis is 1 or -1."""
    axis, sign = face // 2, 1 - 2 * (face % 2)
    view, texel = np.divmod(np.arange(cell.views * cell.texels), cell.texels)
    at = view / (cell.views - 1) * 2 - 1
    slope = (texel / (cell.texels - 1) * 2 - 1) * (1 + MARGIN)
    shape = (len(at), len(at))
    point, direction = np.empty((*shape, 3)), np.empty((*shape, 3))
    point[..., axis], direction[..., axis] = -sign * cell.half[axis], sign
    for n, (other, line) in enumerate(zip(_others(axis), (np.s_[None, :], np.s_[:, None]), strict=True)):
        point[..., other] = at[line] * cell.side(axis)[n]
        direction[..., other] = slope[line] * cell.steepest(axis)[n]
    return point, direction


def bundle(cell: Cell, face: int) -> tuple[Rays, np.ndarray]:
    """(rays, (H, W) bool): the rays of those texels of a slab that a look-up from inside the cell may read, in row order, each
    from where it leaves the cell."""
    point, direction = lines(cell, face)
    axis = face // 2
    # Look-ups read views beside the ray's own: lines that pass the cell by a view's step, and by a texel's slope.
    room = np.zeros(3)
    room[_others(axis)] = cell.step(axis) + 2 * cell.half[axis] * 2 * cell.steepest(axis) * (1 + MARGIN) / (cell.texels - 1)
    enter, leave = _inside(point, direction, cell.half + room)
    used = enter <= leave
    point, direction = point[used], direction[used]
    # Of lines beside the cell itself, where they leave the larger box.
    enter, own = _inside(point, direction, cell.half)
    leave = np.where(enter <= own, own, leave[used])
    origin = cell.center + point + direction * leave[:, None]
    direction = direction / np.linalg.norm(direction, axis=-1, keepdims=True)
    return Rays(origin.astype(np.float32), direction.astype(np.float32)), used


def _inside(point: np.ndarray, direction: np.ndarray, half: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(enter, leave): the part of each line inside the box of half sides `half` around the origin; empty where enter > leave."""
    with np.errstate(divide="ignore", invalid="ignore"):
        a, b = (-half - point) / direction, (half - point) / direction
    # A line along a side and between both sides has -inf and inf here, one outside them inf and inf: never a part.
    low, high = np.fmin(a, b), np.fmax(a, b)
    return low.max(-1), high.min(-1)
