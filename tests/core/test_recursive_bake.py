"""The asset of `recursive`: what it holds, what it says of itself, and what makes it old."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh
from mesh_scenes import MIRROR, job, smooth_mirror, snapshot, tracer
from mirror_rooms import one_mirror, pane, things, two_mirrors

from reflect_addon.core import methods
from reflect_addon.core.asset_files import load_asset, save_asset
from reflect_addon.core.errors import ReflectError
from reflect_addon.core.kernel import record, run_numpy
from reflect_addon.core.methods import environment, layered_distance, recursive
from reflect_addon.core.rays import Rays
from reflect_addon.core.remake import REFLECTOR
from reflect_addon.core.spaces import STATUS_FELL_BACK
from reflect_addon.scene.bake import bake_assets
from reflect_addon.scene.freshness import has_settings, is_stale

SETTINGS = {**recursive.DEFAULTS, **layered_distance.DEFAULTS, "resolution": 8, "samples": 1, "sky_error": 0}


def bake(scene, **settings):
    return recursive.bake(job(scene, {**SETTINGS, **settings}))


def test_a_pane_is_two_mirrors_and_a_ball_none():
    assert recursive.report(bake(one_mirror())) == "2 planar mirrors are drawn, each where its front is seen."
    ball = snapshot(smooth_mirror(trimesh.creation.icosphere(3, 0.5)), **things())
    assert "alone" in recursive.report(bake(ball))


def test_rough_mirrors_are_left_to_distance_maps():
    for roughness, count in ((0.7, 2), (0.71, 0)):
        scene = snapshot(pane(3, 2, (-1.5, 0, 1.0), (1, 0, 0), replace(MIRROR, roughness=roughness)), **things())
        assert len(recursive.drawn_mirrors(scene)[0]) == count


def test_it_names_whose_surfaces_are_drawn():
    scene = two_mirrors()
    asset = bake(scene)
    assert [p.instance for p in asset.parts if p.kind == REFLECTOR] == ["Mirror"]
    assert {p.instance for p in asset.parts if p.kind == "surface"} == {"Mirror", "Other", "Torus", "Rock", "Floor"}
    hidden = tuple(replace(i, visible_glossy=i.name != "Rock") for i in scene.instances)
    assert "Rock" not in {p.instance for p in bake(replace(scene, instances=hidden)).parts}


def test_the_sky_is_what_is_seen_with_everything_hidden_and_is_traced_once(rng):
    made, scene = [], two_mirrors()
    one = job(scene, SETTINGS, made=made)
    first = recursive.bake(one)
    second = recursive.bake(replace(one, reflector=scene.reflectors()[1]))
    assert len(made) == 1 and set(made[0][1]) == {i.name for i in scene.instances}
    assert second.images["sky_radiance_tx"] is first.images["sky_radiance_tx"]
    sky = recursive.sky_of(first)
    d = rng.normal(size=(50, 3))
    rays = Rays(np.zeros((50, 3), np.float32), (d / np.linalg.norm(d, axis=1, keepdims=True)).astype(np.float32))
    alone = environment.capture(one, "environment", tuple(i.name for i in scene.instances))
    found, wanted = (run_numpy(record(environment.trace, asset), asset, rays).radiance for asset in (sky, alone))
    np.testing.assert_array_equal(found, wanted)


def test_what_makes_it_old():
    scene = replace(one_mirror(), light_hash="day")
    mirror = scene.reflectors()[0]
    inputs = recursive.inputs(scene, (mirror,))
    shift = np.eye(4)
    shift[0, 3] = 1.0
    moved = tuple(replace(i, world_from_object=shift @ i.world_from_object) for i in scene.instances)
    assert inputs == recursive.inputs(replace(scene, instances=moved), (mirror,))
    assert inputs != recursive.inputs(replace(scene, instances=scene.instances[:-1]), (mirror,))
    assert inputs != recursive.inputs(replace(scene, light_hash="night"), (mirror,))


def test_what_decides_only_what_is_drawn_is_remembered_and_not_baked_again(tmp_path):
    scene, made = replace(one_mirror(), light_hash="day", geometry_hash="here"), []
    for depth, again in ((3, True), (5, False), (5, False)):
        made.clear()
        settings = {**SETTINGS, "depth": depth, "surface_samples": 1, "surface_levels": 1}
        (*_, path) = bake_assets(scene, ["recursive"], tmp_path, settings=settings, tracer=tracer(scene, made=made))
        assert bool(made) == again and load_asset(path).settings["depth"] == depth
        assert not is_stale(scene, load_asset(path)) and has_settings(load_asset(path), {**settings, "depth": 8})
    assert not has_settings(load_asset(path), {**settings, "samples": 2})


def test_it_comes_back_from_disk_and_is_joined(tmp_path):
    scene = one_mirror()
    asset = bake(scene)
    save_asset(asset, tmp_path / "recursive-Mirror")
    back = load_asset(tmp_path / "recursive-Mirror")
    joined = back.joined(layered_distance.bake(job(scene, SETTINGS)))
    assert back.settings == asset.settings and back.parts == asset.parts
    ray = Rays(np.array([[-1.4, 0, 1]], np.float32), np.array([[1, 0, 0]], np.float32))
    assert run_numpy(record(recursive.trace, joined), joined, ray).status == STATUS_FELL_BACK


@pytest.mark.parametrize("name, value", [("depth", 0), ("least_energy", -1.0), ("least_energy", 2.0), ("endless", 1)])
def test_impossible_settings_are_refused(name, value):
    with pytest.raises(ReflectError, match=name):
        methods.check_settings(("recursive",), {name: value})


def test_it_draws_and_does_not_gather():
    assert "recursive" not in methods.gathering() and methods.with_required(("recursive",)) == ("layered_distance", "recursive")
