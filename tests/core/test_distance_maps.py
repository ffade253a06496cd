"""distance_map and layered_distance: planes and rooms in closed form, and Embree where things stand in the way."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import tolerances
from analytic import SKY, Room, directions, random_room, smooth, unit
from mesh_scenes import intersect, job, snapshot, tracer
from trimesh.creation import box, icosphere

from reflect_addon.core import spaces
from reflect_addon.core.depth_layers import layers_behind
from reflect_addon.core.job import BakeJob
from reflect_addon.core.kernel import Counts, record, run_numpy
from reflect_addon.core.methods import distance_map, environment, layered_distance
from reflect_addon.core.rays import Rays
from reflect_addon.core.snapshot import Instance, Mesh

N = 128
BOTH = [distance_map, layered_distance]


def seen_from_inside(room: Room):
    """room.look_at, where nothing is behind the walls: its closed form holds for rays that start inside."""

    def trace(rays, hide=(), samples=1):
        found, local = room.look_at(rays), (rays.origin - room.center) @ room.axes.T
        inside = np.all((local >= room.low) & (local <= room.high), axis=1)
        far = (rays.origin + SKY * rays.direction).astype("f")
        return replace(found, hit=found.hit & inside, position=np.where(inside[:, None], found.position, far))

    return trace


def bake(method, room: Room, n=N, **settings):
    """By the method's own bake, in a scene of closed form."""
    mirror = SimpleNamespace(name="Mirror", object_name="Mirror")
    scene = SimpleNamespace(lamps=(), diagonal=lambda: float(np.linalg.norm(room.high - room.low)))
    given = {"resolution": n, "samples": 1, "sky_error": 0, "center": tuple(room.center)}
    first = environment.bake(BakeJob(scene, mirror, seen_from_inside(room), None, given))
    asked = {**method.DEFAULTS, **given, **settings}
    asset = method.bake(BakeJob(scene, mirror, seen_from_inside(room), None, asked, {"environment": first}))
    return asset.joined(first) if method.REQUIRES else asset


def answer(method, asset, rays, width=0.0, spread=0.0, counts=None):
    return run_numpy(record(method.trace, asset), asset, rays, width, spread, counts=counts)


def rays_about(rng, room: Room, count: int, share=0.5) -> Rays:
    """From the middle of the room: up to `share` of its half sides away from where the map was taken."""
    local = np.where((step := rng.uniform(-share, share, (count, 3))) > 0, step * room.high, -step * room.low)
    return Rays((local @ room.axes + room.center).astype("f"), directions(rng, count).astype("f"))


def apart(found, rays, distance) -> np.ndarray:
    """(N,) how far the shown point lies from the ray's true end, over its distance from the ray's start."""
    end = rays.origin + distance[:, None] * rays.direction
    return np.linalg.norm(found.position - end, axis=1) / distance


@pytest.mark.parametrize("method", BOTH)
def test_one_plane_is_met_exactly_at_the_first_guess(rng, method):
    """A floor that is seen in the direction of the ray's start and in its own: the map's texels are what is left."""
    floor = Room(np.eye(3), np.array([-400.0, -400, -1]), np.array([400.0, 400, 400]), np.zeros(3), (0, 1, 2, 3, 4))
    origin = rng.uniform([-0.3, -0.3, -0.9], [0.3, 0.3, -0.4], (4000, 3))
    direction = unit(rng.uniform([-1, -1, -1], [1, 1, -0.7], (4000, 3)))
    rays = Rays(origin.astype("f"), direction.astype("f"))
    few = {"guesses": 1} if method is distance_map else {"iterations": 1}
    found = answer(method, bake(method, floor, **few), rays)
    error = apart(found, rays, floor.exits(rays.origin, rays.direction))
    # Half a texel's diagonal of a floor seen at up to 70 degrees, over rays that are as short as 0.1.
    size = np.linalg.norm(error[:, None] * (rays.origin - found.position), axis=1)
    assert size.max() < 2 / N * np.sqrt(2) * 2 and np.median(size) < 1 / N
    assert np.all(found.status == spaces.STATUS_HIT)


