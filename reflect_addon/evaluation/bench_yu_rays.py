"""Targets Y4 and Y5 of yu-2005: what a ray costs, counted by the kernel, and that no ray through the cell is missed.

Atlases of ones are enough for both: texels that no look-up from inside the cell may read are LOUD, so that a ray that reads one
shows it. Y5 is answered by the shader, as it draws.
"""

import numpy as np

from ..core.asset import Asset
from ..core.kernel import Counts, record, run_numpy
from ..core.light_field import SLABS, Cell, bundle
from ..core.light_field_kernel import BAND
from ..core.light_field_slab import UNTRACED
from ..core.methods import light_field
from ..core.rays import Rays
from .bench_row import row

RAYS = 1_000_000  # Y5, of each cell
COUNTED = 50_000  # Y4
VIEWS, TEXELS = 16, 32
LOUD = 6e4
ONE = 0.1  # a ray that reads a loud texel with more than 2e-6 of its weight is off 1 by this
CELLS = {"cube": (1.0, 1.0, 1.0), "box": (2.0, 1.0, 0.25), "thin": (1.0, 1.0, 1e-3)}  # half sides, m
SAMPLES = 4  # texels of one bilinear look-up


def measure() -> list[dict]:
    """Rows for targets.json."""
    rng = np.random.default_rng(5)
    return [*_counts(rng), _missed(rng)]


def _counts(rng) -> list[dict]:
    """Y4."""
    cell = Cell(np.zeros(3), np.ones(3), VIEWS, TEXELS)
    rays, asset = through(cell, rng, COUNTED), ones(cell)
    _, middle, most = np.sort(np.abs(rays.direction), -1).T
    alone = middle < most * (1 - BAND)
    outside, everywhere = (looks(asset, Rays(rays.origin[some], rays.direction[some])) for some in (alone, slice(None)))
    depth = looks(ones(cell, depth=True), Rays(rays.origin[alone], rays.direction[alone]))
    return [
        row("Y4", outside, 4, outside == 4,
            f"Bilinear look-ups a ray, counted: {alone.sum()} rays in all directions that are not within {BAND:.2f} of a seam between slabs.",
            paper=4),
        row("Y4-mean", [everywhere, alone.mean()], None, True,
            "The same with those beside seams, where slabs are blended, and the share of rays that are not there."),
        row("Y4-depth", depth, None, True, "With each view's depths, texels fetched over 4: three depths a view beside the look-ups."),
    ]  # fmt: skip


def looks(asset: Asset, rays: Rays) -> float:
    """Texels fetched a ray, over those of one bilinear look-up."""
    counts = Counts()
    run_numpy(record(light_field.trace, asset), asset, rays, counts=counts)
    return counts.fetches_per_ray / SAMPLES


def _missed(rng) -> dict:
    """Y5."""
    from ..gpu.fill import RayBundle

    missed, untraced = 0, 0
    for half in CELLS.values():
        cell = Cell(np.zeros(3), np.array(half), VIEWS, TEXELS)
        found = RayBundle(through(cell, rng, RAYS)).answer(ones(cell), light_field.trace)
        missed += int((found.coverage != 1).sum())
        untraced += int((np.abs(found.radiance - 1).max(-1) > ONE).sum())
    return row(
        "Y5", [missed, untraced], [0, 0], missed == untraced == 0,
        f"Of {RAYS:,} random rays through each of the cells {', '.join(CELLS)}, by the shader: rays without an answer, and rays that read "
        "a texel which was not traced.", paper=[0, 0],
    )  # fmt: skip


def ones(cell: Cell, depth: bool = False) -> Asset:
    """A light field that is 1 wherever the cell's rays may look, LOUD elsewhere, and sees the sky."""
    atlas = np.full((*cell.shape(), 4), LOUD, np.float16)
    atlas[..., 3] = UNTRACED
    side = cell.slab_side()
    for face in range(SLABS):
        x, y = cell.origin(face)
        _, used = bundle(cell, face)
        atlas[y : y + side, x : x + side][used] = (1.0, 1.0, 1.0, 0.0)
    options = {"views": cell.views, "texels": cell.texels, "columns": cell.columns(), "depth": depth, "coded": False}
    uniforms = {**cell.uniforms(), "light_scale": 1.0, "focus": (0.0,) * 3, "focus_back": (0.0,) * 3}
    return Asset(light_field.NAME, "", {"light_field_tx": atlas}, uniforms, options)


def through(cell: Cell, rng, count: int) -> Rays:
    """Rays from inside the cell, and a tenth of them from its sides, in all directions."""
    start, direction = rng.uniform(-1, 1, (count, 3)), rng.normal(size=(count, 3))
    side = rng.integers(0, 3, count // 10)
    start[np.arange(len(side)), side] = np.sign(start[np.arange(len(side)), side])
    direction /= np.linalg.norm(direction, axis=-1, keepdims=True)
    return Rays((cell.center + start * cell.half).astype("f"), direction.astype("f"))
