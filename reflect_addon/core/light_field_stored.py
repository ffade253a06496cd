"""Slabs as they lie in files: compressed, of an earlier asset, and of a bake that did not end."""

import numpy as np

from . import bc1, hdr_code
from .asset import Asset
from .job import BakeJob
from .light_field import FIRST, Cell
from .light_field_slab import Slab


def compressed(cell: Cell, atlas: np.ndarray, depth: bool) -> tuple[dict[str, np.ndarray], dict[str, float]]:
    """(images, uniforms): radiance as coded blocks, of the first slabs and of the rest; depths four to a texel."""
    blocks, code = hdr_code.compress(atlas[..., :3])
    columns, side = cell.columns(), cell.slab_side() // bc1.SIDE
    rows, last = FIRST // columns * side, (len(cell.slabs) % columns or columns) * side
    images = {"light_field_bc1": blocks[:rows]}
    if len(blocks) > rows:
        images["light_rest_bc1"] = np.ascontiguousarray(blocks[rows:, :last])
    if depth:
        images["light_depth_tx"] = atlas[..., 3].reshape(len(atlas), -1, 4)
    return images, code


def slab_before(earlier: Asset, cell: Cell, face: int) -> Slab:
    """A slab of an earlier asset with the same cell."""
    (x, y), side = cell.origin(face), cell.slab_side()
    return Slab(earlier.images["light_field_tx"][y : y + side, x : x + side], earlier.uniforms["light_scale"])


def finished_slab(job: BakeJob, face: int) -> Slab | None:
    """One that an earlier run of this bake ended."""
    scale, texels = job.unfinished.load(f"scale{face}"), job.unfinished.load(f"slab{face}")
    return None if scale is None or texels is None else Slab(texels, float(scale))


def finish_slab(job: BakeJob, face: int, slab: Slab) -> None:
    job.unfinished.save(f"scale{face}", np.array(slab.scale))
    job.unfinished.save(f"slab{face}", slab.texels)
