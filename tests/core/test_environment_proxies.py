"""environment, sphere_proxy and box_proxy against spheres and rooms in closed form, in the float32 that shaders have."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import tolerances
from analytic import SKY, Room, directions, random_room, rotation, smooth, sphere_distance, unit

from reflect_addon.core import cubemap, spaces
from reflect_addon.core.asset import Asset
from reflect_addon.core.job import BakeJob
from reflect_addon.core.kernel import record, run_numpy
from reflect_addon.core.methods import box_proxy, environment, sphere_proxy
from reflect_addon.core.rays import Rays

N = 32
SCALES = [1e-3, 1.0, 1e5]


def room_asset(room: Room, **more) -> Asset:
    """The cube map of a room and, by hand, the box that it is."""
    image, uniforms = cubemap.assemble(room.center, N, room.look_at(cubemap.bundle(room.center, N)))
    axes = {f"box_{name}": tuple(axis) for name, axis in zip("xyz", room.axes, strict=True)}
    box = {"center": tuple(room.center)}
    for name, sign, side in (("low", -1, room.low), ("high", 1, room.high)):
        is_open = np.isin(2 * np.arange(3) + (sign < 0), room.open_sides)
        box[f"box_{name}"] = tuple(np.where(is_open, sign * SKY, side))
        box[f"box_rim_{name}"] = tuple(np.where(is_open, side, 2 * sign * SKY))
    return Asset("room", "", {"radiance_tx": image}, uniforms | axes | box | more, {"turned": True, "open": True, "walls": True})


def answer(method, asset, rays, width=0.0, spread=0.0):
    return run_numpy(record(method.trace, asset), asset, rays, width, spread)


def scaled(room: Room, scale: float, center) -> Room:
    """A room of another size elsewhere; its centre as float32 holds it, which is what kernels are told."""
    return replace(room, low=room.low * scale, high=room.high * scale, center=np.asarray(center, "f").astype(np.float64))


def rays_in(rng, room: Room, count: int, spare=1e-3) -> Rays:
    """Rays from inside, float32, each at least `spare` of the room's sides away from its walls."""
    side = room.high - room.low
    local = room.low + side * rng.uniform(spare, 1 - spare, (count, 3))
    return Rays((local @ room.axes + room.center).astype("f"), directions(rng, count).astype("f"))


def check_shown(room: Room, found, seen, precise=tolerances.KERNEL_DIRECTION):
    """The answer is what the map shows in the direction `seen` (N, 3) from its centre, up to its texels."""
    rounding = tolerances.FLOAT32 * np.abs(room.center).max()
    shown = found.position.astype(np.float64) - room.center
    distance = np.linalg.norm(shown, axis=1)
    away = np.linalg.norm(shown - unit(seen) * distance[:, None], axis=1)
    assert np.all(away <= precise * distance + rounding)
    face, s, t = spaces.cube_coordinates(seen)
    at = (np.stack([s, t], -1) + 1) / 2 * N
    texel = np.floor(at).clip(0, N - 1) + 0.5
    inside = np.abs(at - np.round(at)).min(1) > N * precise  # the others may read the neighbour
    ends = room.distances(np.broadcast_to(room.center, seen.shape), unit(spaces.cube_direction(face, *(texel.T / N * 2 - 1))))
    np.testing.assert_allclose(distance[inside], ends[inside], rtol=2 * tolerances.HALF, atol=2 * rounding)
    assert inside.mean() > 0.9
    error = np.abs(found.radiance - smooth(seen)).max()
    assert error <= tolerances.CUBE_SMOOTH * (2 / N) ** 2 + 4 * tolerances.HALF + rounding / np.abs([room.low, room.high]).min()


@pytest.mark.parametrize("scale", SCALES)
@pytest.mark.parametrize("away", [0.0, 1000.0])
def test_a_box_is_left_where_its_walls_are(rng, scale, away):
    for _ in range(4):
        room = scaled(random_room(rng), scale, away * scale * unit(rng.normal(size=3)))
        rays = rays_in(rng, room, 4000)
        end = rays.origin + room.exits(rays.origin, rays.direction)[:, None] * rays.direction
        # Float32's roundings grow with a room's length over the distance of its nearest wall.
        check_shown(room, answer(box_proxy, room_asset(room), rays), end - room.center)


def test_along_the_walls(rng):
    """Directions parallel to one or two pairs of walls, of turned rooms and of an upright one (exact zeros)."""
    upright = Room(np.eye(3), np.array([-1.0, -2, -1]), np.array([3.0, 1, 1]), np.zeros(3))
    for room in (upright, random_room(rng), random_room(rng)):
        rays = rays_in(rng, room, 600)
        flat = rng.normal(size=(600, 3))
        flat[np.arange(600), np.arange(600) % 3] = 0
        flat[:300:2] = np.eye(3)[rng.integers(0, 3, 150)] * rng.choice([-1, 1], (150, 1))
        rays = replace(rays, direction=(unit(flat) @ room.axes).astype("f"))
        end = rays.origin + room.exits(rays.origin, rays.direction)[:, None] * rays.direction
        check_shown(room, answer(box_proxy, room_asset(room), rays), end - room.center)


