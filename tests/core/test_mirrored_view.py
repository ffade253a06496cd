"""core/mirrored_view.py: a mirror's view shows the mirror images of points where the eye sees them, and nothing behind the mirror."""

import numpy as np
import pytest
from analytic import rotation, unit
from mirror_views import camera, clip_of, mirror, pixels
from tolerances import MIRRORED_DEPTH, MIRRORED_PIXEL, MIRRORED_POSE

from reflect_addon.core.mirrored_view import far_of, mirrored, reflection


def before(camera, rng, size=1.0):
    """A mirror in the middle of what the camera sees, turned at random towards it."""
    seen = camera.world_from_camera
    ahead = -seen[:3, 2]
    normal = unit(-ahead + 0.7 * (unit(rng.normal(size=3))))
    return mirror(seen[:3, 3] + ahead * 5 * size, normal, size)


def image(plane, points):
    return points @ reflection(plane.origin, plane.normal)[:3, :3].T + reflection(plane.origin, plane.normal)[:3, 3]


VIEWS = [dict(orthographic=False), dict(orthographic=True), dict(shift=(0.3, -0.2)), dict(orthographic=True, shift=(0.3, -0.2))]


@pytest.fixture(params=VIEWS, ids=["perspective", "orthographic", "shifted", "orthographic shifted"])
def view(request):
    return camera((3.0, -4.0, 2.0), (0.5, 0.0, 0.3), **request.param)


def test_the_mirror_image_of_a_point_is_seen_at_the_same_pixel(view, rng):
    for _ in range(20):
        plane = before(view, rng)
        seen = mirrored(view, plane)
        points = plane.origin + rng.normal(size=(50, 3))
        points = points[(points - plane.origin) @ plane.normal > 0.01]
        np.testing.assert_allclose(pixels(seen, points), pixels(view, image(plane, points)), atol=MIRRORED_PIXEL)
        np.testing.assert_allclose(pixels(seen, plane.outline), pixels(view, plane.outline), atol=MIRRORED_PIXEL)


def test_its_pose_is_rigid_and_its_rays_are_the_reflected_ones(view, rng):
    plane = before(view, rng)
    seen = mirrored(view, plane)
    turn = seen.world_from_camera[:3, :3]
    np.testing.assert_allclose(turn.T @ turn, np.eye(3), atol=MIRRORED_POSE)
    assert np.linalg.det(turn) > 0 and seen.is_orthographic == view.is_orthographic and (seen.width, seen.height) == (320, 240)
    rays, own = view.primary_rays(), seen.primary_rays()
    reflected = rays.direction - 2 * (rays.direction @ plane.normal)[:, None] * plane.normal
    np.testing.assert_allclose(own.direction, reflected, atol=1e-6)


def test_only_what_is_before_the_mirror_is_inside(view, rng):
    for _ in range(20):
        plane = before(view, rng)
        seen = mirrored(view, plane)
        on = plane.origin + 0.3 * (plane.outline - plane.origin)
        for height in (1e-6, 1e-3, 0.5):
            clip = clip_of(seen, on + height * plane.normal)
            assert np.all(clip[:, 2] > -clip[:, 3]) and np.all(clip[:, 2] < clip[:, 3])
            clip = clip_of(seen, on - height * plane.normal)
            assert np.all(clip[:, 2] < -clip[:, 3])


def test_twice_is_the_camera_itself_up_to_its_depths(view, rng):
    plane = before(view, rng)
    once = mirrored(view, plane)
    behind = mirror(plane.origin, -plane.normal)
    twice = mirrored(once, behind)
    np.testing.assert_allclose(twice.world_from_camera, view.world_from_camera, atol=MIRRORED_POSE)
    np.testing.assert_allclose(twice.clip_from_camera[[0, 1, 3]], view.clip_from_camera[[0, 1, 3]], atol=MIRRORED_POSE)


def test_many_mirrors_lose_no_depth(view, rng):
    """What the first camera's frustum holds at its far distance is held after eight mirrors; the far distance is found again."""
    seen = view
    for _ in range(8):
        seen = mirrored(seen, before(seen, rng))
        assert far_of(seen) == pytest.approx(100.0, rel=MIRRORED_DEPTH)
    plane = np.linalg.inv(seen.clip_from_world())
    near = np.array([[x, y, -1.0, 1.0] for x in (-1, 1) for y in (-1, 1)]) @ plane.T
    assert np.isfinite(near).all()


def test_no_view_from_behind_or_in_the_plane(view):
    eye, ahead = view.world_from_camera[:3, 3], -view.world_from_camera[:3, 2]
    assert mirrored(view, mirror(eye + 5 * ahead, ahead)) is None
    sideways = view.world_from_camera[:3, 0]
    assert mirrored(view, mirror(eye + 5 * ahead, sideways)) is None
    assert mirrored(view, mirror(eye + 200 * ahead, -ahead)) is None  # beyond the far plane


@pytest.mark.parametrize("size", [1e-4, 1.0, 1e5])
def test_any_scale(size, rng):
    turn = rotation(rng)
    for orthographic in (False, True):
        view = camera(turn @ [3 * size, -4 * size, 2 * size], (0, 0, 0), near=0.1 * size, far=100 * size, orthographic=orthographic,
                      lens=1.2 if not orthographic else 1.2 * size)  # fmt: skip
        plane = before(view, rng, size)
        seen = mirrored(view, plane)
        points = plane.origin + size * rng.uniform(0.1, 1, (20, 1)) * plane.normal
        np.testing.assert_allclose(pixels(seen, points), pixels(view, image(plane, points)), atol=MIRRORED_PIXEL)
        clip = clip_of(seen, plane.origin + 1e-6 * size * np.outer([1, -1], plane.normal))
        assert clip[0, 2] > -clip[0, 3] and clip[1, 2] < -clip[1, 3]
