"""Under a bare sky the environment's resolution follows what the sky shows; anywhere else it is what was asked for."""

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
BALL, WALL = (Instance(name, name, 0, np.eye(4), ()) for name in ("Ball", "Wall"))


class Sky:
    """Radiance 1 with ripples of a given fineness; remembers what it was asked."""

    def __init__(self, ripples=0.0, noise=0.0, hits=False):
        self.ripples, self.noise, self.hits, self.asked = ripples, noise, hits, []

    def __call__(self, rays, hide=(), samples=1):
        self.asked.append((len(rays), samples))
        d = rays.direction.astype(np.float64)
        value = 1 + 0.5 * np.sin(self.ripples * d).prod(-1)
        value = value + self.noise * np.random.default_rng(len(self.asked)).normal(size=len(d))
        radiance = np.repeat(value[:, None], 3, 1).astype(np.float32)
        hit = np.full(len(d), self.hits)
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