def test_from_on_a_wall_and_along_it():
    """A reflector that touches a wall: inwards across the room, outwards the wall itself, along it its far end."""
    room = Room(np.eye(3), np.array([-1.0, -2, -1]), np.array([3.0, 1, 1]), np.zeros(3))
    starts = np.array([[3, 0.5, 0.25]] * 3, "f")
    along = np.array([[-1, 0, 0], [1, 0, 0], [0, -1, 0]], "f")
    found = answer(box_proxy, room_asset(room), Rays(starts, along))
    ends = np.array([[-1, 0.5, 0.25], [3, 0.5, 0.25], [3, -2, 0.25]])
    np.testing.assert_allclose(unit(found.position), unit(ends), atol=tolerances.KERNEL_DIRECTION)


def test_from_outside_the_nearest_point_answers(rng):
    for _ in range(3):
        room = random_room(rng)
        local = rng.uniform(2, 3, (2000, 3)) * np.where(rng.random((2000, 3)) < 0.5, room.low, room.high)
        inside = np.clip(local, room.low, room.high) @ room.axes + room.center
        rays = Rays((local @ room.axes + room.center).astype("f"), directions(rng, 2000).astype("f"))
        end = inside + room.exits(inside, rays.direction)[:, None] * rays.direction
        check_shown(room, answer(box_proxy, room_asset(room), rays), end - room.center)


@pytest.mark.parametrize("sides", [(4,), (0, 3), (0, 1, 2, 3, 4)])
def test_an_open_side_is_the_sky_by_direction(rng, sides):
    """Over the rim of the walls only the direction counts, whatever the ray's start; below it the walls stand."""
    room = replace(random_room(rng), open_sides=sides)
    rays = rays_in(rng, room, 4000)
    t = room.exits(rays.origin, rays.direction)
    end = rays.origin + np.minimum(t, SKY)[:, None] * rays.direction
    sky = t == SKY
    assert 0.1 < sky.mean() < 0.95
    clear = np.abs(np.concatenate([to_rim(room, rays, side)[:, None] for side in sides], 1)).min(1) > 1e-3
    found = answer(box_proxy, room_asset(room), rays)
    seen = np.where(sky[:, None], rays.direction, end - room.center)
    same = unit(found.position - room.center), unit(seen)
    np.testing.assert_allclose(same[0][clear], same[1][clear], atol=tolerances.KERNEL_DIRECTION)
    assert clear.mean() > 0.98


def to_rim(room: Room, rays: Rays, side: int) -> np.ndarray:
    """(N,) how far beyond (or before) the plane of an open side a ray leaves the other sides, m."""
    axis, low, high = side // 2, room.low.copy(), room.high.copy()
    (low if side % 2 else high)[axis] = -SKY if side % 2 else SKY
    shaft = replace(room, low=low, high=high, open_sides=())
    end = rays.origin + shaft.exits(rays.origin, rays.direction)[:, None] * rays.direction
    at = (end - room.center) @ room.axes[axis]
    return at - (room.low if side % 2 else room.high)[axis]


@pytest.mark.parametrize("scale", SCALES)
@pytest.mark.parametrize("away", [0.0, 1000.0])
def test_a_sphere_is_met_where_it_is(rng, scale, away):
    """Inside the far side, outside too; those that miss it, or leave it behind, fall back to their direction."""
    center = (away * scale * unit(rng.normal(size=3))).astype("f").astype(np.float64)
    room = scaled(random_room(rng), scale, center)
    radius = 2.0 * scale
    origin = (center + directions(rng, 20_000) * rng.uniform(0, 2, (20_000, 1)) * radius).astype("f")
    rays = Rays(origin, rng.permutation(directions(rng, 20_000)).astype("f"))
    m, d = origin.astype(np.float64) - center, rays.direction.astype(np.float64)
    first = sphere_distance(origin, d, center, radius)
    # The far root, by the sphere's other meeting point: products of the roots are |m|^2 - r^2.
    with np.errstate(invalid="ignore", divide="ignore"):
        inside = (m * m).sum(1) <= radius**2
        far = np.where(inside, first, ((m * m).sum(1) - radius**2) / first)
    met = np.isfinite(first)
    impact = np.linalg.norm(np.cross(m, d), axis=1) / radius
    clear = (np.abs(impact - 1) > 1e-2) & (np.abs(np.linalg.norm(m, axis=1) / radius - 1) > 1e-3)
    seen = np.where(met[:, None], m + np.where(met, far, 0)[:, None] * d, d)
    found = answer(sphere_proxy, room_asset(room, sphere_radius=radius), rays)
    assert np.array_equal(found.status[clear], np.where(met, spaces.STATUS_HIT, spaces.STATUS_FELL_BACK)[clear])
    assert 0.2 < met.mean() < 0.9 and clear.mean() > 0.95
    kept = type(found)(found.radiance[clear], found.coverage[clear], found.position[clear], found.status[clear])
    check_shown(room, kept, seen[clear], precise=10 * tolerances.KERNEL_DIRECTION)


