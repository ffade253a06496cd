"""The focal plane of a slab: the one depth at which its views agree best [yu-2005 section 6, "disparity"].

Problem. Without depths all of a slab's views are blended as if what they see lay on one plane. Which plane is best depends on
what is seen where, and on how much it varies there, not on the range of depths alone [Chai et al. 2000 take the mean of the
least and the greatest disparity: columns 0.54 of `environment`'s error at 8 views, the best plane 0.29].
Idea. The views themselves know: each view that has neighbours on both sides is predicted from the four around it at a step
diagonally, at each of a row of candidate planes, and the plane that predicts best is taken. That is the very look-up with
twice its steps, at the place where it is worst, and needs no ray that was not baked.
"""

import numpy as np

from .light_field import MARGIN, Cell
from .light_field_slab import Slab

# Texels that are predicted, of all views of a slab.
PROBES = 20_000
FEW = 4_000  # where the plane is no more than views with depths start from
# Candidates: 1 / z evenly from the sky to the nearest PERCENT of what is seen.
CANDIDATES = 50
PERCENT = 99.0
# Of the median radiance: brighter counts as bright as this, or one lamp's edge would decide for everything else.
BRIGHTEST = 16.0


def focus(cell: Cell, face: int, slab: Slab, probes: int = PROBES) -> float:
    """1 / z in 1/m of the plane that serves slab `face` best, 0 = the sky."""
    used, texels = slab.traced(), slab.texels
    depths = texels[used][:, 3].astype(np.float64) / cell.size()
    seen = depths[depths > 0]
    if not len(seen) or cell.views < 3:
        return float(np.median(depths)) if len(depths) else 0.0
    probes = _probes(cell, used)[:probes]
    if not len(probes):
        return float(np.median(depths))
    limit = BRIGHTEST * max(float(np.median(texels[used][:, :3])), 1e-6)
    truth = np.minimum(_read(cell, texels, probes[:, :2], probes[:, 2:].astype(float)), limit)
    step = cell.step(face // 2) * (cell.texels - 1) / (2 * cell.steepest(face // 2) * (1 + MARGIN))
    candidates = np.linspace(0.0, np.percentile(seen, PERCENT), CANDIDATES)
    errors = [np.square(np.minimum(_predicted(cell, texels, probes, q * step), limit) - truth).mean() for q in candidates]
    return float(_lowest(candidates, errors, int(np.argmin(errors))))


def _probes(cell: Cell, used: np.ndarray) -> np.ndarray:
    """(N, 4) int of view x, y and texel x, y: traced, and with the four views around them traced there too."""
    n, m = cell.views, cell.texels
    grid = used.reshape(n, m, n, m)  # view y, texel y, view x, texel x
    whole = grid[1:-1, :, 1:-1]
    for dy in (0, 2):
        for dx in (0, 2):
            whole = whole & grid[dy : n - 2 + dy, :, dx : n - 2 + dx]
    y, v, x, u = np.nonzero(whole)
    pick = np.random.default_rng(3).permutation(len(y))[:PROBES]
    return np.stack([x[pick] + 1, y[pick] + 1, u[pick], v[pick]], -1)


def _predicted(cell: Cell, texels: np.ndarray, probes: np.ndarray, move: np.ndarray) -> np.ndarray:
    """(N, 3) mean of the four views around each probe's, looked up `move` (2,) texels a view away."""
    total = 0.0
    for dy in (-1, 1):
        for dx in (-1, 1):
            at = np.clip(probes[:, 2:] - move * [dx, dy], 0, cell.texels - 1)
            total = total + _read(cell, texels, probes[:, :2] + [dx, dy], at)
    return total / 4


def _read(cell: Cell, texels: np.ndarray, view: np.ndarray, at: np.ndarray) -> np.ndarray:
    """(N, 3) bilinear radiance of a view at texel coordinates `at` (N, 2), centres at whole numbers."""
    low = np.minimum(at.astype(int), cell.texels - 2)
    fx, fy = (at - low).T[..., None]
    x, y = (view * cell.texels + low).T
    lower = texels[y, x, :3] * (1 - fx) + texels[y, x + 1, :3] * fx
    upper = texels[y + 1, x, :3] * (1 - fx) + texels[y + 1, x + 1, :3] * fx
    return lower * (1 - fy) + upper * fy


def _lowest(x: np.ndarray, y: list[float], best: int) -> float:
    """Where the parabola through the best of evenly spaced samples and its neighbours is lowest."""
    if best in (0, len(x) - 1):
        return x[best]
    a, b, c = y[best - 1], y[best], y[best + 1]
    bend = a - 2 * b + c
    return x[best] + (0.5 * (a - c) / bend if bend > 0 else 0.0) * (x[1] - x[0])
