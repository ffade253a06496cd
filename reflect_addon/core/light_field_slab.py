"""Baking one slab: its texels are one ray bundle through trace(), not views x views renders [yu-2005 sections 3 and 5].

A slab goes through in parts of whole rows of views, so that a bake of the paper's size (6 x 32 x 32 x 128 x 128) needs little
more memory than the slab itself. A texel is half floats: radiance over the slab's scale, and q = 1 / z over depth_scale; q is
UNTRACED where the texel's line passes the cell or goes where no reflected ray does.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .asset import half_with_scale
from .light_field import Cell, bundle
from .pull_push import continued
from .rays import Hits, Rays

UNTRACED = -1.0
# Texels of one part: 150 MB with all that goes through a render.
RAYS_AT_ONCE = 1 << 20
# Of the slab's size, the least z that is told from 0: what touches the camera plane.
NEAREST = 1e-4


@dataclass(frozen=True)
class Slab:
    """One of the six."""

    texels: np.ndarray  # (side, side, 4) float16: radiance / scale, q / depth_scale
    scale: float  # a power of two

    def traced(self) -> np.ndarray:
        """(side, side) bool."""
        return self.texels[..., 3] >= 0


def rows_of_views(cell: Cell) -> list[slice]:
    """The slab's rows of texels in parts of whole rows of views."""
    row = cell.texels * cell.slab_side()
    step = max(RAYS_AT_ONCE // row, 1) * cell.texels
    return [slice(y, min(y + step, cell.slab_side())) for y in range(0, cell.slab_side(), step)]


def bake_slab(cell: Cell, face: int, wanted, traced: Callable[[Rays], Hits], before: Slab | None = None) -> tuple[Slab, np.ndarray]:
    """(the slab, (2,) int rays traced and views they belong to): the texels that are wanted (light_field.bundle).

    traced(rays) is asked once for each of rows_of_views. before: where given, every other texel is the one that it has."""
    side = cell.slab_side()
    texels, scale, made = np.zeros((side, side, 4), np.float16), 1.0, np.zeros(2, int)
    texels[..., 3] = UNTRACED
    if before is not None:
        texels, scale = before.texels.copy(), before.scale
    for rows in rows_of_views(cell):
        rays, used = bundle(cell, face, rows, wanted)
        hits = traced(rays)
        if not len(rays):
            continue
        made += len(rays), used.reshape(-1, cell.texels, cell.views, cell.texels).any((1, 3)).sum()
        radiance, own = half_with_scale(hits.radiance)
        if own > scale:
            texels[..., :3] *= np.float16(scale / own)
            scale = own
        part = texels[rows]
        part[used] = np.concatenate([radiance * np.float16(own / scale), _q(cell, face, hits)[:, None]], -1)
    return Slab(texels, scale), made


def _q(cell: Cell, face: int, hits: Hits) -> np.ndarray:
    """(N,) float16: 1 / z over depth_scale, 0 for the sky."""
    axis, sign = face // 2, 1 - 2 * (face % 2)
    z = sign * (hits.position[:, axis].astype(np.float64) - cell.center[axis]) + cell.half[axis]
    return np.where(hits.hit, cell.size() / np.maximum(z, NEAREST * cell.size()), 0.0).astype(np.float16)


def filled(slab: Slab, cell: Cell) -> Slab:
    """Texels that were not traced continue what their view saw: blocks that hold both kinds compress as well as others, and a
    ray that nobody foresaw is answered vaguely, not black."""
    traced = slab.traced()
    if traced.all():
        return slab
    texels, m = slab.texels.copy(), cell.texels
    for y in range(0, cell.slab_side(), m):
        for x in range(0, cell.slab_side(), m):
            view, known = texels[y : y + m, x : x + m], traced[y : y + m, x : x + m, None]
            if known.any() and not known.all():
                seen = np.concatenate([view[..., :3] * known, known], -1, dtype=np.float32)
                view[..., :3] = continued(seen)[..., :3]
    return Slab(texels, slab.scale)
