"""core/depth_camera.py: what the fitted camera sees, and its depths."""

import numpy as np
import pytest
import trimesh
from analytic import directions

from reflect_addon.core.depth_camera import fit


def lengths(rng, count):
    return np.exp(rng.uniform(np.log(1e-4), np.log(1e5), count))


def test_the_outline_lies_in_the_circle_and_between_the_planes(rng):
    for scale, towards in zip(lengths(rng, 40), directions(rng, 40), strict=True):
        vertices = (rng.normal(size=(200, 3)) * rng.uniform(0.01, 1, 3) + 3 * rng.normal(size=3)) * scale
        camera = fit(vertices, towards)
        x, y, z = camera.project(vertices).T
        radius = np.hypot(x, y)
        assert radius.max() <= 1 and np.all((camera.hither < z) & (z < camera.yon)) and camera.hither > 0
        assert radius.max() > 0.7, "the image is filled"
        assert np.allclose(np.cross(camera.right, camera.up), -camera.forward, atol=1e-12)


def test_rays_go_through_the_texels_that_their_points_project_to(rng):
    camera = fit(rng.normal(size=(50, 3)), [1, 2, 3])
    rays, z_of = camera.rays(16)
    t = rng.uniform(camera.hither, camera.yon, len(rays))
    x, y, z = camera.project(rays.origin + rays.direction * t[:, None]).T
    at = (np.arange(16) + 0.5) / 16 * 2 - 1
    assert np.allclose(x.reshape(16, 16), at[None, :], atol=1e-9) and np.allclose(y.reshape(16, 16), at[:, None], atol=1e-9)
    assert np.allclose(z, t * z_of, rtol=1e-12)


def test_depths_are_normalised_inverses_and_come_back(rng):
    camera = fit(rng.normal(size=(50, 3)), [0, 0, 1])
    z = np.linspace(camera.hither, camera.yon, 100)
    q = camera.normalised(z)
    assert q[0] == pytest.approx(1, abs=1e-12) and q[-1] == pytest.approx(0, abs=1e-12) and np.all(np.diff(q) < 0)
    wanted = (1 / z - 1 / camera.yon) / (1 / camera.hither - 1 / camera.yon)
    assert np.allclose(q, wanted, atol=1e-9) and np.allclose(camera.depth(q), z, rtol=1e-12)


@pytest.mark.parametrize("towards", [(0, 0, 1), (0, 0, -1), (1, 0, 0), (0, 0, 0)])
@pytest.mark.parametrize("shape", ["point", "needle", "plate"])
def test_thin_things_have_a_camera(towards, shape):
    vertices = {"point": [[1, 2, 3.0]] * 3, "needle": [[0, 0, 0], [0, 0, 1.0]], "plate": [[0, 0, 1.0], [1, 0, 1], [0, 1, 1]]}[shape]
    camera = fit(np.array(vertices), np.array(towards, float))
    p = camera.project(vertices)
    assert np.isfinite(p).all() and 0 < camera.hither < camera.yon and camera.tan_half > 0
    assert np.all(np.hypot(p[:, 0], p[:, 1]) <= 1)


def test_a_rigid_motion_of_the_object_moves_the_camera(rng):
    """4.3: the map is what it was, seen by the moved camera."""
    vertices = rng.normal(size=(50, 3))
    camera = fit(vertices, [1, 0, 0.5])
    m = trimesh.transformations.random_rotation_matrix(rng.random(3))
    m[:3, :3] *= 2.5
    m[:3, 3] = [5, -3, 2]
    before, after = camera.project(vertices), camera.moved(m).project(vertices @ m[:3, :3].T + m[:3, 3])
    assert np.allclose(after[:, :2], before[:, :2], atol=1e-9) and np.allclose(after[:, 2], 2.5 * before[:, 2])
    assert camera.moved(m).hither == pytest.approx(2.5 * camera.hither)
