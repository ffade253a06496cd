"""core/lobe.py against sums over many directions of the microfacet formula, and what a small lamp's highlight looks like."""

import numpy as np
import pytest
import tolerances
from analytic import unit

from reflect_addon.core import lobe
from reflect_addon.core.kernel import evaluate, record_function

MATERIAL = {"base_color": (1.0, 1.0, 1.0), "metallic": 1.0, "specular_tint": (1.0, 1.0, 1.0), "ior": 1.5, "weight": 1.0}
INPUTS = {"toward": "vec3", "normal": "vec3", "alpha": "float", "middle": "vec3", "u": "vec3", "v": "vec3"}


def light(toward, normal, alpha, middle, u, v) -> np.ndarray:
    """(N,) share of a lamp's radiance that a white metal sends to the eye."""

    def kernel(k, scope, toward, normal, alpha, middle, u, v):
        material = {n: k.vec3(*v) if isinstance(v, tuple) else v for n, v in MATERIAL.items()}
        return {"light": lobe.lamp_light(k, scope, toward, normal, alpha, (middle, u, v), material)}

    program = record_function(kernel, INPUTS, options={"has_metal": True, "has_dielectric": False})
    values = dict(zip(INPUTS, (toward, normal, alpha, middle, u, v), strict=True))
    count = max(len(np.atleast_2d(v)) for v in values.values() if np.ndim(v))
    wide = {n: np.broadcast_to(v, (count, 3) if INPUTS[n] == "vec3" else count) for n, v in values.items()}
    return evaluate(program, wide)["light"][:, 0]


def density(toward, normal, alpha, out) -> np.ndarray:
    """BRDF times cosine of GGX with Smith's shadowing, for a reflectance of 1 [Walter et al. 2007; Heitz 2014]."""

    def smith(cosine):
        return (np.sqrt(1 + alpha**2 * (1 / np.maximum(cosine, 1e-6) ** 2 - 1)) - 1) / 2

    facet = unit(out + toward) @ normal
    d = alpha**2 / (np.pi * (facet**2 * (alpha**2 - 1) + 1) ** 2)
    cos_in, cos_out = toward @ normal, out @ normal
    return np.where(cos_out > 0, d / (1 + smith(cos_in) + smith(cos_out)) / (4 * cos_in), 0.0)


def summed(toward, normal, alpha, middle, u, v, side=300) -> float:
    """The same as `light`, over side x side pieces of the lamp."""
    s, t = np.meshgrid(*[(np.arange(side) + 0.5) / side * 2 - 1] * 2)
    at = middle + s[..., None] * u + t[..., None] * v
    far = np.linalg.norm(at, axis=-1)
    face = np.cross(u, v) * 4 / side**2
    solid = np.maximum(-(at @ face), 0) / far**3
    return float((density(toward, normal, alpha, at / far[..., None]) * solid).sum())


def scenes(rng, count: int, alpha: float, size: float):
    """Lamps of half side `size` at distance 2, about where the lobe looks, seen from up to 74 degrees."""
    for _ in range(count):
        toward = rng.normal(size=3)
        toward[2] = abs(toward[2]) + 0.5
        toward = unit(toward)
        out = unit(toward * [-1, -1, 1] + 2 * alpha * rng.normal(size=3))
        out[2] = abs(out[2])
        face = unit(-out + 0.3 * rng.normal(size=3))
        u = unit(np.cross(face, rng.normal(size=3)))
        yield toward, np.array([0, 0, 1.0]), alpha, 2 * out, u * size, np.cross(face, u) * size * 0.7


@pytest.mark.parametrize("alpha", [0.04, pytest.param(0.16, marks=pytest.mark.slow), 0.36])
@pytest.mark.parametrize("size", [0.01, 0.1, 0.3, 1.0])
def test_the_sum_over_edges_is_the_integral(rng, alpha, size):
    cases = list(scenes(rng, 40, alpha, size))
    wanted = np.array([summed(*case) for case in cases])
    found = np.array([light(*(np.asarray(c)[None] if np.ndim(c) else c for c in case))[0] for case in cases])
    away = np.abs(found - wanted) / wanted.max()
    assert np.median(away) < tolerances.LOBE_MEDIAN[size]
    assert away.max() < tolerances.LOBE_WORST[size]


def test_a_lamp_shines_to_one_side():
    toward, normal = unit(np.array([0.3, 0.1, 1.0])), np.array([0, 0, 1.0])
    out = 2 * toward * [-1, -1, 1]
    u, v = np.array([0.2, 0, 0]), np.array([0, 0.2, 0])
    assert light(toward[None], normal, 0.1, out, v, u)[0] > 0.1, "u x v looks down"
    assert light(toward[None], normal, 0.1, out, u, v)[0] == 0


def test_a_lamp_below_the_surface_gives_nothing(rng):
    toward = unit(np.array([0.9, 0.1, 0.3]))
    below = np.array([-1.5, 0.2, -0.6])
    u = unit(np.cross(below, [0, 0, 1.0])) * 0.3
    assert light(toward[None], np.array([0, 0, 1.0]), 0.3, below, u, np.cross(u, unit(below)))[0] == 0


@pytest.mark.parametrize("roughness", [0.2, 0.3, 0.4])
def test_the_width_of_a_highlight_is_ggxs(roughness):
    """Over a plane that is looked at from above, slopes x have the density 1 / (alpha^2 + x^2)^2: half of its peak at
    x = alpha (sqrt 2 - 1)^(1/2)."""
    alpha = roughness**2
    x = np.linspace(0, 0.4, 4001)
    normal = unit(np.stack([np.sin(x), 0 * x, np.cos(x)], -1))
    found = light(np.array([[0, 0, 1.0]]), normal, alpha, np.array([0, 0, 3.0]), *np.array([[0, 1e-3, 0], [1e-3, 0, 0]]))
    half = x[np.argmin(np.abs(found - found.max() / 2))]
    assert np.argmax(found) == 0
    assert np.tan(half) == pytest.approx(alpha * np.sqrt(np.sqrt(2) - 1), rel=tolerances.HIGHLIGHT_WIDTH)
