"""Under a bare sky the environment's resolution follows what the sky shows; anywhere else it is what was asked for. A run traces it once."""

from dataclasses import replace

import numpy as np
import pytest

from reflect_addon.core.job import BakeJob
from reflect_addon.core.kernel import record, run_numpy
from reflect_addon.core.methods import environment
from reflect_addon.core.rays import Hits, Rays
from reflect_addon.core.snapshot import Instance, Mesh, SceneSnapshot
from reflect_addon.core.spaces import FAR

TRIANGLE = Mesh(
    np.eye(3, dtype=np.float32), np.array([[0, 1, 2]], np.int32), np.zeros((1, 3, 3), np.float32), np.zeros(1, np.int32)
)
RIPPLES = 15.0  # so fine that a map of 64 texels keeps the default's promise, and 32 do not
BALL, WALL = (Instance(name, name, 0, np.eye(4), ()) for name in ("Ball", "Wall"))

FINE = 6 * (64 + 2) ** 2  # rays of a map of 64 texels: more than of one of 16, or of 32, and the probes


class Sky:
    """Radiance 1 with ripples of a given fineness, and a fog that brightens it by so much a metre; remembers what it was asked. A hair is
    seen from where x < 0 by bundles that are fine enough to meet it."""

    def __init__(self, ripples=0.0, noise=0.0, hits=False, fog=0.0, hair=False):
        self.ripples, self.noise, self.hits, self.fog, self.hair, self.asked = ripples, noise, hits, fog, hair, []

    def __call__(self, rays, hide=(), samples=1):
        self.asked.append((len(rays), samples))
        d = rays.direction.astype(np.float64)
        value = 1 + 0.5 * np.sin(self.ripples * d).prod(-1)
        value = value + self.fog * rays.origin[:, 0] + self.noise * np.random.default_rng(len(self.asked)).normal(size=len(d))
        radiance = np.repeat(value[:, None], 3, 1).astype(np.float32)
        hit = np.full(len(d), self.hits)
        hit[0] |= self.hair and len(d) >= FINE and rays.origin[0, 0] < 0
        position = (rays.origin + np.where(hit, 2.0, FAR)[:, None] * d).astype(np.float32)
        return Hits(radiance, position, np.zeros_like(position), np.where(hit, 0, -1).astype(np.int32), hit)


def baked(sky, others=(), **settings):
    scene = SceneSnapshot("s", 1, (TRIANGLE,), (), (BALL, *others))
    settings = {**environment.DEFAULTS, "resolution": 32, "samples": 16, **settings}
    return environment.bake(BakeJob(scene, BALL, sky, None, settings))


@pytest.mark.parametrize("ripples, size", [(0.0, 32), (6.0, 32), (30.0, 128), (1000.0, 1024)])
def test_resolution_follows_the_sky(ripples, size):
    sky = Sky(ripples)
    asset = baked(sky)
    assert asset.uniforms["cube_size"] == size
    assert {samples for _, samples in sky.asked} == {1}


def test_the_look_up_keeps_the_promise(rng):
    sky = Sky(20.0)
    asset = baked(sky)
    direction = rng.normal(size=(3000, 3))
    rays = Rays(np.zeros((3000, 3), np.float32), (direction / np.linalg.norm(direction, axis=1, keepdims=True)).astype(np.float32))
    shown, truth = run_numpy(record(environment.trace, asset), asset, rays).radiance, sky(rays).radiance
    assert np.median(np.abs(shown / truth - 1)) < environment.DEFAULTS["sky_error"]


@pytest.mark.parametrize("sky, others, settings, samples", [
    (Sky(30.0), (WALL,), {}, [16]),  # something is there
    (Sky(30.0), (), {"sky_error": 0}, [16]),  # not wanted
    (Sky(30.0, hits=True), (), {}, [1, 16]),  # something is there that the snapshot does not know
    (Sky(30.0, noise=0.01), (), {}, [1, 16]),  # a sky of noise
    (Sky(30.0), (replace(WALL, visible_glossy=False),), {}, [1, 1]),  # what mirrors do not see is not there
])  # fmt: skip
def test_only_a_bare_sky_without_noise_is_refined(sky, others, settings, samples):
    asset = baked(sky, others, **settings)
    assert [s for _, s in sky.asked] == samples
    assert asset.uniforms["cube_size"] == (32 if 16 in samples else 128)


def baked_in_a_run(sky, count, methods=({},), shared=None):
    """Assets, reflector by reflector and method by method, of `count` balls in a row; methods: settings of each."""
    balls = [replace(BALL, name=f"Ball{i}", object_name=f"Ball{i}", visible_glossy=False) for i in range(count)]
    for i, ball in enumerate(balls):
        balls[i] = replace(ball, world_from_object=np.array([[1, 0, 0, i - 2.0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1.0]]))
    scene = SceneSnapshot("s", 1, (TRIANGLE,), (), tuple(balls))
    asked = [{**environment.DEFAULTS, "resolution": 16, **settings} for settings in methods]
    kept = {} if shared is None else {"shared": shared}
    return [environment.bake(BakeJob(scene, ball, sky, None, settings, **kept)) for ball in balls for settings in asked]


def same(a, b):
    return np.array_equal(a.images["radiance_tx"], b.images["radiance_tx"]) and a.uniforms == b.uniforms


def test_a_run_traces_its_sky_once_and_changes_no_asset():
    count = 3
    methods = ({}, {"resolution": 32}, {"sky_error": 0.002})
    alone, together = Sky(RIPPLES), Sky(RIPPLES)
    want, got = baked_in_a_run(alone, count, methods), baked_in_a_run(together, count, methods, {})
    assert all(map(same, want, got)) and {a.uniforms["cube_size"] for a in got} == {64, 128}
    fine = sorted(n for n, _ in together.asked if n >= FINE)
    assert fine == [FINE, 6 * 130**2], "each finer map once, for all reflectors and methods"
    first = [n for n, _ in together.asked if n < FINE]
    assert first == [n for n, _ in alone.asked if n < FINE] and len(first) == 3 * count, "each asks what stands in its way"


def test_a_sky_that_differs_from_place_to_place_is_traced_from_each():
    sky, shared = Sky(RIPPLES, fog=0.001), {}
    want, got = baked_in_a_run(Sky(RIPPLES, fog=0.001), 3), baked_in_a_run(sky, 3, shared=shared)
    assert all(map(same, want, got)) and sum(n == FINE for n, _ in sky.asked) == 3
    assert len(shared) == 1, "of skies that differ one is kept"


def test_what_only_a_finer_map_meets_stays_with_the_reflector_that_met_it():
    sky = Sky(RIPPLES, hair=True)
    got = baked_in_a_run(sky, 4, shared={})  # two of them see the hair
    assert all(map(same, baked_in_a_run(Sky(RIPPLES, hair=True), 4), got))
    assert sum(n == FINE for n, _ in sky.asked) == 3
    assert [bool(a.images["radiance_tx"][..., 3].any()) for a in got] == [True, True, False, False]