@pytest.mark.parametrize("method", BOTH)
@pytest.mark.parametrize("scale", [1e-4, 1.0, 1e5])
def test_rooms_of_any_size_anywhere(rng, method, scale):
    """Closed boxes, turned, as far from the world's origin as they are large."""
    for _ in range(2):
        room = random_room(rng, 2.0, 4.0)
        center = (unit(rng.normal(size=3)) * scale).astype("f").astype(np.float64)
        room = replace(room, low=room.low * scale, high=room.high * scale, center=center)
        rays = rays_about(rng, room, 4000)
        found = answer(method, bake(method, room), rays)
        truth = room.exits(rays.origin, rays.direction)
        size = np.linalg.norm(room.high - room.low)
        error = apart(found, rays, truth) * truth / size
        assert np.median(error) < 2 / N and np.quantile(error, 0.95) < 6 / N


def test_more_guesses_are_nearer(rng):
    """Where the ray's two directions see two planes, the guesses converge."""
    room = random_room(rng, 2.0, 4.0)
    rays = rays_about(rng, room, 6000, 0.8)
    truth = room.exits(rays.origin, rays.direction)
    answers = [answer(distance_map, bake(distance_map, room, guesses=g), rays) for g in (1, 2, 4, 8)]
    tails = [np.quantile(apart(found, rays, truth), 0.9) for found in answers]
    assert tails == sorted(tails, reverse=True) and tails[3] < tails[0] / 10, tails


def test_a_guess_is_a_look_up_and_a_step_is_one_for_each_layer(rng):
    """Work as it is told: two ends and a fetch a guess; the march's steps times layers."""
    room = random_room(rng, 2.0, 4.0)
    rays = rays_about(rng, room, 2000)
    for guesses in (1, 3, 6):
        counts = Counts()
        answer(distance_map, bake(distance_map, room, guesses=guesses), rays, counts=counts)
        assert counts.steps <= guesses * len(rays)
        # Two ends and the guesses of four texels each; then the answer's four texels and its distance.
        assert sum(counts.fetches.values()) == 4 * counts.steps + (2 * 4 + 5) * len(rays)
    counts, asset = Counts(), bake(layered_distance, room, iterations=1)
    found = answer(layered_distance, asset, rays, counts=counts)
    assert asset.options["layers"] == 1 and asset.options["steps"] == N / 2
    met = np.count_nonzero(found.status == spaces.STATUS_HIT)
    marched = counts.steps - met
    assert sum(counts.fetches.values()) == len(rays) + marched + 3 * met + 5 * len(rays)
    assert marched <= asset.options["steps"] * len(rays)


@pytest.mark.parametrize("method", BOTH)
def test_under_a_bare_sky_nothing_is_searched(rng, method):
    sky = Room(np.eye(3), -np.ones(3), np.ones(3), np.zeros(3), tuple(range(6)))
    asset, counts = bake(method, sky), Counts()
    rays = rays_about(rng, sky, 500)
    found = answer(method, asset, rays, counts=counts)
    assert counts.steps == 0 and counts.fetches_per_ray == 5
    assert np.abs(found.radiance - smooth(rays.direction)).max() < 0.01
    assert np.all(found.status == spaces.STATUS_FELL_BACK)


@pytest.mark.parametrize("method", BOTH)
@pytest.mark.parametrize("sides", [(), (4,), (0, 1, 2, 3, 4)])
def test_anything_gives_finite_answers(rng, method, sides):
    """Null rays, from the centre, on the walls and far outside, backwards, with any footprint."""
    room = replace(random_room(rng), open_sides=sides)
    rays = rays_about(rng, room, 2000, 3.0)
    origin, direction = rays.origin.copy(), rays.direction.copy()
    direction[:20], origin[20:60], origin[60:80] = 0, room.center, origin[60:80] * 1e6
    origin[80:120] = rays.direction[80:120]
    for spread in (0.0, 1.0, 1e6):
        found = answer(method, bake(method, room, 32), Rays(origin, direction), spread, spread)
        for field in (found.radiance, found.position, found.coverage, found.status):
            assert np.isfinite(field).all()


