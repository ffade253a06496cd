"""The focal plane of a slab: the one depth that its views are best looked up at [yu-2005 section 6, "disparity"].

Problem. Without depths all of a slab's views are blended as if what they see lay on one plane. Which plane is best depends on
what is seen where, and on how much it varies there, not on the range of depths alone [Chai et al. 2000 take the mean of the
least and the greatest disparity: columns 0.54 of `environment`'s error at 8 views, the best plane 0.29].
Idea. A view that stands `step` beside a ray shows, at the plane 1 / z = q, what the ray would meet (q - q') step aside where it
really meets something at q'. So each texel's own view tells, with the depth that it stores, what the four views around a ray
in their middle would blend at each of a row of candidate planes; the plane that errs least is taken. Texels count as rays do
that start anywhere in the cell in any direction.
Limits. What hides what is not told: the views beside it are taken to see the same things. Square errors of radiance, so lamps
count most, as they do in a picture.
"""

import numpy as np

from .light_field import MARGIN, Cell, inside, lines_of
from .light_field_slab import Slab

# Texels that are looked at, of all views of a slab; drawn by weight from POOL times as many.
PROBES = 10_000
FEW = 2_000  # where the plane is no more than views with depths start from
POOL = 8
# Candidates: 1 / z evenly from the sky to the nearest PERCENT of what is seen.
CANDIDATES = 50
PERCENT = 99.0


def focus(cell: Cell, face: int, slab: Slab, probes: int = PROBES) -> float:
    """1 / z in 1/m of the plane that serves slab `face` best, 0 = the sky. The slab's untraced texels are filled."""
    rng, texels = np.random.default_rng(3), slab.texels
    used = np.flatnonzero(slab.traced())
    if not len(used):
        return 0.0
    pool = rng.choice(used, min(POOL * probes, len(used)), replace=False)
    y, x = np.divmod(pool, cell.slab_side())
    weight = _weight(cell, face, x, y)
    if not weight.any():
        return 0.0
    some = rng.choice(len(pool), probes, p=weight / weight.sum())
    x, y = x[some], y[some]
    depths = texels[y, x, 3].astype(np.float64) / cell.size()
    seen = depths[depths > 0]
    if not len(seen):
        return 0.0
    view, at = np.stack([x, y], -1) // cell.texels, np.stack([x, y], -1) % cell.texels
    truth = texels[y, x, :3].astype(np.float32)
    move = cell.step(face // 2) * (cell.texels - 1) / (2 * cell.steepest(face // 2) * (1 + MARGIN))
    candidates = np.linspace(0.0, np.percentile(seen, PERCENT), CANDIDATES)
    errors = []
    for q in candidates:
        off = _blended(cell, texels, view, at, (q - depths)[:, None] * move) - truth
        errors.append(float(np.square(off).mean()))
    return float(_lowest(candidates, errors, int(np.argmin(errors))))


def _weight(cell: Cell, face: int, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """(N,) how many rays that start anywhere in the cell in any direction pass by each texel: its line's length in the cell, times
    the fourth power of the cosine, of which three belong to the solid angle and one to the camera plane's slant."""
    point, direction = lines_of(cell, face, x, y)
    axis, length = face // 2, np.linalg.norm(direction, axis=-1)
    slopes = np.abs(direction[:, [(axis + 1) % 3, (axis + 2) % 3]])
    enter, leave = inside(point, direction, cell.half)
    return np.maximum(leave - enter, 0.0) * length**-3.0 * (slopes <= cell.steepest(axis)).all(-1)


def _blended(cell: Cell, texels: np.ndarray, view: np.ndarray, at: np.ndarray, move: np.ndarray) -> np.ndarray:
    """(N, 3) mean of what a view shows half of `move` (N, 2) texels to the four sides of `at`, diagonally."""
    total = 0.0
    for dy in (-0.5, 0.5):
        for dx in (-0.5, 0.5):
            total = total + _read(cell, texels, view, np.clip(at - move * [dx, dy], 0, cell.texels - 1))
    return total / 4


def _read(cell: Cell, texels: np.ndarray, view: np.ndarray, at: np.ndarray) -> np.ndarray:
    """(N, 3) bilinear radiance of a view at texel coordinates `at` (N, 2), centres at whole numbers."""
    low = np.minimum(at.astype(int), cell.texels - 2)
    fx, fy = (at - low).T[..., None].astype(np.float32)
    first = (view * cell.texels + low) @ [1, texels.shape[1]]
    flat = texels.reshape(-1, texels.shape[-1])
    corners = [flat[first + more, :3].astype(np.float32) for more in (0, 1, texels.shape[1], texels.shape[1] + 1)]
    lower, upper = corners[0] * (1 - fx) + corners[1] * fx, corners[2] * (1 - fx) + corners[3] * fx
    return lower * (1 - fy) + upper * fy


def _lowest(x: np.ndarray, y: list[float], best: int) -> float:
    """Where the parabola through the best of evenly spaced samples and its neighbours is lowest."""
    if best in (0, len(x) - 1):
        return x[best]
    a, b, c = y[best - 1], y[best], y[best + 1]
    bend = a - 2 * b + c
    return x[best] + (0.5 * (a - c) / bend if bend > 0 else 0.0) * (x[1] - x[0])
