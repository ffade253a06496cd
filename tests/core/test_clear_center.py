"""core/clear_center.py: the map is not captured from inside another object, and rooms are not in the way."""

import numpy as np
import pytest
import trimesh
from mesh_scenes import job, smooth_mirror, snapshot

from reflect_addon.core.clear_center import clear_center
from reflect_addon.core.methods import environment

SETTINGS = {**environment.DEFAULTS, "resolution": 8, "samples": 1}


def floor(size=6.0):
    return trimesh.Trimesh(
        size * np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]), [[0, 1, 2], [0, 2, 3]]
    )


def leg(at=(0, 0), radius=0.3, foot=-0.01):
    return trimesh.creation.cylinder(radius, 2, sections=24).apply_translation([*at, foot + 1])


def test_nothing_there_leaves_the_centre():
    made = job(snapshot(floor(), Leg=leg((2, 0))), SETTINGS)
    np.testing.assert_array_equal(clear_center(made, ("Mirror",)), made.center())


@pytest.mark.parametrize("foot", [-0.01, 0.0])
def test_beside_a_leg_on_a_floor(foot):
    made = job(snapshot(floor(), Leg=leg(foot=foot)), SETTINGS)
    center = clear_center(made, ("Mirror",))
    assert np.linalg.norm(center - [0, 0, 1]) > 1 and abs(center[2]) < 1e-2, "on the floor, out of the leg's sphere"
    assert np.linalg.norm(center) < 3, "and not farther than that asks"
    np.testing.assert_array_equal(clear_center(made, ("Mirror", "Leg")), made.center())
    asset = environment.bake(made)
    np.testing.assert_allclose(asset.uniforms["center"], center)


def test_beside_a_ball_in_a_ring():
    ring = smooth_mirror(trimesh.creation.torus(1, 0.2))
    made = job(snapshot(ring, Ball=trimesh.creation.icosphere(3, 0.5)), SETTINGS)
    assert np.linalg.norm(clear_center(made, ("Mirror",))) > 0.5


def test_a_room_is_not_in_the_way():
    room = trimesh.creation.box((10, 10, 10))
    room.invert()
    made = job(snapshot(smooth_mirror(trimesh.creation.icosphere(3)), Room=room), SETTINGS)
    np.testing.assert_array_equal(clear_center(made, ("Mirror",)), made.center())


@pytest.mark.parametrize("scale", [1e-3, 1e4])
def test_scale_changes_nothing(scale):
    near = clear_center(job(snapshot(floor(), Leg=leg()), SETTINGS), ("Mirror",))
    far = clear_center(job(snapshot(floor().apply_scale(scale), Leg=leg().apply_scale(scale)), SETTINGS), ("Mirror",))
    np.testing.assert_allclose(far / scale, near, rtol=1e-5, atol=1e-5)


def test_a_closed_mirror_is_not_in_its_own_way():
    made = job(snapshot(trimesh.creation.icosphere(3), Leg=leg((5, 0))), SETTINGS)
    np.testing.assert_array_equal(clear_center(made, ()), made.center())


def test_who_gives_a_centre_gets_it():
    made = job(snapshot(floor(), Leg=leg()), {**SETTINGS, "center": (0, 0, 0.5)})
    np.testing.assert_array_equal(clear_center(made, ("Mirror",)), (0, 0, 0.5))
