"""core/scene_moves.py: balls around what moved, came, went or changed; and core/live_maps.py and cubemap.across, which live maps rest on."""

from dataclasses import replace

import numpy as np
from mirror_rooms import one_mirror
from virtual_scenes import ball

from reflect_addon.core import cubemap
from reflect_addon.core.kernel import evaluate, record_function
from reflect_addon.core.live_maps import reach_of
from reflect_addon.core.methods.recursive import drawn_mirrors
from reflect_addon.core.scene_moves import all_changed, moved_between
from reflect_addon.core.spaces import cube_coordinates

SCENE = one_mirror(Second=ball(0.3, (0.0, 0.1, 0.9), 3))


def with_pose(scene, name, pose):
    return replace(scene, instances=tuple(replace(i, world_from_object=pose) if i.name == name else i for i in scene.instances))


def test_nothing_moves_in_the_same_scene():
    assert moved_between(SCENE, replace(SCENE, frame=2)) == () and not all_changed(SCENE, replace(SCENE, frame=2))
    assert all_changed(SCENE, replace(SCENE, light_hash="night")) and all_changed(SCENE, replace(SCENE, materials=SCENE.materials[::-1]))


def test_what_moved_is_a_ball_around_both_places(rng):
    turn = np.eye(4)
    turn[:2, :2] = [[0, -1], [1, 0]]
    turn[:3, 3] = 0.4, 0.1, 0.2
    before = SCENE.named()["Torus"]
    now = with_pose(SCENE, "Torus", turn @ before.world_from_object)
    (found,) = moved_between(SCENE, now)
    places = [scene.world_positions(scene.named()["Torus"]) for scene in (SCENE, now)]
    assert found.instance == "Torus"
    assert np.isclose(found.distance, np.linalg.norm(places[1] - places[0], axis=1).max())
    assert (np.linalg.norm(np.concatenate(places) - found.center, axis=1) <= found.radius * (1 + 1e-9)).all()


def test_what_comes_goes_or_is_hidden_changed_all_over():
    without = replace(SCENE, instances=tuple(i for i in SCENE.instances if i.name != "Rock"))
    for before, now in ((SCENE, without), (without, SCENE)):
        (found,) = moved_between(before, now)
        assert found.instance == "Rock" and found.distance == found.radius
    unseen = replace(SCENE, instances=tuple(replace(i, visible_glossy=i.name != "Rock") for i in SCENE.instances))
    assert [m.instance for m in moved_between(SCENE, unseen)] == ["Rock"] and moved_between(unseen, without) == ()


def test_no_stored_distance_passes_half_floats():
    """The farthest corner, and as much again behind a mirror."""
    _, (curved,) = drawn_mirrors(SCENE)
    low, high = SCENE.bounds()
    reach = reach_of(SCENE, curved)
    farthest = max(np.linalg.norm(low - curved.center), np.linalg.norm(high - curved.center)) + np.linalg.norm(high - low)
    assert farthest / reach.scale < 65504


def test_borders_look_past_the_edge():
    """cubemap.across is spaces' rule of what a border's texel sees."""
    n = 16
    directions = cubemap.texel_directions(n)
    step = (np.arange(n + 2) - 0.5) / n * 2 - 1
    face, column = np.divmod(np.arange(6 * (n + 2)), n + 2)
    given = [np.broadcast_to(v, directions.shape[:2]).ravel().astype(float) for v in (face[None], step[column][None], step[:, None])]
    found = evaluate(record_function(cubemap.across, cubemap.ACROSS_INPUTS), dict(zip("face s t".split(), given, strict=True)), dtype=np.float64)
    for ours, theirs in zip((found["face"], found["s"], found["t"]), cube_coordinates(directions.reshape(-1, 3)), strict=True):
        np.testing.assert_allclose(ours, theirs, atol=1e-9)
