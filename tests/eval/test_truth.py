"""Truth is kept under everything it depends on, and a damaged file is traced again, never believed."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np

from reflect_addon.core.camera import Camera
from reflect_addon.core.rays import Hits, RayMap
from reflect_addon.evaluation.truth import LIFT, key_of, lifted, truth_of

CAMERA = Camera(np.eye(4), np.eye(4), 3, 2)


def ray_map() -> RayMap:
    up, zero = np.tile(np.float32([0, 0, 1]), (2, 3, 1)), np.zeros((2, 3), np.float32)
    reflector = np.array([[-1, 0, 0], [-1, -1, 0]], np.int32)
    return RayMap(np.zeros((2, 3, 3), np.float32), up, up, reflector, zero, zero, ("Ball",))


class Tracer:
    def __init__(self):
        self.seeds = []

    def trace(self, rays, samples, seed):
        self.seeds.append(seed)
        n = len(rays)
        return Hits(*(np.full((n, 3), seed, np.float32),) * 3, np.zeros(n, np.int32), np.ones(n, bool), ("Wall",))

    def primary(self, camera, samples, seed):
        frame = np.zeros((camera.height, camera.width, 3), np.float32)
        return SimpleNamespace(combined=frame, glossy=frame)


def test_two_seeds_then_from_disk_then_again_when_damaged(tmp_path):
    tracer, kept = Tracer(), tmp_path / "truth" / "a.npz"
    for _ in range(2):
        truth = truth_of(ray_map(), CAMERA, 1.0, 4, tracer.trace, tracer.primary, kept)
        assert len(tracer.seeds) == len(set(tracer.seeds)) == 2
        assert (truth.second_radiance != truth.hits.radiance).all() and truth.hits.object_names == ("Wall",)
    kept.write_bytes(kept.read_bytes()[:200])
    truth_of(ray_map(), CAMERA, 1.0, 4, tracer.trace, tracer.primary, kept)
    assert len(tracer.seeds) == 4


def test_no_reflector_pixel_needs_no_ray():
    empty = replace(ray_map(), reflector=np.full((2, 3), -1, np.int32))
    tracer = Tracer()
    assert len(truth_of(empty, CAMERA, 1.0, 4, tracer.trace, tracer.primary).hits.radiance) == 0
    assert tracer.seeds == []


def test_the_key_knows_every_input():
    base = ray_map()
    moved = replace(base, direction=base.direction[..., ::-1].copy())
    keys = [
        key_of(base, CAMERA, "hash", 4, "5.2"),
        key_of(moved, CAMERA, "hash", 4, "5.2"),
        key_of(base, replace(CAMERA, width=4), "hash", 4, "5.2"),
        key_of(base, CAMERA, "other", 4, "5.2"),
        key_of(base, CAMERA, "hash", 5, "5.2"),
        key_of(base, CAMERA, "hash", 4, "5.3"),
    ]
    assert len(set(keys)) == len(keys) and keys[0] == key_of(ray_map(), CAMERA, "hash", 4, "5.2")


def test_rays_start_above_their_reflector():
    rays = lifted(ray_map(), diagonal=10.0)
    assert np.allclose(rays.origin, [0, 0, 10 * LIFT]) and len(rays) == 3
