"""core/mirror_march.py and glossy_window.py: rays followed through a picture of two walls, one before the other, against where they meet them."""

from types import SimpleNamespace

import numpy as np
import pytest
import tolerances
from mirror_views import camera

from reflect_addon.core import mirror_march
from reflect_addon.core.glossy_window import FINEST, MOST_PIXELS, fineness, widened
from reflect_addon.core.kernel import evaluate, record_function
from reflect_addon.core.spaces import FAR

VIEW = camera((0, 0, 0), (0, 10, 0), size=(200, 150))
NEAR, WALL, HALF = 6.0, 10.0, 0.5  # m: a strip at y = 6 for |x| < 0.5, and a wall at y = 10 below z = 2; sky above it


def meets(origin, direction):
    """(distance, which: 0 the strip, 1 the wall, 2 the sky) of rays."""
    strip, wall = ((y - origin[:, 1]) / direction[:, 1] for y in (NEAR, WALL))
    on_strip = np.abs(origin[:, 0] + strip * direction[:, 0]) < HALF
    on_wall = origin[:, 2] + wall * direction[:, 2] < 2.0
    return np.where(on_strip, strip, np.where(on_wall, wall, FAR)), np.where(on_strip, 0, np.where(on_wall, 1, 2))


def picture():
    """picture_tx and place_tx: red is the strip, green the wall, blue the sky."""
    rays = VIEW.primary_rays()
    far, which = meets(rays.origin.astype(float), rays.direction.astype(float))
    place = rays.origin + rays.direction * far[:, None]
    shape = (VIEW.height, VIEW.width, 4)
    alpha = np.ones((len(far), 1))
    return {n: np.hstack([v, alpha]).reshape(shape).astype(np.float32) for n, v in (("picture_tx", np.eye(3)[which]), ("place_tx", place))}


def marched(origin, direction, window=None):
    clip, count = VIEW.clip_from_world(), len(origin)
    half = np.array([VIEW.width, VIEW.height]) / 2
    values = {
        "start": origin, "direction": direction, "eye": (0, 0, 0), "forward": (0, 1, 0), "row_x": half[0] * (clip[0] + clip[3]),
        "row_y": half[1] * (clip[1] + clip[3]), "row_w": clip[3], "window": window or (0, 0, VIEW.width, VIEW.height),
        "footprint": 2 / (VIEW.clip_from_camera[1, 1] * VIEW.height), "reach": 200.0,
    }  # fmt: skip
    wide = {n: np.broadcast_to(np.asarray(v, np.float32), (count, *np.shape(v)[-1:]) if np.ndim(v) else count) for n, v in values.items()}
    program = record_function(mirror_march.march, mirror_march.INPUTS, mirror_march.IMAGES)
    return evaluate(program, wide, SimpleNamespace(images=picture(), uniforms={}))


def bundle(rng, count=2000):
    """Rays from a floor half a metre below the eye, a lobe about the way on."""
    origin = np.column_stack([rng.uniform(-1, 1, count), rng.uniform(2, 4, count), np.full(count, -0.5)])
    direction = np.column_stack([rng.normal(0, 0.15, count), np.ones(count), rng.uniform(0.02, 0.5, count)])
    return origin, direction / np.linalg.norm(direction, axis=1, keepdims=True)


def test_rays_meet_what_they_meet(rng):
    origin, direction = bundle(rng)
    far, which = meets(origin, direction)
    found = marched(origin, direction)
    said = found["found"] > 0.5
    assert said.mean() > 0.8
    right = said & (found["radiance"].argmax(-1) == which)
    assert right.sum() > (1 - tolerances.MARCHED_WRONG) * said.sum()
    for each in range(2):
        mine = right & (which == each)
        assert mine.sum() > 100 and np.median(np.abs(found["distance"][mine] / far[mine] - 1)) < tolerances.MARCHED_DISTANCE
    assert (found["distance"][right & (which == 2)] == np.float32(FAR)).all()


def test_what_leaves_the_window_is_not_answered(rng):
    origin, direction = bundle(rng, 200)
    window = (0, 0, VIEW.width, VIEW.height // 3)
    found = marched(origin, np.broadcast_to([0.0, 0.6, 0.8], direction.shape), window)
    assert (found["found"] == 0).all() and all(np.isfinite(v).all() for v in found.values())


def test_any_ray_has_a_finite_answer(rng):
    origin, direction = bundle(rng, 500)
    anywhere = rng.normal(size=direction.shape)
    anywhere[0], anywhere[1] = 0.0, (0, -1, 0)  # no direction; straight back to the eye's plane
    found = marched(origin, anywhere / np.maximum(np.linalg.norm(anywhere, axis=1, keepdims=True), 1e-9))
    assert all(np.isfinite(v).all() for v in found.values())


@pytest.mark.parametrize("lens", [1.2, 3.0])
def test_windows_of_rough_mirrors_are_wider(lens):
    view = camera((0, 0, 1), (0, 10, 0), size=(200, 100), lens=lens)
    window = (20, 10, 60, 40)
    assert widened(window, 0.0, view) == window
    x, y, width, height = widened(window, 0.1, view)
    margin = 20 - x
    assert 0 < margin == 10 - y and (width, height) == (60 + 2 * margin, 40 + 2 * margin)
    assert margin == np.ceil(14 * 0.01 * lens * 50)
    assert widened(window, 1.0, view)[0] == 20 - 200


def test_narrow_lobes_are_drawn_finer():
    """Those between a picture's pixel and several; a picture that is fine enough, or large, costs nothing more."""
    view, window = camera((0, 0, 1), (0, 10, 0), size=(160, 120), lens=1.9), (0, 0, 160, 60)
    found = [fineness(window, roughness, view) for roughness in (0.0, 0.01, 0.05, 0.08, 0.2, 0.5)]
    assert found[:2] == [1, 1] and found[2] == FINEST > found[3] > 1 and found[4:] == [1, 1]
    large = camera((0, 0, 1), (0, 10, 0), size=(1920, 1080), lens=1.9)
    assert fineness((0, 0, 1920, 540), 0.05, large) == 1
    middle = camera((0, 0, 1), (0, 10, 0), size=(480, 360), lens=1.9)
    times = fineness((0, 0, 480, 200), 0.03, middle)
    _, _, width, height = widened((0, 0, 480 * times, 200 * times), 0.03, middle.finer(times))
    assert 1 < times < FINEST and width * height < 1.1 * MOST_PIXELS


def test_a_finer_camera_has_the_same_rays():
    """Its pixels' middles lie about those of the picture's."""
    fine = VIEW.finer(3).primary_rays().direction.reshape(3 * VIEW.height, 3 * VIEW.width, 3)[1::3, 1::3]
    np.testing.assert_allclose(fine.reshape(-1, 3), VIEW.primary_rays().direction, atol=1e-6)
