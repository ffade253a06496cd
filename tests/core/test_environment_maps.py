"""core/environment_maps.py: projections are one another's inverse, cover all directions once, and a map shows what it was filled with."""

import numpy as np
import pytest
from analytic import unit

from reflect_addon.core.environment_maps import INPUTS, PROJECTIONS, filled, look_up, side_for
from reflect_addon.core.kernel import evaluate, record_function

each = pytest.mark.parametrize("projection", PROJECTIONS, ids=lambda p: p.name)


def placed(projection, direction):
    program = record_function(projection.place, INPUTS, name="place")
    return evaluate(program, {"direction": direction}, dtype=np.float64)


@each
def test_a_direction_is_found_where_it_is_kept(projection, rng):
    direction = unit(rng.normal(size=(20000, 3)))
    direction = direction[direction[:, 2] > -0.999]  # behind, a sphere map is its rim
    at = placed(projection, direction)
    assert max(np.abs(at["s"]).max(), np.abs(at["t"]).max()) <= 1 + 1e-9 and set(np.unique(at["picture"])) == set(range(projection.pictures))
    again = unit(projection.directions(np.rint(at["picture"]).astype(int), at["s"], at["t"]))
    np.testing.assert_allclose(again, direction, atol=1e-6)


@each
def test_errors_fall_with_the_square_of_the_side(projection, rng):
    """Of a smooth radiance; away from seams, where look-ups are clamped, and from a sphere map's rim."""
    direction = unit(rng.normal(size=(20000, 3)))
    at = placed(projection, direction)
    inside = (np.maximum(np.abs(at["s"]), np.abs(at["t"])) < 0.9) & (direction[:, 2] > -0.8)

    def radiance(d):
        return np.stack([d[:, 0], d[:, 1] * d[:, 2], 1 + d[:, 2] ** 2], -1)

    found = []
    for texels in (6 * 16 * 16, 6 * 64 * 64):
        image = filled(projection, side_for(projection, texels), radiance)
        assert np.isfinite(image).all()
        found.append(np.median(np.abs(look_up(at["picture"], at["s"], at["t"], image) - radiance(direction))[inside]))
    assert found[1] < found[0] / 10


@each
def test_a_constant_is_a_constant(projection, rng):
    direction = unit(np.concatenate([rng.normal(size=(1000, 3)), np.eye(3), -np.eye(3)]))
    at = placed(projection, direction)
    image = filled(projection, 8, lambda d: np.ones_like(d))
    np.testing.assert_allclose(look_up(at["picture"], at["s"], at["t"], image), 1.0, atol=1e-12)
