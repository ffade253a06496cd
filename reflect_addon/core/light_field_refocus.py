"""Another focal plane for a light field that is baked already: a slider, or a place that was pointed at [yu-2005 section 6].

The plane of a slab is 1 / z in the look-up, z from its camera plane along its axis (light_field_kernel.py); the camera plane is
half a cell behind the middle. So one distance from the middle is a plane for each slab, all of them sides of one box. With
depths it is only where the search for each view's own depth starts.
"""

from dataclasses import replace

import numpy as np

from .asset import Asset
from .light_field import cell_of


def focused(asset: Asset, distance: float) -> Asset:
    """The asset with all slabs focused `distance` m from the cell's middle; its own planes where that is 0. It shares its
    images, so that nothing is uploaded or compiled again."""
    if not distance > 0:
        return asset
    planes = tuple(float(1 / (distance + half)) for half in asset.uniforms["cell_half"])
    return replace(asset, uniforms={**asset.uniforms, "focus": planes, "focus_back": planes})


def distance_of(asset: Asset, point: np.ndarray) -> float:
    """m from the cell's middle to a world point (3,), along the axis of the slab that sees it from there: `focused` with it
    lays that slab's plane through the point."""
    cell = cell_of(asset)
    off = np.abs(np.asarray(point, float) - cell.center)
    return float(off[np.argmax(off * cell.weight)])
