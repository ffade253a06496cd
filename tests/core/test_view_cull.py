"""Boxes that a window cannot show, and near planes that leave their own mirror out: against points sampled at random."""

import numpy as np
import pytest
from mirror_views import camera, clip_of, mirror, pixels

from reflect_addon.core.clear_of_mirror import clear_of
from reflect_addon.core.mirrored_view import mirrored
from reflect_addon.core.snapshot import corners_of
from reflect_addon.core.view_cull import may_be_seen


@pytest.mark.parametrize("orthographic", [False, True])
@pytest.mark.parametrize("in_mirror", [False, True])
def test_what_is_culled_is_nowhere_in_the_window(rng, orthographic, in_mirror):
    culled = 0
    for _ in range(300):
        seen = camera(rng.normal(size=3) * 3, rng.normal(size=3), orthographic=orthographic)
        if in_mirror:
            seen = mirrored(seen, mirror(rng.normal(size=3), rng.normal(size=3)))
            if seen is None:
                continue
        x, y = rng.integers(0, [300, 220])
        window = (int(x), int(y), int(rng.integers(1, 320 - x)), int(rng.integers(1, 240 - y)))
        middle, size = rng.normal(size=3) * 4, rng.uniform(0.05, 1.5, 3)
        if may_be_seen(seen, corners_of((middle - size, middle + size)), window):
            continue
        culled += 1
        points = middle + size * rng.uniform(-1, 1, (400, 3))
        clip = clip_of(seen, points)
        shown = (np.abs(clip[:, 2]) <= clip[:, 3]) & (clip[:, 3] > 0)
        at = pixels(seen, points[shown])
        low, high = np.array(window[:2]), np.add(window[:2], window[2:])
        assert not ((at >= low) & (at <= high)).all(1).any()
    assert culled > 50


def test_a_box_around_the_eye_may_be_seen():
    box = corners_of((np.full(3, -1.0), np.full(3, 1.0)))
    assert may_be_seen(camera((0, 0, 0), (0, 1, 0)), box, (100, 100, 3, 3))


@pytest.mark.parametrize("scale", [1e-4, 1.0, 1e5])
def test_a_shader_sees_nothing_of_the_mirror_itself(rng, scale):
    """Multiplied in float32 as a vertex shader does, points of the mirror are before the near plane; what is a little before the mirror
    is not."""
    for _ in range(50):
        place, at = rng.normal(size=3) * 3 * scale, rng.normal(size=3) * scale
        plane = mirror(at, place - at + rng.normal(size=3) * 0.5 * scale, half=1.5 * scale)
        seen = mirrored(camera(place, at, near=0.01 * scale, far=100 * scale), plane)
        if seen is None:
            continue
        seen = clear_of(seen, plane)
        weights = rng.dirichlet(np.ones(len(plane.outline)), 500)
        on = weights @ plane.outline
        turn = np.eye(4)
        turn[:3, :3] = seen.world_from_camera[:3, :3].T
        rows = (seen.clip_from_camera @ turn).astype(np.float32)
        for points, inside in ((on, False), (on + 1e-4 * scale * plane.normal, True)):
            relative = (points - seen.world_from_camera[:3, 3]).astype(np.float32)
            clip = relative @ rows[:, :3].T + rows[:, 3]
            assert ((clip[:, 2] + clip[:, 3] > 0) == inside).all()
