"""core/frontal_view.py: a plain camera behind a mirror shows in every direction what the mirrored view shows there, and nothing behind the mirror."""

import numpy as np
import pytest
import tolerances
from analytic import unit
from mirror_views import camera, clip_of, mirror, pixels

from reflect_addon.core.frontal_view import CLEAR, STEPS, frontal
from reflect_addon.core.mirror_outline import area, seen_through
from reflect_addon.core.mirrored_view import far_of, mirrored

MOST = 4096  # px, more than any picture here needs


def seen_of(view, plane):
    """px of the view: what it sees of a mirror."""
    rectangle = ((0.0, 0.0), (view.width, 0.0), (view.width, view.height), (0.0, view.height))
    return seen_through(clip_of(view, plane.outline), view.width, view.height, rectangle)


def cases(rng, count=20, depth=1):
    """(mirrored view, its mirror, px of it that show it, frontal camera), the mirrors seen from all sides, `depth` of them in a row."""
    while count:
        view = camera((3.0, -4.0, 2.0), (0.5, 0.0, 0.3), shift=(0.2, -0.1))
        for _ in range(depth):
            ahead = -view.world_from_camera[:3, 2]
            plane = mirror(view.world_from_camera[:3, 3] + 5 * ahead, unit(-ahead + 0.9 * unit(rng.normal(size=3))), 1.5)
            polygon, view = seen_of(view, plane), mirrored(view, plane)
        if area(polygon) > 100 and (found := frontal(view, plane, polygon, MOST)) is not None:
            count -= 1
            yield view, plane, polygon, found


@pytest.mark.parametrize("depth", [1, 3])
def test_it_is_a_plain_camera(rng, depth):
    """Rigid, off-centre at most, right way round: what any engine draws."""
    for *_, found in cases(rng, depth=depth):
        turn, clip = found.world_from_camera[:3, :3], found.clip_from_camera
        np.testing.assert_allclose(turn.T @ turn, np.eye(3), atol=tolerances.MIRRORED_POSE)
        assert np.linalg.det(turn) > 0 and clip[0, 0] > 0 and clip[1, 1] > 0
        assert (clip != 0).tolist() == [[1, 0, 1, 0], [0, 1, 1, 0], [0, 0, 1, 1], [0, 0, 1, 0]] and clip[3, 2] == -1


@pytest.mark.parametrize("depth", [1, 3])
def test_a_point_is_found_where_the_mirrored_view_has_its_direction(rng, depth):
    """What is beyond one pixel of the mirrored view, near or far, is at one place of the picture: where the eye's line to it crosses the mirror."""
    for view, plane, polygon, found in cases(rng, depth=depth):
        middle = np.mean(polygon, axis=0)
        seen = middle + 0.98 * (np.array(polygon) - middle)
        eye = view.world_from_camera[:3, 3]
        ndc = np.column_stack([2 * seen / (view.width, view.height) - 1, np.full(len(seen), 0.5), np.ones(len(seen))])
        somewhere = ndc @ np.linalg.inv(view.clip_from_world()).T
        line = somewhere[:, :3] / somewhere[:, 3:] - eye
        on_mirror = eye + line * (((plane.origin - eye) @ plane.normal) / (line @ plane.normal))[:, None]
        for far in (1.5, 4.0):
            beyond = eye + far * (on_mirror - eye)
            np.testing.assert_allclose(pixels(view, beyond), seen, atol=tolerances.MIRRORED_PIXEL)
            np.testing.assert_allclose(pixels(found, beyond), pixels(found, on_mirror), atol=tolerances.MIRRORED_PIXEL)
            clip = clip_of(found, beyond)
            assert (np.abs(clip[:, :3]) < clip[:, 3:]).all(), "what the mirror shows is in the picture"


def test_nothing_in_or_behind_the_mirror_is_inside(rng):
    for view, plane, polygon, found in cases(rng):
        eye = view.world_from_camera[:3, 3]
        size = np.linalg.norm(np.ptp(plane.outline, axis=0))
        on = plane.origin + 0.3 * (plane.outline - plane.origin)
        for depth in (0.0, 1e-3, 0.5):
            clip = clip_of(found, on - depth * size * plane.normal)
            assert (clip[:, 2] < -clip[:, 3]).all()
        clear = 2 * (CLEAR * 2 * np.linalg.norm(plane.outline - eye, axis=1).max() + STEPS * np.abs(eye).max())
        clip = clip_of(found, on + clear * plane.normal)
        assert (clip[:, 2] > -clip[:, 3]).all() and (clip[:, 2] < clip[:, 3]).all()
        assert 2 * found.depths()[0] <= found.depths()[1] and found.depths()[1] >= 0.99 * far_of(view)


def test_its_pixels_are_no_larger_than_the_mirrored_views(rng):
    """Two neighbouring pixels of the mirrored view are a pixel apart in it, or more, in the middle of what is seen."""
    for view, plane, polygon, found in cases(rng):
        middle = np.mean(polygon, axis=0)
        steps = middle + np.array([[0, 0], [1, 0], [0, 1]])
        ndc = np.column_stack([2 * steps / (view.width, view.height) - 1, np.full(3, 0.5), np.ones(3)])
        world = ndc @ np.linalg.inv(view.clip_from_world()).T
        at = pixels(found, world[:, :3] / world[:, 3:])
        jacobian = np.stack([at[1] - at[0], at[2] - at[0]], -1)
        # A step of a texel along either side of the picture is at most a pixel of the mirrored view.
        assert np.linalg.norm(np.linalg.inv(jacobian), axis=0).max() < 1 + tolerances.FRONTAL_PIXEL
        assert max(frontal(view, plane, polygon, 64).width, frontal(view, plane, polygon, 64).height) <= 64


def test_what_no_frustum_shows_has_none():
    flat = camera((3.0, -4.0, 2.0), (0.5, 0.0, 0.3), orthographic=True)
    plane = mirror((0, 0, 0), (0, 0, 1))
    assert frontal(mirrored(flat, plane), plane, seen_of(flat, plane), MOST) is None
    grazing = camera((3.0, -4.0, 1e-3), (0.5, 0.0, 0.0))
    assert frontal(mirrored(grazing, plane), plane, seen_of(grazing, plane), MOST) is None
    assert frontal(mirrored(grazing, plane), plane, (), MOST) is None
