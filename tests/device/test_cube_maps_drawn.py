"""Live cube maps of curved mirrors: texels against rays, which maps a frame makes, what stays at rest, and what a mirror shows of them."""

from dataclasses import replace

import hand_scenes
import numpy as np
import pytest
import tolerances
import virtual_scenes
from lamp_scenes import lit_scene, lit_tracer
from mesh_scenes import tracer
from mirror_rooms import SURFACES, baked, one_mirror, paint
from virtual_scenes import ball

from reflect_addon.core import cubemap, live_maps, surface_radiance
from reflect_addon.core.kernel import record, run_numpy
from reflect_addon.core.map_size import CUBE_STEP, cube_sides, side_of
from reflect_addon.core.methods import environment, layered_distance
from reflect_addon.core.rays import Rays
from reflect_addon.core.spaces import STATUS_FELL_BACK

CAMERA = hand_scenes.camera((1.6, -1.6, 1.6), (-0.3, 0.1, 0.7), (96, 72), fov=0.9)
SIDE = 32
MIRRORED = 20  # px of a ball that show the pane, at least
BALLS = {"Second": ((0.0, 0.1, 0.9), 0.35), "Third": ((0.9, -0.6, 0.5), 0.3)}


def room(offset=(0, 0, 0)):
    """A planar mirror, and two balls of which the second is moved."""
    places = {"Second": BALLS["Second"][0], "Third": np.add(BALLS["Third"][0], offset)}
    return one_mirror(**{name: ball(BALLS[name][1], place, 3) for name, place in places.items()})


SCENE = room()


@pytest.fixture(scope="module")
def found():
    return baked(SCENE, curved=True, map_side=SIDE, maps_per_frame=2)


def renderer_of(found, **settings):
    from reflect_addon.gpu.renderer import Renderer

    assets = {name: replace(asset, settings={**asset.settings, **settings}) for name, asset in found.assets.items()}
    return Renderer(found.scene, assets, surfaces=found.surfaces)


def settle(renderer, camera=CAMERA, most=20):
    """Frames until no map is due."""
    for frame in range(1, most + 1):
        renderer.answer(camera, positions=False)
        if renderer.settled:
            return frame
    raise AssertionError("maps are made again and again")


@pytest.fixture
def live(device, found):
    renderer = renderer_of(found)
    yield renderer
    renderer.free()


def image_of(renderer, name):
    """(H, W, 4) of the map of a reflector, distances in m."""
    maps = renderer.mirrors.maps
    texture = maps._images[name][1]
    image = np.array(texture.read(), np.float32).reshape(texture.height, texture.width, 4)
    image[..., 3] *= maps._assets[name].uniforms["distance_scale"]
    return image


def test_texels_are_what_rays_from_the_middle_meet(live):
    """Without the ball itself; borders too. Where the pane shows something, as far as its image is."""
    settle(live)
    shown = image_of(live, "Second")[: SIDE + 2].reshape(-1, 4)
    others = replace(SCENE, instances=tuple(i for i in SCENE.instances if i.name != "Second"))
    rays = cubemap.bundle(live.mirrors.maps.curved[0].center, SIDE)
    truth = tracer(others, paint)(rays, bounces=0)
    names = [i.name for i in others.instances]
    plain = np.isin(truth.object, [names.index(n) for n in ("Torus", "Rock", "Floor")]) & truth.hit
    distance = np.linalg.norm(truth.position - rays.origin, axis=1)
    same = np.abs(shown[:, 3] - distance) < tolerances.MAP_DISTANCE * distance
    assert plain.sum() > 1000 and same[plain].mean() > 1 - tolerances.MAP_EDGE
    sky = ~truth.hit
    assert (shown[sky, 3] == 0).mean() > 1 - tolerances.MAP_EDGE
    near = truth.hit & (truth.object == names.index("Mirror"))
    lifted = Rays((truth.position + [1e-5, 0, 0]).astype(np.float32), (rays.direction * [-1, 1, 1]).astype(np.float32))
    second = tracer(SCENE, paint)(Rays(lifted.origin[near], lifted.direction[near]), bounces=0)
    beyond = distance[near] + np.linalg.norm(second.position - truth.position[near], axis=1)
    right = np.abs(shown[near, 3] - beyond) < tolerances.MAP_DISTANCE * beyond
    dull = second.hit & np.isin(second.object, [[i.name for i in SCENE.instances].index(n) for n in ("Torus", "Rock", "Floor")])
    assert dull.sum() > 100 and right[dull].mean() > 1 - 2 * tolerances.MAP_EDGE