# A ball above a floor beside the mirror, the sky around: silhouettes, far sides, and what lies behind things.


@pytest.fixture(scope="module")
def scene():
    return snapshot(
        icosphere(3, 0.5),
        Ball=icosphere(4, 0.5).apply_translation([2.0, 0, 0]),
        Floor=box((8, 8, 0.2)).apply_translation([0, 0, -0.8]),
    )


@pytest.fixture(scope="module")
def baked(scene):
    """method -> asset."""
    settings = {"resolution": N, "samples": 1, "sky_error": 0, "layers": 4, "stride": 1, "iterations": 3, "guesses": 6}
    first = environment.bake(job(scene, settings))
    second = distance_map.bake(job(scene, settings, {"environment": first})).joined(first)
    layered = layered_distance.bake(job(scene, settings))
    return {"environment": first, "distance_map": second, "layered_distance": layered}


def truth(scene, rays):
    return tracer(scene)(rays, hide=("Mirror",))


def test_the_first_layer_is_the_environment(baked):
    asset, first = baked["layered_distance"], baked["environment"]
    height = int(asset.uniforms["layer_height"])
    assert np.array_equal(asset.images["radiance_tx"][:height], first.images["radiance_tx"])
    assert asset.images["radiance_tx"].shape[0] == height * asset.options["layers"] and asset.options["layers"] == 4
    for name, value in first.uniforms.items():
        assert asset.uniforms[name] == value


def test_the_layers_are_the_surfaces_in_order(scene):
    """Through the ball's middle: its near side, its far side, the sky. Down: the floor's top and its underside."""
    rays = Rays(np.zeros((3, 3), "f"), unit([[1, 0, 0], [0, 0.3, -1], [0, 0, 1]]).astype("f"))
    layers = layers_behind(job(scene, {}), rays, 5, ("Mirror",), 1)
    assert len(layers) == 1 and layers[0].hit.tolist() == [True, True, False]
    np.testing.assert_allclose(layers[0].position[0], [2.5, 0, 0], atol=tolerances.SPHERE_FACETS * 2)
    assert layers[0].position[1, 2] == pytest.approx(-0.9, abs=1e-5)


def test_a_far_side_shows_what_is_seen_from_outside(scene):
    """Inside it is dark: the radiance of far sides is asked from beyond."""
    made = []
    rays = Rays(np.zeros((2, 3), "f"), unit([[1, 0, 0], [0, 0.3, -1]]).astype("f"))
    layers_behind(job(scene, {}, made=made), rays, 2, ("Mirror",), 1)
    shown = made[-1][0]
    np.testing.assert_allclose(shown.direction, -rays.direction, atol=1e-6)
    assert shown.origin[0, 0] > 2.499 and shown.origin[1, 2] < -0.9


def beside(rng, count=6000):
    """Rays from the mirror ball's surface, going outwards."""
    normal = directions(rng, count)
    outwards = unit(normal + 0.9 * directions(rng, count)[rng.permutation(count)])
    return Rays((0.501 * normal).astype("f"), outwards.astype("f"))


