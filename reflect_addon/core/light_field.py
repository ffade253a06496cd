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
the plane itself, where no view would show it. A texel's ray starts inside the cell, where its line comes closest to the middle:
for a ball that is exactly what lies before it, and what reaches into the cell (a floor that the ball sinks in) is seen. Texels
whose line passes the cell are never looked up and are not traced.

Atlas. Slabs two in a row, or one, those that are left out without a place, in spaces.py's order of faces; in a slab view (i, j) has
its lower left texel at (i, j) times `texels`. Texel centres 0 and texels - 1 of a view are its extreme slopes: a look-up inside
needs no neighbour.
"""

from dataclasses import dataclass

import numpy as np

from .rays import Rays

SLABS = 6
COLUMNS = 2  # slabs side by side in the atlas, at most
TALLEST = 8192  # texels of an atlas of one column
# Slabs in the first image where the atlas is block-compressed: images of sides that are powers of two waste nothing.
FIRST = 4
# Slopes that views hold beyond those of the slab, as a share of them: what is near is seen by neighbouring views past their
# slab's limit, and two slabs are blended where they meet. 1/16 is one view's step of 32 for what is as far from the plane
# as the slab is long.
MARGIN = 1 / 16
# Least thickness of a cell over its width: a flat mirror has a box, too.
THINNEST = 1e-3


@dataclass(frozen=True)
class Cell:
    """A box with its slabs. Lengths in m, along the world's axes."""

    center: np.ndarray  # (3,) float64, world
    half: np.ndarray  # (3,) float64, > 0: half its sides
    views: int  # views along a slab's side
    texels: int  # texels along a view's side
    weight: np.ndarray = None  # (3,) float64, > 0; None = 1
    slabs: tuple[int, ...] = tuple(range(SLABS))  # faces that have a place in the atlas, in rising order

    def __post_init__(self):
        object.__setattr__(self, "weight", np.ones(3) if self.weight is None else np.asarray(self.weight, float))
        if not ((np.asarray(self.half) > 0).all() and (self.weight > 0).all()):
            raise ValueError(f"a cell needs sides and weights above 0, not {self.half} and {self.weight}")
        if self.views < 2 or self.texels < 2:
            raise ValueError(f"a slab needs 2 views of 2 texels a side at least, not {self.views} of {self.texels}")

    @staticmethod
    def around(low: np.ndarray, high: np.ndarray, views: int, texels: int) -> "Cell":
        """The cell of a box given by its corners, thickened where it is flat."""
        half = (np.asarray(high, float) - low) / 2
        return Cell((np.asarray(high, float) + low) / 2, np.maximum(half, THINNEST * max(half.max(), 1e-30)), views, texels)

    def steepest(self, axis: int) -> np.ndarray:
        """(2,) the slopes up to which slab `axis` is chosen, along the next axis and the one after it."""
        return self.weight[axis] / self.weight[_others(axis)]

    def side(self, axis: int) -> np.ndarray:
        """(2,) m: half the sides of the slabs of an axis."""
        return self.half[_others(axis)] + 2 * self.half[axis] * self.steepest(axis)

    def step(self, axis: int) -> np.ndarray:
        """(2,) m between neighbouring views."""
        return 2 * self.side(axis) / (self.views - 1)

    def slab_side(self) -> int:
        """Texels along a slab's side."""
        return self.views * self.texels

    def columns(self) -> int:
        """Slabs side by side: one where two would leave a place empty."""
        n = len(self.slabs)
        return 1 if n % COLUMNS and n * self.slab_side() <= TALLEST else COLUMNS

    def shape(self) -> tuple[int, int]:
        """(height, width) of the atlas in texels."""
        n = max(len(self.slabs), 1)
        return -(-n // self.columns()) * self.slab_side(), self.columns() * self.slab_side()

    def origin(self, face: int) -> tuple[int, int]:
        """(x, y) of a slab's lowest left texel in the atlas."""
        place = self.slabs.index(face)
        return place % self.columns() * self.slab_side(), place // self.columns() * self.slab_side()

    def size(self) -> float:
        """m: the length that depths are stored in units of."""
        return float(np.linalg.norm(self.half))

    def contains(self, points: np.ndarray) -> np.ndarray:
        """(N,) bool: (N, 3) world points in the cell; a hair outside counts."""
        return (np.abs(np.asarray(points, float) - self.center) <= self.half + 1e-4 * self.size()).all(-1)

    def uniforms(self) -> dict[str, float | tuple[float, ...]]:
        """What light_field_kernel.py reads: vec3 by axis; of a slab's two directions one vec3 by axis each; places of slabs in
        the atlas for the directions + and -, -1 for those left out."""
        out = {"cell_center": self.center, "cell_half": self.half, "cell_weight": self.weight}
        for n, name in enumerate("bc"):
            out[f"slab_side_{name}"] = [self.side(a)[n] for a in range(3)]
            out[f"slab_slope_{name}"] = [self.steepest(a)[n] * (1 + MARGIN) for a in range(3)]
        for sign, name in enumerate(("slab_place", "slab_place_back")):
            faces = [2 * a + sign for a in range(3)]
            out[name] = [self.slabs.index(f) if f in self.slabs else -1 for f in faces]
        return {name: tuple(map(float, value)) for name, value in out.items()} | {"depth_scale": 1 / self.size()}

    def is_of(self, uniforms: dict) -> bool:
        """Whether an asset with these uniforms has this very cell."""
        own = self.uniforms()
        return all(name in uniforms and np.allclose(uniforms[name], own[name], rtol=1e-6, atol=1e-9 * self.size()) for name in own)


def cell_of(asset) -> Cell:
    """The cell that an asset was baked with."""
    u = asset.uniforms
    places = [u[name][a] for a in range(3) for name in ("slab_place", "slab_place_back")]
    return Cell(
        *(np.array(u[name]) for name in ("cell_center", "cell_half")), int(asset.options["views"]), int(asset.options["texels"]),
        np.array(u["cell_weight"]), tuple(f for f, p in enumerate(places) if p >= 0),
    )  # fmt: skip


def _others(axis: int) -> list[int]:
    return [(axis + 1) % 3, (axis + 2) % 3]


def lines(cell: Cell, face: int, rows: slice = slice(None)) -> tuple[np.ndarray, np.ndarray]:
    """lines_of for all texels in some rows of a slab, (H, W, 3) each."""
    texels = np.arange(cell.slab_side())
    return lines_of(cell, face, texels, texels[rows, None])


def lines_of(cell: Cell, face: int, x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """((..., 3), (..., 3)) float64 of texels (x, y) of a slab: the point of the camera plane, from the cell's centre, and the
    direction, whose component along the slab's axis is 1 or -1."""
    axis, sign = face // 2, 1 - 2 * (face % 2)
    shape = np.broadcast_shapes(x.shape, y.shape)
    point, direction = np.empty((*shape, 3)), np.empty((*shape, 3))
    point[..., axis], direction[..., axis] = -sign * cell.half[axis], sign
    for n, (b, texels) in enumerate(zip(_others(axis), (x, y), strict=True)):
        view, texel = np.divmod(texels, cell.texels)
        point[..., b] = (view / (cell.views - 1) * 2 - 1) * cell.side(axis)[n]
        direction[..., b] = (texel / (cell.texels - 1) * 2 - 1) * (1 + MARGIN) * cell.steepest(axis)[n]
    return point, direction


def bundle(cell: Cell, face: int, rows: slice = slice(None), wanted=None) -> tuple[Rays, np.ndarray]:
    """(rays, (H, W) bool): the rays of those texels in some rows of a slab that a look-up from inside the cell may read, in row
    order. wanted(rows, points (H, W, 3), directions (H, W, 3)) -> (H, W) bool leaves out more of them."""
    enter, leave = _insides(cell, face, rows, cell.half + room(cell, face))
    used = enter <= leave
    if wanted is not None:
        used &= wanted(rows, *lines(cell, face, rows))
    own_enter, own_leave = (part[used] for part in _insides(cell, face, rows, cell.half))
    through = own_enter <= own_leave
    y, x = np.nonzero(used)
    point, direction = lines_of(cell, face, x, y + np.arange(cell.slab_side())[rows][0])
    start = np.clip(
        closest(cell, point, direction), np.where(through, own_enter, enter[used]), np.where(through, own_leave, leave[used])
    )
    origin = cell.center + point + direction * start[:, None]
    direction /= np.sqrt(np.einsum("nx,nx->n", direction, direction))[:, None]
    return Rays(origin.astype(np.float32), direction.astype(np.float32)), used


def _insides(cell: Cell, face: int, rows: slice, half: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """inside() for all texels in some rows of a slab, (H, W) each, about the cell's centre: columns have their part between two
    sides of the box in common, and so have rows."""
    axis, texels = face // 2, np.arange(cell.slab_side())
    low, high = _between(*lines_of(cell, face, texels, texels), half)
    b, c = _others(axis)
    enter, leave = np.maximum(low[:, b], low[:, axis]), np.minimum(high[:, b], high[:, axis])
    return np.maximum(enter, low[rows, c, None]), np.minimum(leave, high[rows, c, None])


def room(cell: Cell, face: int) -> np.ndarray:
    """(3,) m beside the cell through which lines pass that look-ups in a slab may read: they read views beside the ray's own, a
    view's step and a texel's slope away."""
    axis, out = face // 2, np.zeros(3)
    out[_others(axis)] = cell.step(axis) + 2 * cell.half[axis] * 2 * cell.steepest(axis) * (1 + MARGIN) / (cell.texels - 1)
    return out


def closest(cell: Cell, point: np.ndarray, direction: np.ndarray) -> np.ndarray:
    """(N,) where along each line it comes closest to the cell's middle, in units of the cell's sides."""
    p, d = point / cell.half, direction / cell.half
    return -np.einsum("...x,...x->...", p, d) / np.einsum("...x,...x->...", d, d)


def inside(point: np.ndarray, direction: np.ndarray, half: np.ndarray, center=0.0) -> tuple[np.ndarray, np.ndarray]:
    """(enter, leave): the part of each line inside the box of half sides `half` around `center`; empty where enter > leave."""
    low, high = (np.moveaxis(part, -1, 0) for part in _between(point, direction, half, center))
    # Not .max(-1): reductions over three neighbours take several times as long.
    return np.maximum(np.maximum(*low[:2]), low[2]), np.minimum(np.minimum(*high[:2]), high[2])


def _between(point: np.ndarray, direction: np.ndarray, half: np.ndarray, center=0.0) -> tuple[np.ndarray, np.ndarray]:
    """(enter, leave) of each line between each two opposite sides of a box, shaped as the points."""
    with np.errstate(divide="ignore", invalid="ignore"):
        a, b = (center - half - point) / direction, (center + half - point) / direction
    # A line along a side and between both sides has -inf and inf here, one outside them inf and inf: never a part.
    return np.fmin(a, b), np.fmax(a, b)