def test_coarser_levels_are_means(live):
    """As core/cubemap.py makes them of the same level 0, borders but for how they are looked up."""
    settle(live)
    image = image_of(live, "Third")
    made = cubemap.pyramid(image[: SIDE + 2, : 6 * (SIDE + 2)]).astype(np.float32)
    for level in range(1, cubemap.level_count(SIDE)):
        (x, y), n = cubemap.level_origin(SIDE, level), SIDE >> level
        ours, theirs = (part[y : y + n + 2, x : x + 6 * (n + 2), :3].reshape(n + 2, 6, n + 2, 3) for part in (image, made))
        np.testing.assert_allclose(ours[1:-1, :, 1:-1], theirs[1:-1, :, 1:-1], atol=tolerances.MAP_HALF)
        assert np.median(np.abs(ours - theirs)) < tolerances.MAP_HALF and np.abs(ours - theirs).max() < 0.5


def test_at_rest_no_map_is_made(live):
    """In the frames that are said; then a camera's move costs its own picture."""
    assert settle(live) <= live.mirrors.maps.frames_to_settle
    live.picture(CAMERA)
    before = live.counts()
    for eye in ((1.2, -1.8, 1.4), (1.9, -1.2, 1.5)):
        live.picture(hand_scenes.camera(eye, (-0.3, 0.1, 0.7), (96, 72), fov=0.9))
    after = live.counts()
    assert all(after[name] == before[name] for name in ("faces", "uploads", "compiles"))


def test_a_frame_makes_as_many_as_it_may_and_rests_again(device, found):
    renderer = renderer_of(found, maps_per_frame=1)
    settle(renderer)
    for step in range(1, 4):
        before = renderer.counts()["faces"]
        renderer.scene.update(room((0.1 * step, 0, 0)))
        assert not renderer.settled
        renderer.answer(CAMERA, positions=False)
        assert renderer.counts()["faces"] == before + 6
    assert settle(renderer) <= renderer.mirrors.maps.frames_to_settle
    renderer.free()


def test_what_moved_is_shown_where_it_is(device, found):
    """A renderer that followed shows what one shows that began there."""
    now = room((0.15, 0.1, 0.1))
    moved, fresh = renderer_of(found), renderer_of(found)
    settle(moved)
    moved.scene.update(now), fresh.scene.update(now)
    settle(moved), settle(fresh)
    for _ in range(2):
        fresh.mirrors.maps.expire()
        settle(fresh)
    one, other = (renderer.answer(CAMERA) for renderer in (moved, fresh))
    assert np.percentile(np.abs(one.radiance - other.radiance), 99) < tolerances.MAP_SETTLED
    moved.free(), fresh.free()


def test_a_map_answers_nearer_to_the_truth_than_its_directions(live, found, monkeypatch):
    """The balls' pixels against Embree: places count. Before a map is there, the asset answers."""
    settle(live)
    answer, ray_map = live.answer(CAMERA), live.ray_map(CAMERA)
    mask, rays = ray_map.covered(), ray_map.rays()
    lifted = (rays.origin + 2e-6 * SCENE.diagonal() * ray_map.normal[mask]).astype(np.float32)
    truth = tracer(SCENE, paint)(replace(rays, origin=lifted), bounces=6)
    truth, hit = truth.radiance, truth.hit
    mine = hit & np.isin(ray_map.reflector[mask], [c.reflector for c in live.mirrors.maps.curved])
    error = np.median(np.abs(answer.radiance[mask] - truth)[mine])
    assert mine.sum() > 200 and np.isfinite(answer.radiance).all()
    monkeypatch.setattr(live_maps, "trace", environment.trace)
    flat = renderer_of(found)
    settle(flat)
    assert error < tolerances.MAP_PLACED * np.median(np.abs(flat.answer(CAMERA).radiance[mask] - truth)[mine])
    flat.free()


def test_lines_are_answered_as_the_kernel_says(live):
    """A frame without footprints, in NumPy: mirrored in the pane, and not. Footprints blur, so the frame with them is another."""
    settle(live)
    frames = [live.answer(CAMERA, footprints=lined) for lined in (False, True)]
    ray_map, maps = live.ray_map(CAMERA), live.mirrors.maps
    for curved, name in zip(maps.curved, BALLS, strict=True):
        mask = ray_map.reflector == curved.reflector
        asset, texture = maps.asset_of(curved.reflector), maps._images[name][1]
        image = np.array(texture.read(), np.float32).reshape(texture.height, texture.width, 4).astype(np.float16)
        asset = replace(asset, images={"radiance_tx": image})
        rays = Rays(ray_map.origin[mask], ray_map.direction[mask])
        told = run_numpy(record(live_maps.trace, asset), asset, rays)
        plain = run_numpy(record(layered_distance.trace, asset), asset, rays)
        same = np.abs(frames[0].radiance[mask] - told.radiance).max(1) < tolerances.MAP_SETTLED
        mirrored = (told.position != plain.position).any(1)
        assert mirrored.sum() > MIRRORED and (~mirrored).sum() > MIRRORED and same.mean() > 1 - tolerances.MAP_EDGE
        assert np.abs(frames[1].radiance[mask] - told.radiance).mean() > np.abs(frames[0].radiance[mask] - told.radiance).mean()