def test_layers_find_what_rays_really_meet(scene, baked, rng):
    """Hit points and misses against Embree: far better than the map by direction, and better than guesses."""
    rays = beside(rng)
    real = truth(scene, rays)
    wrong, tails = {}, {}
    for method in (environment, distance_map, layered_distance):
        found = answer(method, baked[method.NAME], rays)
        surface = np.linalg.norm(found.position - rays.origin, axis=1) < SKY / 2
        wrong[method.NAME] = np.mean(surface != real.hit)
        both = surface & real.hit
        tails[method.NAME] = np.quantile(np.linalg.norm(found.position - real.position, axis=1)[both], [0.5, 0.95])
    assert wrong["layered_distance"] < 0.02 < wrong["environment"], wrong
    assert wrong["layered_distance"] < wrong["distance_map"]
    assert tails["layered_distance"][0] < 0.01 and tails["layered_distance"][1] < 0.08, tails
    assert tails["distance_map"][0] < 0.02, tails
    assert 10 * tails["layered_distance"][0] < tails["environment"][0]


def test_the_ball_s_far_side_is_found_in_the_second_layer(scene, baked):
    """Rays that reach the ball from beyond, where the centre cannot see: only with layers are they met."""
    target = np.array([2.0, 0, 0]) + 0.5 * unit([[1, 0.2, 0.1], [1, -0.3, 0.2], [1, 0.1, 0.4], [1, 0.4, 0.5]])
    origin = np.array([[3.5, 0.3, 0.5]] * 4)
    rays = Rays(origin.astype("f"), unit(target - origin).astype("f"))
    real = truth(scene, rays)
    np.testing.assert_allclose(real.position, target, atol=0.01)
    found = answer(layered_distance, baked["layered_distance"], rays)
    assert np.linalg.norm(found.position - target, axis=1).max() < 0.1
    one = replace(baked["layered_distance"], options={**baked["layered_distance"].options, "layers": 1})
    assert np.linalg.norm(answer(layered_distance, one, rays).position - target, axis=1).min() > 0.3
    np.testing.assert_allclose(found.radiance, real.radiance, rtol=0.1)


def test_a_ray_between_things_flies_on(scene, baked, rng):
    """Past the ball's edge the sky is seen: no rubber band joins a silhouette to what is behind it."""
    angle = rng.uniform(0, 2 * np.pi, 500)
    origin = rng.uniform([-0.2, -0.2, 0.3], [0.2, 0.2, 0.5], (500, 3))
    edge = np.array([2.0, 0, 0]) + 0.75 * np.stack([0 * angle, np.cos(angle), np.sin(angle)], -1)
    rays = Rays(origin.astype("f"), unit(edge - origin).astype("f"))
    real = truth(scene, rays)
    found = answer(layered_distance, baked["layered_distance"], rays)
    surface = np.linalg.norm(found.position - rays.origin, axis=1) < SKY / 2
    assert 0.3 < np.mean(~real.hit) < 0.9
    assert np.mean(surface & ~real.hit) < 0.02


def test_a_lamp_is_where_it_hangs(scene):
    """Rays report what is behind a lamp; maps hold the lamp, unless it shines the other way or is hidden."""
    square = np.array([[-1, -1, 0], [-1, 1, 0], [1, 1, 0], [1, -1, 0]], np.float32)
    mesh = Mesh(square, np.array([[0, 1, 2], [0, 2, 3]], np.int32), np.zeros((2, 3, 3), "f"), np.zeros(2, np.int32))
    up = np.eye(4)
    up[2, 3] = 3.0
    for turn, name, wanted in ((1.0, "Lamp", 3.0), (-1.0, "Lamp", SKY), (1.0, "Mirror", SKY)):
        place = up @ np.diag([1.0, turn, turn, 1.0])
        lamp = Instance("Lamp", name, len(scene.meshes), place, (), False)
        lit = replace(scene, meshes=(*scene.meshes, mesh), lamps=(lamp,))
        settings = {"resolution": 32, "samples": 1, "sky_error": 0}
        asset = environment.bake(BakeJob(lit, lit.instances[0], tracer(scene), intersect(lit), settings))
        up_ray = Rays(np.zeros((1, 3), "f"), np.array([[0.05, 0.05, 1.0]], "f"))
        assert answer(environment, asset, up_ray).position[0, 2] == pytest.approx(wanted, rel=0.01), (turn, name)
