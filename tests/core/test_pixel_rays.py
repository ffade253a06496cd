"""core/pixel_rays.py: how many rays a pixel sends, along which line and how wide, against the singular values of its differentials; edge cases."""

import numpy as np
import pytest

from reflect_addon.core import pixel_rays
from reflect_addon.core.kernel import evaluate, record_function
from reflect_addon.core.rays import RayMap

PROGRAM = record_function(pixel_rays.rays, pixel_rays.INPUTS)


def asked(along_x, along_y, spread=None, width=0.01, most=pixel_rays.MOST):
    """Of (N, 3) differences; spread: as the ray map's by default, from the same."""
    along_x, along_y = np.atleast_2d(along_x).astype(float), np.atleast_2d(along_y).astype(float)
    own = np.sqrt(0.5 * ((along_x**2).sum(1) + (along_y**2).sum(1))) if spread is None else np.full(len(along_x), spread)
    values = {"along_x": along_x, "along_y": along_y, "width": np.full(len(along_x), width), "spread": own, "most": np.full(len(along_x), most)}
    return own, evaluate(PROGRAM, values, dtype=np.float64)


def test_the_line_is_the_longest_axis_and_rays_are_as_wide_as_the_shortest(rng):
    x, y = rng.normal(size=(2, 5000, 3)) * 0.1
    y[::2] = y[::2] * 0.05 + x[::2] * rng.uniform(-2, 2, size=(2500, 1))
    own, found = asked(x, y)
    _, lengths, lines = np.linalg.svd(np.stack([x, y], -1), full_matrices=False)
    times, rays = np.minimum(lengths[:, 0] / lengths[:, 1], lengths[:, 0] / pixel_rays.FINE), found["rays"]
    several = rays > 1
    assert set(np.unique(rays)) == {1.0, 3.0, 5.0, 7.0} and np.array_equal(several, (times > pixel_rays.UNEVEN) & (own > pixel_rays.FINE))
    along = np.abs(np.einsum("nx,nx->n", found["line"], lines[:, 0]))
    np.testing.assert_allclose(along[several], 1, atol=1e-9)
    enough = several & (rays < pixel_rays.MOST)
    assert (rays[enough] >= times[enough] - 1e-9).all() and (rays[enough] < times[enough] + 2).all()
    # Each ray's share of the longest axis and all of the shortest, as a round footprint of that area; the rest have the pixel's own.
    each = np.sqrt(0.5 * ((lengths[:, 0] / rays) ** 2 + lengths[:, 1] ** 2))
    np.testing.assert_allclose(found["spread"], pixel_rays.FILTER * np.where(several, np.minimum(each, own), own), rtol=1e-9)
    np.testing.assert_allclose(found["width"], pixel_rays.FILTER * 0.01)


@pytest.mark.parametrize("x, y", [((0, 0, 0), (0, 0, 0)), ((0.1, 0, 0), (0, 0.1, 0)), ((0.02, 0, 0), (0, 1e-6, 0))])
def test_round_flat_and_unknown_pixels_send_one_ray(x, y):
    own, found = asked(x, y)
    assert found["rays"] == 1 and found["spread"] == pixel_rays.FILTER * own
    assert np.linalg.norm(found["line"]) == pytest.approx(1)


def test_differences_across_edges_widen_nothing(rng):
    """Between surfaces anything may be found; no ray is wider than the surface's own footprint, and the line has unit length."""
    x, y = rng.normal(size=(2, 2000, 3)) * 10.0 ** rng.uniform(-12, 0.3, size=(2, 2000, 1))
    _, found = asked(x, y, spread=0.02)
    assert all(np.isfinite(values).all() for values in found.values())
    assert (found["spread"] <= pixel_rays.FILTER * 0.02 * (1 + 1e-9)).all() and found["rays"].max() <= pixel_rays.MOST
    np.testing.assert_allclose(np.linalg.norm(found["line"], axis=1), 1, atol=1e-9)


def test_a_level_read_at_that_footprint_has_the_pixels_variance():
    """A tent over a box of one texel, by sampling both, against a box as wide as the pixel."""
    texel, at = pixel_rays.FILTER, np.linspace(-2, 2, 4001)
    tent = np.maximum(1 - np.abs(at) / texel, 0)
    box = np.abs(at) <= texel / 2
    kernel = np.convolve(tent, box, "same")
    assert (kernel * at**2).sum() / kernel.sum() == pytest.approx(1 / 12, rel=1e-3)


def test_differences_stay_on_one_reflector_and_one_surface(rng):
    """Of two neighbours the one whose direction is nearer; none of another reflector, nor beyond the picture."""
    shape = (5, 7)
    reflector = np.repeat([[0, 0, 0, 1, 1, -1, 1]], 5, 0).astype(np.int32)
    origin, direction = (rng.normal(size=(*shape, 3)).astype(np.float32) for _ in range(2))
    zero = np.zeros(shape, np.float32)
    found = pixel_rays.differences(RayMap(origin, direction, direction, reflector, zero, zero, ("a", "b")))
    pixels = np.argwhere(reflector >= 0)
    for steps, (turned, moved) in zip(((0, 1), (1, 0)), found, strict=True):
        for (y, x), turn, move in zip(pixels, turned, moved, strict=True):
            beside = [(s, y + s * steps[0], x + s * steps[1]) for s in (-1, 1)]
            beside = [(s, b, a) for s, b, a in beside if 0 <= b < 5 and 0 <= a < 7 and reflector[b, a] == reflector[y, x]]
            ways = [(s * (direction[b, a] - direction[y, x]), s * (origin[b, a] - origin[y, x])) for s, b, a in beside]
            wanted = min(ways, key=lambda way: (way[0] ** 2).sum(), default=(np.zeros(3), np.zeros(3)))
            np.testing.assert_allclose(turn, wanted[0])
            np.testing.assert_allclose(move, wanted[1])