def test_without_the_setting_the_baked_asset_answers(device, found):
    renderer = renderer_of(found, curved=False)
    answer, ray_map = renderer.answer(CAMERA), renderer.ray_map(CAMERA)
    second = ray_map.reflector == ray_map.reflector_names.index("Second")
    assert (answer.status[second] == STATUS_FELL_BACK).all() and renderer.settled and renderer.counts()["faces"] == 0
    renderer.free()


def test_lamps_are_in_the_map(device):
    """Which are no surfaces: each texel's ray adds them to what it meets."""
    from reflect_addon.gpu.renderer import Renderer

    scene = lit_scene()
    made = baked(scene, curved=True, map_side=SIDE)
    surfaces = surface_radiance.bake(scene, lit_tracer(scene), (*scene.instances, *scene.lamps), SURFACES)
    shown = []
    for lamps in (scene.lamps, ()):
        renderer = Renderer(replace(scene, lamps=lamps), made.assets, surfaces=surfaces)
        renderer.settle(CAMERA)
        (name,) = renderer.reflector_names
        shown.append(image_of(renderer, name)[: SIDE + 2, :, :3].reshape(-1, 3))
        center = renderer.mirrors.maps.curved[0].center
        renderer.free()
    others = replace(scene, instances=tuple(i for i in scene.instances if i.name != name))
    rays = cubemap.bundle(center, SIDE)
    added = lit_tracer(others)(rays).radiance - tracer(others, virtual_scenes.paint)(rays).radiance
    lit = added.max(1) > 0.5
    same = np.abs(shown[0] - shown[1] - added).max(1) < tolerances.MAP_SETTLED
    assert lit.sum() > 100 and same[lit].mean() > 1 - tolerances.MAP_EDGE and same.mean() > 1 - tolerances.MAP_EDGE


def at(distance):
    """Straight before the third ball, so far from its middle."""
    place = np.array(BALLS["Third"][0])
    return hand_scenes.camera(place + [distance, 0, 0.2], place, (96, 72), fov=0.9)


def test_maps_are_as_large_as_seen_and_do_not_pop(device, found):
    """A camera that moves to and fro about a step between sizes: a map grows once, when it is too small, and stays; far off, it shrinks when it is made."""
    renderer = renderer_of(found, map_side=128, maps_per_frame=9)
    maps = renderer.mirrors.maps
    sides = {d: int(side_of(cube_sides(np.array([BALLS["Third"][0]]), np.array([BALLS["Third"][1]]), at(d))[0], 128, None, CUBE_STEP)) for d in np.linspace(1, 2, 60)}
    step = next(far for near, far in zip(sides, list(sides)[1:], strict=False) if sides[near] != sides[far])
    small, large = sorted({sides[d] for d in sides if abs(d - step) < 0.02})
    settle(renderer, at(step + 0.02))
    assert maps.sides["Third"] == small
    drawn = []
    for frame in range(12):
        before = renderer.counts()
        renderer.answer(at(step + 0.02 * np.cos(1.7 * frame)), positions=False)
        drawn.append(renderer.counts()["faces"] - before["faces"])
    assert maps.sides["Third"] == large and sum(drawn[:3]) > 0 and not any(drawn[3:]), drawn
    image = image_of(renderer, "Third")
    assert image.shape[:2] == cubemap.image_size(large) and np.isfinite(image).all()
    before = renderer.counts()
    renderer.answer(at(30.0), positions=False)
    assert maps.sides["Third"] == large and renderer.counts()["faces"] == before["faces"], "what is large enough is kept"
    maps.expire()
    settle(renderer, at(30.0))
    assert maps.sides["Third"] < small and image_of(renderer, "Third").shape[:2] == cubemap.image_size(maps.sides["Third"])
    renderer.free()


def test_without_the_culling_maps_have_their_full_side(device, found):
    renderer = renderer_of(found, cull_size=False)
    settle(renderer, at(30.0))
    assert set(renderer.mirrors.maps.sides.values()) == {SIDE}
    renderer.free()
