"""core/lobe_rays.py: the rays of a rough surface against GGX's closed forms; edge cases."""

import numpy as np
import pytest

from reflect_addon.core import lobe_rays
from reflect_addon.core.kernel import evaluate, record_function
from reflect_addon.core.shading import roughness_spread
from reflect_addon.core.snapshot import Material


def rays_of(spread, most=lobe_rays.MOST):
    program = record_function(lobe_rays.count, lobe_rays.COUNT_INPUTS)
    return float(evaluate(program, {"spread": np.float32([spread]), "most": np.float32([most])})["rays"][0])


def lobe_of(normal, mirrored, alpha, rays, dtype=np.float64):
    """(directions (rays, 3), weights (rays,))."""
    angle = np.pi * (3 - np.sqrt(5)) * np.arange(rays)
    full = lambda v: np.broadcast_to(np.asarray(v, dtype), (rays, *np.shape(v))).copy()  # noqa: E731
    inputs = {
        "mirrored": full(mirrored), "normal": full(normal), "alpha": full(alpha),
        "turn": np.stack([np.cos(angle), np.sin(angle)], -1).astype(dtype),
        "share": (np.arange(rays, dtype=dtype) + 0.5) / rays,
    }  # fmt: skip
    found = evaluate(record_function(lobe_rays.direction, lobe_rays.DIRECTION_INPUTS), inputs)
    return found["direction"], found["weight"]


def test_a_mirror_sends_one_ray():
    assert rays_of(0.0) == 1 and rays_of(lobe_rays.FINE) == 1
    assert rays_of(roughness_spread(Material("m", roughness=0.05))) == 1


def test_rays_grow_with_the_lobes_area_up_to_a_limit():
    assert rays_of(2 * lobe_rays.FINE) == 4 and rays_of(3 * lobe_rays.FINE) == 9
    assert rays_of(1.0) == lobe_rays.MOST and rays_of(1.0, lobe_rays.LIVE) == lobe_rays.LIVE


@pytest.mark.parametrize("normal", [(0, 0, 1), (0, 0, -1), (0.6, 0, 0.8), (-0.48, 0.64, -0.6)])
def test_no_roughness_is_the_mirror_ray(normal):
    normal = np.asarray(normal, float)
    side = np.cross(normal, [0.3, 0.5, 0.2])
    mirrored = normal * 0.5 + side / np.linalg.norm(side) * np.sqrt(0.75)
    found, weight = lobe_of(normal, mirrored, 1e-6, 16)
    np.testing.assert_allclose(found, np.tile(mirrored, (16, 1)), atol=1e-4)
    assert (weight == 1).all()


@pytest.mark.parametrize("alpha", [0.01, 0.09, 0.25])
def test_seen_from_above_slopes_are_ggxs(alpha):
    """P(slope < r) = r^2 / (r^2 + alpha^2) [Walter et al. 2007]; a slope of tan t turns the ray by 2 t."""
    found, _ = lobe_of((0, 0, 1), (0, 0, 1.0), alpha, 4000)
    slope = np.tan(np.arccos(np.clip(found[:, 2], -1, 1)) / 2)
    for r in (0.5 * alpha, alpha, 3 * alpha):
        assert np.mean(slope < r) == pytest.approx(r**2 / (r**2 + alpha**2), abs=0.02)


@pytest.mark.parametrize("cosine", [0.8, 0.4, 0.15])
def test_slanted_views_see_the_normals_that_ggx_shows_them(cosine):
    """The mean over visible normals of f(h) is the integral of D(h) (v.h)+ f(h) / (v.n) G1; here f = h.x and h.z, by a sum."""
    alpha, viewer = 0.3, np.array([np.sqrt(1 - cosine**2), 0, cosine])
    found, _ = lobe_of((0, 0, 1), (-viewer[0], 0, cosine), alpha, 6000)
    half = found + viewer
    half /= np.linalg.norm(half, axis=1, keepdims=True)
    z = (np.arange(1000) + 0.5) / 1000
    phi = 2 * np.pi * (np.arange(500) + 0.5) / 500
    z, phi = (a.ravel() for a in np.meshgrid(z, phi))
    h = np.stack([np.sqrt(1 - z * z) * np.cos(phi), np.sqrt(1 - z * z) * np.sin(phi), z], -1)
    weight = alpha**2 / (np.pi * (z * z * (alpha**2 - 1) + 1) ** 2) * np.maximum(h @ viewer, 0)
    expected = (weight[:, None] * h).sum(0) / weight.sum()
    np.testing.assert_allclose(half.mean(0)[[0, 2]], expected[[0, 2]], atol=0.01)


@pytest.mark.parametrize("cosine", [0.9, 0.4, 0.15])
def test_weights_are_what_one_bounce_reflects(cosine):
    """Their mean is the integral of D(h) G2 (v.h) / ((v.n) (h.n)) over facets whose rays leave the surface; by a sum."""
    alpha, viewer = 0.3, np.array([np.sqrt(1 - cosine**2), 0, cosine])
    _, weight = lobe_of((0, 0, 1), (-viewer[0], 0, cosine), alpha, 6000)
    z = (np.arange(2000) + 0.5) / 2000
    z, phi = (a.ravel() for a in np.meshgrid(z, 2 * np.pi * (np.arange(500) + 0.5) / 500))
    h = np.stack([np.sqrt(1 - z * z) * np.cos(phi), np.sqrt(1 - z * z) * np.sin(phi), z], -1)
    facing = h @ viewer
    out = 2 * facing * z - cosine
    each = lambda c: (np.sqrt(1 + alpha**2 * (1 / np.maximum(c, 1e-6) ** 2 - 1)) - 1) / 2  # noqa: E731  Smith's Lambda
    density = alpha**2 / (np.pi * (z * z * (alpha**2 - 1) + 1) ** 2)
    kept = np.where((out > 0) & (facing > 0), density * facing / cosine / (1 + each(cosine) + each(out)), 0)
    assert weight.mean() == pytest.approx(kept.sum() * 2 * np.pi / len(z), abs=0.01)


def test_grazing_and_null_inputs_are_finite(rng):
    for dtype in (np.float32, np.float64):
        for mirrored in ((1, 0, 0), (1, 0, 1e-8), (0, 0, 1), (0, 0, 0), (0.6, 0, -0.8)):
            for alpha in (0, 1e-8, 1.0):
                found, weight = lobe_of((0, 0, 1), mirrored, alpha, 16, dtype)
                assert np.isfinite(found).all() and (weight >= 0).all() and (weight <= 1).all()
                if np.any(mirrored):
                    assert (found[weight > 0, 2] > 0).all()
