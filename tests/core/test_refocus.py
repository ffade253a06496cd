"""Another focal plane after the bake: planes of all slabs from one distance, and which distance lays one through a place."""

import numpy as np
import pytest

from reflect_addon.core.asset import Asset
from reflect_addon.core.focus import can_focus, refocused
from reflect_addon.core.kernel import record, run_numpy
from reflect_addon.core.light_field import Cell
from reflect_addon.core.light_field_refocus import distance_of, focused
from reflect_addon.core.methods import light_field
from reflect_addon.core.rays import Rays

CELL = Cell(np.array([3.0, -2.0, 1.0]), np.array([2.0, 1.0, 0.25]), 8, 16)


def baked(depth=False):
    uniforms = {**CELL.uniforms(), "light_scale": 1.0, "focus": (0.1, 0.2, 0.3), "focus_back": (0.4, 0.5, 0.6)}
    options = {"views": 8, "texels": 16, "columns": CELL.columns(), "depth": depth, "coded": False}
    return Asset("light_field", "", {"light_field_tx": np.ones((*CELL.shape(), 4), np.float16)}, uniforms, options)


def test_zero_is_the_planes_of_the_bake():
    asset = baked()
    assert focused(asset, 0.0) is asset


def test_images_are_shared_and_the_program_is_the_same():
    asset = baked()
    other = focused(asset, 2.5)
    assert other.images is asset.images and other.options == asset.options
    assert {n: np.shape(v) for n, v in other.uniforms.items()} == {n: np.shape(v) for n, v in asset.uniforms.items()}
    assert asset.uniforms["focus"] == (0.1, 0.2, 0.3), "the asset itself stays"


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("sign", [-1, 1])
def test_the_place_that_is_pointed_at_lies_on_the_plane(axis, sign):
    """A ray from the cell to the place: without depths its answer's position is where it meets the focal plane."""
    place = CELL.center + 0.3
    place[axis] = CELL.center[axis] + sign * 7.0
    asset = focused(baked(), distance_of(baked(), place))
    start = CELL.center + 0.4 * CELL.half
    direction = (place - start) / np.linalg.norm(place - start)
    rays = Rays(start[None].astype("f"), direction[None].astype("f"))
    found = run_numpy(record(light_field.trace, asset), asset, rays)
    assert np.allclose(found.position[0], place, atol=1e-4)


def test_what_reflectors_share_they_share_afterwards():
    asset = baked()
    other = Asset("environment", "b", {"radiance_tx": np.ones((4, 4, 4), np.float16)})
    found = refocused({"a": asset, "b": other, "c": asset}, 3.0)
    assert found["a"] is found["c"] is not asset and found["b"] is other
    assert can_focus("light_field") and not can_focus("environment") and not can_focus("nothing")
