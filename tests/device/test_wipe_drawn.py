"""An A/B wipe: each side shows its own method's picture, and the other one costs nothing before and after."""

from types import SimpleNamespace

import hand_scenes as scenes
import numpy as np
import pytest

from reflect_addon.core.look import Look
from reflect_addon.scene.view_truth import ViewTruth
from reflect_addon.scene.wipe import Wipe, truth_wipe

SIZE = (96, 64)
GREEN = {"ground": (0, 1, 0), "zenith": (0, 1, 0)}


@pytest.fixture
def shown(device):
    """A session on a mirror ball, and a draw as Blender would call it."""
    from reflect_addon.gpu import handler, session

    snapshot = scenes.snapshot(("ball", scenes.sphere_mesh(), scenes.placed(), scenes.MIRROR))
    view = session.ViewportSession(lambda: snapshot, lambda last: last or Look(), kernel=scenes.kernels)
    view.set_assets("sky", {"": scenes.sky_asset()})
    session.set_session("Scene", view)
    screen = device.types.GPUOffScreen(*SIZE, format="RGBA16F")
    camera = scenes.camera((0, -5, 1), (0, 0, 0), SIZE)

    def draw():
        view.refresh()
        data = SimpleNamespace(view_matrix=np.linalg.inv(camera.world_from_camera), window_matrix=camera.clip_from_camera)
        with screen.bind():
            framebuffer = device.state.active_framebuffer_get()
            framebuffer.clear(color=(0, 0, 0, 0), depth=1.0)
            handler.draw(SimpleNamespace(scene=SimpleNamespace(name="Scene"), region=SimpleNamespace(width=SIZE[0], height=SIZE[1]), region_data=data))
            return np.array(framebuffer.read_color(0, 0, *SIZE, 4, 0, "FLOAT").to_list(), np.float32)

    yield SimpleNamespace(draw=draw, view=view, session=session)
    session.end_all()
    screen.free()


def wipe(place):
    return Wipe("sky", {"": scenes.sky_asset(**GREEN)}, None, place)


def test_each_side_shows_its_own_method(shown):
    left = shown.draw()
    shown.view.set_wipe(right := wipe(0.0))
    other = shown.draw()
    assert other[..., 3].max() > 0.5 and other[..., 0].max() < 0.01 < left[..., 0].max()
    for place in (0.25, 0.5, 1.0):
        right.place = place
        x = round(place * SIZE[0])
        seen = shown.draw()
        assert np.array_equal(seen[:, :x], left[:, :x]) and np.array_equal(seen[:, x:], other[:, x:])


def test_what_is_beside_it_is_uploaded_while_it_is_on_alone(shown):
    shown.draw()
    before = shown.view.current_renderer().counts()
    shown.view.set_wipe(wipe(0.5))
    shown.draw()
    other = shown.view.other
    assert other.current_renderer().counts()["uploads"] > 0
    shown.view.set_wipe(None)
    shown.draw()
    assert shown.view.other is None and other._renderer is None, "freed where drawing is allowed"
    after = shown.view.current_renderer().counts()
    assert all(after[name] == before[name] for name in ("uploads", "compiles", "allocations")), "the scene's own method is not touched"


def test_what_moves_moves_on_both_sides(shown):
    shown.view.set_wipe(wipe(0.5))
    before = shown.draw()
    moved = scenes.snapshot(("ball", scenes.sphere_mesh(), scenes.placed(scale=0.5), scenes.MIRROR))
    shown.view.snapshot_of, shown.view.dirty = lambda: moved, True
    shown.view.other.snapshot_of = shown.view.snapshot_of
    after = shown.draw()
    half = SIZE[0] // 2
    for side in (np.s_[:, :half], np.s_[:, half:]):
        assert 0 < (after[side][..., 3] > 0.5).sum() < 0.6 * (before[side][..., 3] > 0.5).sum()


def test_the_truth_is_shown_in_its_own_view_alone(shown):
    plain = shown.draw()
    covered = plain[..., 3] > 0.5
    picture = np.zeros((*SIZE[::-1], 4), np.float32)
    picture[...] = 0.1, 0.2, 0.3, 1.0
    own = ViewTruth(scenes.camera((0, -5, 1), (0, 0, 0), SIZE), picture)
    other = ViewTruth(scenes.camera((0.01, -5, 1), (0, 0, 0), SIZE), picture)
    half = SIZE[0] // 2
    for half_distance in (None, 1.0):
        shown.view.attenuation, shown.view.dirty = half_distance, True
        shown.view.set_wipe(truth_wipe(own))
        seen = shown.draw()
        right = covered[:, half:]
        assert shown.view.truth.label == "Truth"
        assert right.sum() > 200 and np.array_equal(seen[:, half:, 3] > 0.5, right)
        np.testing.assert_allclose(seen[:, half:][right][:, :3], np.broadcast_to((0.1, 0.2, 0.3), (right.sum(), 3)), atol=2e-3)
        shown.view.set_wipe(truth_wipe(other))
        assert shown.draw()[:, half:].max() == 0 and "another view" in shown.view.truth.label


def test_a_failure_of_the_other_side_leaves_this_one(shown, capsys):
    left = shown.draw()
    shown.view.set_wipe(wipe(0.5))
    shown.view.other.kernel = lambda kind: None
    seen = shown.draw()
    half = SIZE[0] // 2
    assert np.array_equal(seen[:, :half], left[:, :half]) and seen[:, half:].max() == 0
    assert "Reflections are off" in shown.view.other.message and not shown.view.message
    capsys.readouterr()
