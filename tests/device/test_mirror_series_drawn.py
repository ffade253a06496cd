"""Beyond the last level of two facing mirrors, drawn: what depth 3 shows is what deeper views show, beside Embree, still and bounded."""

from dataclasses import replace

import hand_scenes
import numpy as np
import pytest
import tolerances
from mirror_rooms import baked, two_mirrors
from test_recursive_drawn import CAMERA, Seen, renderer_of

DEPTHS = (2, 3, 8)


def drawn_with(found, **settings):
    """A renderer of what was baked, with other settings of what is drawn."""
    assets = {name: replace(one, settings={**one.settings, **settings}) for name, one in found.assets.items()}
    return renderer_of(replace(found, assets=assets))


@pytest.fixture(scope="module")
def facing_baked():
    return baked(two_mirrors())


@pytest.fixture(scope="module")
def facing(device, facing_baked):
    """Renderers by depth."""
    made = {depth: drawn_with(facing_baked, depth=depth) for depth in DEPTHS}
    yield made
    for renderer in made.values():
        renderer.free()


def maps_only(renderer, camera=CAMERA):
    """As it was without: distance maps beyond the last level."""
    renderer.mirrors.continues = False
    picture = renderer.picture(camera)[..., :3]
    renderer.mirrors.continues = True
    return picture


def test_the_last_level_does_not_show(facing):
    """At depths 2 and 3 pictures differ less from depth 8 than they do with distance maps there."""
    deep = facing[8].picture(CAMERA)[..., :3]
    for depth in (2, 3):
        off, before = (np.abs(p - deep).max(-1) for p in (facing[depth].picture(CAMERA)[..., :3], maps_only(facing[depth])))
        assert before.mean() > 0 and off.mean() < tolerances.SERIES_OVER_MAPS * before.mean()


@pytest.mark.parametrize("camera", [CAMERA, hand_scenes.camera((1.2, -1.0, 1.3), (-1.5, 0.2, 0.7), (96, 72), fov=1.4)], ids=["near", "wide"])
def test_a_series_is_what_rays_find(facing, camera):
    """Embree follows 20 reflections; energy included, since each pixel is its own path's."""
    seen = Seen(facing[3], facing[3].scene.snapshot, camera, bounces=20)
    assert np.mean(seen.error > 10 * tolerances.RECURSIVE_RADIANCE) < tolerances.RECURSIVE_EDGE
    assert seen.radiance.mean() < (1 + tolerances.RECURSIVE_RADIANCE) * seen.truth.radiance.mean()


def test_an_even_world_is_never_brighter_than_itself(device):
    """Every surface sends out 1, so no sum over mirrors that reflect less than all of it is more, and each leg leaves a share."""
    scene = two_mirrors()
    renderer = renderer_of(baked(scene, lambda place, owner: np.ones((len(place), 3)), depth=2))
    shown = renderer.answer(CAMERA)
    inside = shown.status > 0
    assert inside.sum() > 1000 and shown.radiance[inside].max() <= 1 + tolerances.GLOSSY_EVEN
    renderer.free()


def test_a_frame_at_rest_stays(facing):
    """Frames are the same to the bit, whatever was drawn before them: nothing is taken from there."""
    renderer, other = facing[3], hand_scenes.camera((0.5, -0.5, 1.0), (-1.5, 0.2, 0.7), (128, 96), fov=0.9)
    renderer.picture(other)  # targets have now the size that both need
    first = renderer.picture(CAMERA)
    assert np.array_equal(renderer.picture(CAMERA), first)
    renderer.picture(other)
    assert np.array_equal(renderer.picture(CAMERA), first)


def test_a_series_is_a_pass_for_each_mirror_that_ends(facing):
    """Nothing is compiled, uploaded or allocated, and no view is added."""
    renderer = facing[3]
    renderer.prepare()
    renderer.picture(CAMERA), maps_only(renderer)
    counts = [renderer.counts()]
    maps_only(renderer)
    counts.append(renderer.counts())
    renderer.picture(CAMERA)
    counts.append(renderer.counts())
    more = {name: (counts[2][name] - counts[1][name]) - (counts[1][name] - counts[0][name]) for name in counts[0]}
    assert more["passes"] == 1 and all(more[name] == 0 for name in ("views", "compiles", "uploads", "allocations"))


def test_deep_levels_draw_fewer_triangles_and_show_the_same(facing, facing_baked):
    """From the second level on, where their switch is on; the first level's meshes are whole."""
    fine = drawn_with(facing_baked, depth=8, cull_coarse_meshes=False)
    coarse, triangles = facing[8].picture(CAMERA), dict(facing[8].mirrors.triangles)
    whole, all_of_them = fine.picture(CAMERA), dict(fine.mirrors.triangles)
    fine.free()
    assert triangles.keys() == all_of_them.keys() and triangles[1] == all_of_them[1]
    assert all(triangles[depth] <= all_of_them[depth] for depth in triangles) and triangles[8] < 0.5 * all_of_them[8]
    assert np.abs(coarse - whole)[..., :3].mean() < tolerances.COARSE_PICTURE
