"""core/planning/heat.py: each pixel's error is that of its own ray, coarse first; and the colours that it is shown in."""

import time
from dataclasses import replace

import bpy  # noqa: F401  the pip module makes mathutils known
import hand_scenes
import numpy as np
import pytest

from reflect_addon.core import methods
from reflect_addon.core.lamp_hits import with_lamps
from reflect_addon.core.planning import heat as heating
from reflect_addon.core.planning.errors import errors_of, measured
from reflect_addon.core.planning.heat import FEWEST, STRIDES, heat_of
from reflect_addon.core.planning.heat_colors import LEAST, MOST, STEPS, TICKS, color_at, place_of
from reflect_addon.core.planning.samples import Sample
from reflect_addon.core.rays import Rays
from reflect_addon.core.reflected_samples import LIFT
from reflect_addon.scene.raymap_numpy import numpy_ray_map
from reflect_addon.scene.views import jobs_without_light

CAMERA = hand_scenes.camera((0, -5, 1), (0, 0, 0), (60, 44))


@pytest.fixture(scope="module")
def scene():
    """Two mirror balls on a floor with a crate, and the first one's environment map."""
    ball = hand_scenes.sphere_mesh()
    found = hand_scenes.snapshot(
        ("Ball", ball, hand_scenes.placed(scale=0.8), hand_scenes.MIRROR),
        ("Crate", hand_scenes.cube_mesh(), hand_scenes.placed((0.9, -2.0, 0.9), 0.4), hand_scenes.MATTE),
        ("Floor", hand_scenes.quad_mesh(), hand_scenes.placed((0, 0, -1), 4.0), hand_scenes.MATTE),
        ("Other", ball, hand_scenes.placed((-1.6, 0, 0), 0.6), hand_scenes.MIRROR),
    )
    job_of, method = jobs_without_light(found), methods.get("environment")
    asset = method.bake(replace(job_of(found.reflectors()[0]), settings={**method.DEFAULTS, "resolution": 32, "samples": 1}))
    return found, job_of, numpy_ray_map(found, CAMERA), asset


def test_each_pixel_has_its_own_rays_error(scene):
    found, job_of, rays, asset = scene
    *slices, last = heat_of(rays, {"Ball": asset}, found.reflectors(), job_of)
    mask = rays.reflector == 0
    assert mask.sum() > 200 and (rays.reflector == 1).sum() > 50
    origin = rays.origin[mask] + rays.normal[mask] * LIFT * found.diagonal()
    some = Rays(origin.astype("f"), rays.direction[mask])
    job = job_of(found.reflectors()[0])
    truth = with_lamps(job.trace(some), some, found, job.intersect)
    wanted = errors_of(asset, Sample(some, truth, np.zeros(len(some))))[0]
    assert truth.hit.sum() > 20 and 0 < (wanted > 1).mean() < 1
    np.testing.assert_allclose(last.degrees[mask], wanted, rtol=1e-5, atol=1e-5)
    assert last.seen == measured(last.degrees[mask].astype(float)) and last.share == 1.0 and np.isclose(last.mean, wanted.mean())
    assert np.isnan(last.degrees[~mask]).all(), "nothing is said of what has no asset or is no reflector"


def test_it_is_coarse_first_and_only_becomes_finer(scene):
    found, job_of, rays, asset = scene
    rounds = [h for h in heat_of(rays, {"": asset}, found.reflectors(), job_of) if h is not None]
    assert len(rounds) == len(STRIDES)
    for stride, one, after in zip(STRIDES, rounds, rounds[1:], strict=False):
        grid = np.zeros_like(rays.reflector, bool)
        grid[::stride, ::stride] = True
        known = grid & rays.covered()
        assert np.array_equal(one.degrees[known], rounds[-1].degrees[known]) and one.share < after.share
        assert np.isfinite(one.degrees).sum() > (0.8 if stride < 8 else 0.4) * rays.covered().sum(), "a coarse round covers the view"
    assert np.array_equal(np.isfinite(rounds[-1].degrees), rays.covered())


def test_a_slice_takes_as_long_as_it_may(scene, monkeypatch):
    """Where every ray costs a millisecond: the first has one, later ones as many as there is time for, and never fewer than FEWEST."""
    found, job_of, rays, asset = scene
    real, sizes = heating._errors, []

    def slow(rays, pixels, *more):
        sizes.append(len(pixels))
        time.sleep(1e-3 * len(pixels))
        return real(rays, pixels, *more)

    monkeypatch.setattr(heating, "_errors", slow)
    list(heat_of(rays, {"": asset}, found.reflectors(), job_of))
    assert sizes[0] == 1 and max(b / max(sizes[: n + 1]) for n, b in enumerate(sizes[1:])) <= heating.FASTER
    assert FEWEST <= max(sizes) <= 1000 * heating.SLICE


def test_what_is_drawn_or_missing_has_nothing_to_measure(scene):
    found, job_of, rays, asset = scene
    drawn = replace(asset, kind=next(name for name in methods.names() if name not in methods.gathering()))
    for assets in ({}, {"": drawn}):
        assert list(heat_of(rays, assets, found.reflectors(), job_of)) == []


def test_colours_are_in_order_and_told_apart_without_hue():
    places = place_of(np.array([0.0, *TICKS, 1e3]))
    assert places[0] == places[1] == 0.0 and places[-1] == places[-2] == 1.0 and np.all(np.diff(place_of(TICKS)) > 0.05)
    assert TICKS[0] == LEAST and TICKS[-1] == MOST
    np.testing.assert_allclose(color_at(np.linspace(0, 1, len(STEPS))), STEPS)
    linear = np.where(STEPS <= 0.04045, STEPS / 12.92, ((STEPS + 0.055) / 1.055) ** 2.4)
    lightness = np.cbrt(linear @ (0.2126, 0.7152, 0.0722))
    steps = np.diff(lightness)
    assert steps.min() > 0.5 * steps.max() > 0, "each step is about as much lighter as the next"
