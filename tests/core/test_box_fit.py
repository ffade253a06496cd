"""core/box_fit.py on rooms whose walls are known: turned, furnished, lopsided, open, thin; and the sphere's radius."""

from dataclasses import replace

import numpy as np
import pytest
import tolerances
from analytic import SKY, Room, directions, random_room, rotation

from reflect_addon.core import box_fit, cubemap, spaces
from reflect_addon.core.asset import Asset
from reflect_addon.core.methods import sphere_proxy

COUNT = 30_000


def seen_from_center(room: Room, rng, count=COUNT):
    """(points, weights): what evenly random directions from the room's centre see."""
    d = directions(rng, count)
    origin = np.broadcast_to(room.center, d.shape)
    t = room.distances(origin, d)
    hit = t < SKY
    return (origin + d * np.where(hit, t, 0)[:, None])[hit], np.full(hit.sum(), 4 * np.pi / count)


def fitted(room: Room, rng) -> box_fit.Box:
    return box_fit.fit(*seen_from_center(room, rng), room.center)


def check_walls(room: Room, box: box_fit.Box, faces=range(6), precise=tolerances.BOX_WALL):
    """Each of these walls is a side of the box: its normal is an axis, and its distance is right, whatever their order."""
    np.testing.assert_allclose(box.axes @ box.axes.T, np.eye(3), atol=1e-9)
    assert np.linalg.det(box.axes) > 0
    for face in faces:
        outward = room.axes[face // 2] * (1 - 2 * (face % 2))
        wanted = room.low[face // 2] * -1 if face % 2 else room.high[face // 2]
        along = box.axes @ outward
        axis = int(np.argmax(np.abs(along)))
        assert abs(along[axis]) > np.cos(tolerances.BOX_TURN), f"wall {face}"
        got = box.high[axis] if along[axis] > 0 else -box.low[axis]
        assert got == pytest.approx(wanted, rel=precise), f"wall {face}"


@pytest.mark.parametrize("seed", range(6))
def test_a_room_turned_any_way_with_its_centre_anywhere(seed):
    rng = np.random.default_rng(seed)
    room = random_room(rng, center=rng.normal(size=3) * 100)
    check_walls(room, fitted(room, rng))


def test_an_upright_room_stays_upright_to_the_last_digit(rng):
    room = Room(np.eye(3), np.array([-1.0, -4, -1.5]), np.array([3.0, 1, 1.5]), np.zeros(3))
    box = fitted(room, rng)
    assert np.array_equal(box.axes, np.eye(3))
    np.testing.assert_allclose([box.low, box.high], [room.low, room.high], rtol=1e-9)
    assert np.all(box.rim_high == 2 * spaces.FAR) and np.all(box.rim_low == -2 * spaces.FAR)


@pytest.mark.parametrize("degrees", [3, 30, 45])
def test_a_room_turned_about_the_vertical(rng, degrees):
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    axes = np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
    room = Room(axes, np.array([-2.0, -3, -1]), np.array([3.0, 2, 2]), np.zeros(3))
    box = fitted(room, rng)
    check_walls(room, box)
    assert abs(box.axes[2, 2]) > np.cos(tolerances.BOX_TURN), "z stays z"


@pytest.mark.parametrize("seed", range(4))
def test_furniture_hides_less_than_half_of_each_wall(seed):
    """Balls before every wall: medians pass over them."""
    rng = np.random.default_rng(seed)
    room = random_room(rng, 4.0, 8.0)
    spheres = []
    for face in range(6):
        axis, local = face // 2, np.zeros(3)
        side = room.low[axis] if face % 2 else room.high[axis]
        local[axis] = 0.7 * side
        spheres.append((local @ room.axes + room.center, 0.2 * abs(side)))
    furnished = replace(room, spheres=tuple(spheres))
    points, _ = seen_from_center(furnished, rng)
    off_walls = np.abs((points - room.center) @ room.axes.T) < 0.99 * np.abs(np.where(points > 0, room.high, room.low))
    assert off_walls.all(1).mean() > 0.02
    check_walls(room, fitted(furnished, rng))


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("side", range(6))
def test_a_side_open_to_the_sky_lies_at_far_and_has_a_rim(rng, side, turned):
    axes = rotation(rng) if turned else np.eye(3)
    room = Room(axes, np.array([-2.0, -3, -1]), np.array([3.0, 2, 2]), np.zeros(3), open_sides=(side,))
    box = fitted(room, rng)
    check_walls(room, box, [face for face in range(6) if face != side])
    outward = room.axes[side // 2] * (1 - 2 * (side % 2))
    along = box.axes @ outward
    axis = int(np.argmax(np.abs(along)))
    ends = (box.high, box.rim_high) if along[axis] > 0 else (-box.low, -box.rim_low)
    wanted = -room.low[side // 2] if side % 2 else room.high[side // 2]
    assert ends[0][axis] == spaces.FAR
    assert ends[1][axis] == pytest.approx(wanted, rel=tolerances.BOX_RIM)
    assert np.sum(np.abs([box.rim_low, box.rim_high]) < spaces.FAR) == 1, "closed sides have no rim"


def test_a_floor_under_the_sky(rng):
    """No walls at all: the floor stands, five sides are the sky."""
    room = Room(np.eye(3), np.array([-50.0, -50, -1]), np.array([50.0, 50, 50]), np.zeros(3), open_sides=(0, 1, 2, 3, 4))
    box = fitted(room, rng)
    assert box.low[2] == pytest.approx(-1, rel=tolerances.BOX_WALL)
    assert box.low[:2].tolist() == [-spaces.FAR] * 2 and box.high.tolist() == [spaces.FAR] * 3
    assert np.all(box.rim_high[:2] > 10) and box.rim_high[2] >= 0


@pytest.mark.parametrize("seed", range(4))
def test_slabs_of_twenty_to_one(seed):
    """Corridors and ceilings: one side twenty times another, turned any way, the centre in the middle third."""
    rng = np.random.default_rng(seed)
    size = np.array([[20.0, 20, 1], [20, 1, 1], [20, 4, 1], [1, 20, 5]])[seed]
    share = rng.uniform(0.33, 0.67, 3)
    room = Room(rotation(rng), -size * share, size * (1 - share), np.zeros(3))
    check_walls(room, fitted(room, rng))


@pytest.mark.parametrize("scale", [1e-3, 1e5])
def test_any_scale_and_far_from_the_origin(rng, scale):
    room = random_room(rng)
    room = replace(room, low=room.low * scale, high=room.high * scale, center=np.array([1e4, -2e4, 5e3]) * scale)
    check_walls(room, fitted(room, rng))


def test_too_few_points_are_the_sky():
    for count in (0, 15):
        box = box_fit.fit(np.ones((count, 3)), np.ones(count), np.zeros(3))
        assert np.array_equal([box.low, box.high], [[-spaces.FAR] * 3, [spaces.FAR] * 3])
        assert np.array_equal(box.axes, np.eye(3)) and np.all(box.rim_high < spaces.FAR)


def test_points_that_make_no_room_give_a_finite_box(rng):
    """One point many times, a line, a ball of noise, points on the centre itself."""
    line = np.linspace(1, 5, 200)[:, None] * [1.0, 2.0, -1.0]
    for points in (np.ones((50, 3)), line, rng.normal(size=(500, 3)), np.zeros((40, 3)), np.eye(3)[[0] * 30]):
        box = box_fit.fit(points, np.ones(len(points)), np.zeros(3))
        for field in (box.axes, box.low, box.high, box.rim_low, box.rim_high):
            assert np.isfinite(field).all()
        assert np.all(box.low <= 0) and np.all(box.high >= 0)
        np.testing.assert_allclose(box.axes @ box.axes.T, np.eye(3), atol=1e-9)


def environment_of(room: Room, n=32) -> Asset:
    image, uniforms = cubemap.assemble(room.center, n, room.look_at(cubemap.bundle(room.center, n)))
    return Asset("environment", "", {"radiance_tx": image}, uniforms | {"center": tuple(room.center)})


def test_the_radius_is_the_median_distance(rng):
    """Half of the solid angle is nearer, half farther: counted on evenly random directions, not on the map's texels."""
    room = random_room(rng, center=(5.0, -3.0, 2.0))
    radius = sphere_proxy.fit_radius(environment_of(room))
    d = directions(rng, 200_000)
    distance = room.exits(np.broadcast_to(room.center, d.shape), d)
    assert np.mean(distance < radius) == pytest.approx(0.5, abs=tolerances.MEDIAN_SHARE)


def test_the_radius_of_a_ball_and_of_the_sky():
    center = np.array([1.0, 2.0, 3.0])
    ball = Room(np.eye(3), np.full(3, -99.0), np.full(3, 99.0), center, spheres=((center, 2.5),))
    assert sphere_proxy.fit_radius(environment_of(ball)) == pytest.approx(2.5, rel=tolerances.HALF)
    sky = Room(np.eye(3), np.full(3, -1.0), np.full(3, 1.0), center, open_sides=tuple(range(6)))
    assert sphere_proxy.fit_radius(environment_of(sky)) == spaces.FAR
    half = replace(ball, spheres=(), open_sides=(4, 5, 0, 1))
    assert sphere_proxy.fit_radius(environment_of(half)) < 200, "the sky has no vote"
