"""Issue 4, what light fields must show: `columns` and rooms that nobody tuned for, whose ball moves on without another bake, against
Cycles and against `environment` baked anew wherever the ball is. Smaller than ./dev bench yu measures it."""

from dataclasses import replace

import moving_ball_rooms
import numpy as np
import pytest
import tolerances

from reflect_addon.core import metrics
from reflect_addon.core.methods import light_field
from reflect_addon.evaluation import bench_yu_columns as room
from reflect_addon.evaluation import bench_yu_scene as scenes
from reflect_addon.evaluation.frame import open_frame
from reflect_addon.scene.bake import bake_assets
from reflect_addon.scene.load import load_assets
from reflect_addon.scene.look import read_look
from reflect_addon.scene.raytrace import trace

SIZE, PATHS = (96, 72), 16
ENVIRONMENT = {"resolution": 128, "samples": 4}
SETTINGS = {"views": 6, "view_texels": 64, "samples": 1}


def baked(scene, folder, **settings):
    with open_frame(scene, None) as snapshot:
        bake_assets(snapshot, (light_field.NAME,), folder, settings={**SETTINGS, **settings}, tracer=lambda *a, **m: trace(*a, **m, scene=scene))
        (asset,) = load_assets(snapshot, light_field.NAME, folder).values()
    return asset


@pytest.fixture(scope="module")
def of_columns(device, tmp_path_factory):
    """Its light field. Who asks opens the file again."""
    return baked(scenes.columns(), tmp_path_factory.mktemp("columns"))


def environments(scene, frames) -> list:
    """environment, baked at each frame."""
    return [room.environment_at(scene, n, **ENVIRONMENT) for n in frames]


def shares(assets, bases, frames) -> np.ndarray:
    """(assets, frames) RMSE over that of environment."""
    return np.array([[f.rmse(a) / f.rmse(b) for f, b in zip(frames.values(), bases, strict=True)] for a in assets])


def test_columns_while_the_ball_moves(of_columns, record_property):
    scene, asset = scenes.columns(), of_columns
    frames = {n: room.frame_of(scene, n, SIZE, PATHS) for n in (1, 60)}
    bases = environments(scene, frames)
    plain, depth = both_ways(asset, bases, frames, record_property)
    assert plain.max() < tolerances.LIGHT_FIELD_COLUMNS
    assert depth.max() < tolerances.LIGHT_FIELD_COLUMNS_DEPTH
    # Display values: what the eye sees of it, without the lamps' edges.
    look = read_look(scene)
    for environment, frame in zip(bases, frames.values(), strict=True):
        truth = look.apply(frame.truths[0].radiance)
        own, base = (metrics.rmse(look.apply(room.answer(a, frame.rays).radiance), truth) for a in (asset, environment))
        assert own < base


def both_ways(asset, bases, frames, record_property) -> np.ndarray:
    """(2, frames) shares of a light field without and with its depths, kept in the test's record."""
    found = shares([room.with_depth(asset, False), asset], bases, frames)
    record_property("plain and with depths", found.tolist())
    return found


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 3])
def test_rooms_like_it(seed, device, tmp_path, record_property):
    scene = moving_ball_rooms.build(seed)
    asset = baked(scene, tmp_path)
    frames = {n: room.frame_of(scene, n, SIZE, PATHS) for n in (1, moving_ball_rooms.FRAMES)}
    bases = environments(scene, frames)
    plain, depth = both_ways(asset, bases, frames, record_property)
    assert plain.max() < tolerances.LIGHT_FIELD_ROOM
    assert depth.max() < tolerances.LIGHT_FIELD_ROOM
    assert np.isfinite(room.answer(asset, frames[1].rays).radiance).all()


def test_the_focal_plane_is_nearly_the_best_of_a_scan(device, tmp_path, record_property):
    """Target Y6 on a room: the bake's own planes against each slab's best for the very rays that judge it."""
    scene = moving_ball_rooms.build(3)
    asset = baked(scene, tmp_path, depth=False, views=8)
    frames = [room.frame_of(scene, n, (160, 120), 8) for n in (1, moving_ball_rooms.FRAMES)]
    found = room.scan(asset, frames, 25)
    record_property("over_best", found.over_best())
    assert found.over_best() < tolerances.LIGHT_FIELD_FOCUS
    assert found.over_sky() < tolerances.LIGHT_FIELD_FOCUS_SKY


def test_the_ball_does_not_flicker(of_columns, record_property):
    scene = scenes.columns()
    frames = [room.frame_of(scene, n, (48, 36), 24, truths=2) for n in range(20, 28)]
    own, true = room.flicker(of_columns, frames, read_look(scene))
    record_property("flicker", own / true)
    assert own < tolerances.LIGHT_FIELD_FLICKER * true


def test_no_fetch_leaves_the_atlas(monkeypatch):
    """On the rays of the stability table: coordinates of look-ups lie inside, so that what clamps them has nothing to do."""
    from reflect_addon.core.kernel import numpy_machine, record, run_numpy
    from reflect_addon.evaluation import stability, stability_cases
    from reflect_addon.evaluation.stability_scene import Surfaces

    left = []
    fetch, sample = numpy_machine.Machine.fetch, numpy_machine.Machine.sample

    def seen(room, image, x, y):
        height, width = image.shape[:2]
        left.append(int((~((x >= room) & (x <= width - room) & (y >= room) & (y <= height - room))).sum()))

    def fetching(machine, image, x, y):
        if not sampling:
            seen(0.0, image, np.floor(x) + 0.5, np.floor(y) + 0.5)
        return fetch(machine, image, x, y)

    def sampling_too(machine, image, x, y):
        seen(0.5, image, x, y)
        sampling.append(1)
        try:
            return sample(machine, image, x, y)
        finally:
            sampling.pop()

    sampling: list[int] = []
    case = next(c for c in stability_cases.cases() if c.name.startswith("seams"))
    asset = light_field.bake(Surfaces(case.scene).job({**light_field.DEFAULTS, **stability.BAKE}, {}))
    rays = case.rays(np.random.default_rng(1), 3000, {})
    outside = replace(rays, origin=rays.origin * 7)  # nothing is promised to them, but that
    monkeypatch.setattr(numpy_machine.Machine, "fetch", fetching)
    monkeypatch.setattr(numpy_machine.Machine, "sample", sampling_too)
    for some in (rays, outside):
        for depth in (False, True):
            shown = room.with_depth(asset, depth)
            run_numpy(record(light_field.trace, shown), shown, some)
    assert len(left) > 20 and sum(left) == 0