@pytest.mark.parametrize("scale", SCALES)
def test_an_environment_at_infinity_is_exact(rng, scale):
    """Far content: every origin gives the same, the sky of the direction, and so do the proxies that it makes."""
    center = np.float32([7, -3, 2]) * np.float32(scale)
    room = Room(rotation(rng), np.full(3, -1.0), np.full(3, 1.0), center.astype(np.float64), open_sides=tuple(range(6)))
    asset = room_asset(room, sphere_radius=spaces.FAR)
    d = directions(rng, 5000).astype("f")
    for method in (environment, sphere_proxy, box_proxy):
        here = answer(method, asset, Rays(np.broadcast_to(center, d.shape), d))
        there = answer(method, asset, Rays((center + rng.normal(size=d.shape) * scale).astype("f"), d))
        assert np.abs(here.radiance - smooth(d)).max() <= tolerances.CUBE_SMOOTH * (2 / N) ** 2 + 4 * tolerances.HALF
        # Moving by a few times `scale` turns what lies at FAR by this much.
        np.testing.assert_allclose(there.radiance, here.radiance, atol=10 * scale / SKY + 4 * tolerances.HALF)
        np.testing.assert_allclose(here.position, center + SKY * d, atol=1e-5 * SKY)
    assert np.all(answer(environment, asset, Rays(d, d)).status == spaces.STATUS_HIT)


@pytest.mark.parametrize("method", [environment, sphere_proxy, box_proxy])
def test_the_footprint_is_the_angle_seen_from_the_centre(rng, method):
    """Levels hold their own numbers, so radiance tells which was read: log2 of the footprint's angle over a texel's. Of the
    sky only the spread counts."""
    room = replace(random_room(rng, 2.0, 3.0), open_sides=(4,))
    asset = room_asset(room, sphere_radius=2.5, radiance_scale=1.0)
    for level in range(cubemap.level_count(N)):
        x, y = cubemap.level_origin(N, level)
        side = (N >> level) + 2
        asset.images["radiance_tx"][y : y + side, x : x + 6 * side, :3] = level
    rays = rays_in(rng, room, 2000)
    rays = replace(rays, origin=(rays.origin * 0.5).astype("f"))
    width, spread = rng.uniform(0, 0.3, 2000), rng.uniform(0, 0.3, 2000)
    distance = {
        "environment": np.full(2000, np.inf),
        "sphere_proxy": sphere_distance(rays.origin, rays.direction, room.center, 2.5),
        "box_proxy": room.exits(rays.origin, rays.direction),
    }[method.NAME]
    distance = np.where(distance == SKY, np.inf, distance)
    with np.errstate(invalid="ignore"):
        from_center = np.linalg.norm(rays.origin + distance[:, None] * rays.direction, axis=1)
        angle = np.where(np.isfinite(distance), (width + spread * distance) / from_center, spread)
    level = np.log2(np.maximum(angle * N / 2, 1)).clip(0, cubemap.level_count(N) - 1)
    found = answer(method, asset, rays, width, spread)
    np.testing.assert_allclose(found.radiance[:, 0], level, atol=1e-4)
    assert np.ptp(level) > 2


@pytest.mark.parametrize("sides", [(), (4,)])
def test_baked_from_what_a_tracer_saw(rng, sides):
    """Environment, then box, by their own bakes: what is shown lies where the ray ends, as seen from the map's centre."""
    room = replace(random_room(rng, 3.0, 6.0, center=(10.0, -20.0, 3.0)), open_sides=sides)
    mirror = SimpleNamespace(name="Mirror", object_name="Mirror")
    settings = {"resolution": 64, "samples": 1, "sky_error": 0, "center": tuple(room.center)}
    first = environment.bake(BakeJob(SimpleNamespace(lamps=()), mirror, room.look_at, None, settings))
    second = box_proxy.bake(BakeJob(None, mirror, room.look_at, None, {}, {"environment": first}))
    rays = rays_in(rng, room, 5000)
    end = rays.origin + room.exits(rays.origin, rays.direction)[:, None] * rays.direction
    found = answer(box_proxy, second.joined(first), rays)
    apart = np.linalg.norm(unit(found.position - room.center) - unit(end - room.center), axis=1)
    assert np.mean(apart < 2e-3) > (0.97 if sides else 0.999), "a rim is told to a texel"


@pytest.mark.parametrize("method", [environment, sphere_proxy, box_proxy])
def test_a_null_ray_is_finite(method):
    """Pixels without a reflection carry zeros; so may a damaged mesh."""
    room = Room(np.eye(3), -np.ones(3), np.ones(3), np.zeros(3))
    nothing = np.zeros((2, 3), "f")
    nothing[1] = 0.5
    found = answer(method, room_asset(room, sphere_radius=1.5), Rays(nothing, np.zeros((2, 3), "f")), 0.1, 0.1)
    for field in (found.radiance, found.position, found.coverage, found.status):
        assert np.isfinite(field).all()
