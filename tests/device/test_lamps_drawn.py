"""gpu/virtual_lamps.py: a lamp's light is added to what a reflected ray meets behind it, once, and lamps before the sky are there too."""

from dataclasses import replace

import hand_scenes
import numpy as np
import pytest
import tolerances
from lamp_scenes import LIGHT, lit_scene, lit_tracer
from mesh_scenes import intersect
from virtual_scenes import LIFT, SURFACES, baked

from reflect_addon.core import surface_radiance
from reflect_addon.core.lamp_hits import with_lamps

CAMERA = hand_scenes.camera((3, -0.5, 1.2), (0, 0, 0.5), (240, 180), fov=0.45)
SCENE = lit_scene()


@pytest.fixture(scope="module")
def drawn(device):
    from reflect_addon.gpu.renderer import Renderer

    found = baked(SCENE)
    surfaces = surface_radiance.bake(SCENE, lit_tracer(SCENE), (*SCENE.instances, *SCENE.lamps), SURFACES)
    renderer = Renderer(SCENE, found.assets, surfaces=surfaces)
    yield renderer
    renderer.free()


@pytest.fixture(scope="module")
def frame(drawn):
    """(answer, truth with lamps, covered pixels, (N,) the lamp that a pixel shows or -1)."""
    answer, ray_map = drawn.answer(CAMERA), drawn.ray_map(CAMERA)
    mask, rays = ray_map.covered(), ray_map.rays()
    rays = replace(rays, origin=(rays.origin + LIFT * ray_map.normal[mask]).astype(np.float32))
    traced = lit_tracer(SCENE)(rays)
    first = len(traced.object_names)
    truth = with_lamps(traced, rays, SCENE, intersect(SCENE))
    return answer, truth, mask, np.where(truth.object >= first, truth.object - first, -1), traced.hit


@pytest.mark.parametrize("lamp", range(len(LIGHT)))
def test_light_is_added_once_and_stands_where_the_lamp_is(frame, lamp):
    answer, truth, mask, shown, behind = frame
    mine = shown == lamp
    assert mine.sum() > 50
    off = np.abs(answer.radiance[mask] - truth.radiance).max(1)
    assert not (mine & behind).any() or (off[mine & behind] < 0.5).mean() > 0.95
    place = np.linalg.norm(answer.position[mask] - truth.position, axis=1)[mine] / SCENE.diagonal()
    assert (place < 1e-3).mean() > 1 - 4 * tolerances.VIRTUAL_MISSED


def test_before_the_sky_a_lamp_shows_its_own_light(frame):
    answer, _, mask, shown, behind = frame
    alone = (shown >= 0) & ~behind
    assert alone.sum() > 20 and ((shown >= 0) & behind).sum() > 20
    light = np.array(list(LIGHT.values()))[shown[alone]]
    assert (np.abs(answer.radiance[mask][alone] - light).max(1) < 0.02).mean() > 0.95


def test_no_lamp_shines_where_none_is(frame):
    answer, truth, mask, shown, behind = frame
    assert (np.abs(answer.radiance[mask] - truth.radiance).max(1)[(shown < 0) & behind] > 1.0).mean() < tolerances.VIRTUAL_MISSED


def test_frames_without_positions_are_the_same(drawn, frame):
    """But for pixels whose searches, started from the last frame's ends, find what that one missed."""
    without = drawn.answer(CAMERA, positions=False)
    off = np.abs(without.radiance - frame[0].radiance).max(-1)[frame[2]]
    assert (off > 0.01).mean() < tolerances.VIRTUAL_FALSE and np.array_equal(without.coverage, frame[0].coverage)
