"""gpu/heat.py: the map lies over the reflectors and nothing else, in the colours of its legend, and goes when the view or the scene changes."""

from types import SimpleNamespace

import hand_scenes as scenes
import numpy as np
import pytest

from reflect_addon.core import methods
from reflect_addon.core.asset import Asset
from reflect_addon.core.look import Look
from reflect_addon.core.planning.heat import STEP
from reflect_addon.core.planning.heat_colors import color_at, place_of

SIZE = (96, 64)


@pytest.fixture
def shown(device, monkeypatch):
    """A session on a mirror ball beside a crate, with an environment map of one colour; draws as Blender would, turns as its timer would."""
    from reflect_addon.gpu import handler, heat, judging, session

    monkeypatch.setattr(heat, "REST", 0.0)
    monkeypatch.setattr(judging, "viewports", lambda: [(area, SimpleNamespace(as_pointer=lambda: 7))])
    redraws = []
    area = SimpleNamespace(tag_redraw=lambda: redraws.append(1))
    snapshot = scenes.snapshot(
        ("ball", scenes.sphere_mesh(), scenes.placed(), scenes.MIRROR), ("crate", scenes.cube_mesh(), scenes.placed((1.2, -2.0, 0.9), 0.4), scenes.MATTE)
    )
    image = np.ones((8, 48, 4), np.float16)
    asset = Asset("white", "", {"unused_tx": image})
    monkeypatch.setitem(methods._METHODS, "white", SimpleNamespace(NAME="white", trace=scenes.white_kernel, REQUIRES=(), DEFAULTS={}))
    view = session.ViewportSession(lambda: snapshot, lambda last: last or Look(), kernel=scenes.kernels)
    view.set_assets("white", {"": asset})
    view.shows_error = True
    session.set_session("Scene", view)
    view.refresh()
    screen = device.types.GPUOffScreen(*SIZE, format="RGBA16F")

    def draw(eye=(0, -5, 1)):
        camera = scenes.camera(eye, (0, 0, 0), SIZE)
        region = SimpleNamespace(width=SIZE[0], height=SIZE[1], as_pointer=lambda: 7)
        data = SimpleNamespace(view_matrix=np.linalg.inv(camera.world_from_camera), window_matrix=camera.clip_from_camera)
        with screen.bind():
            framebuffer = device.state.active_framebuffer_get()
            framebuffer.clear(color=(0, 0, 0, 0), depth=1.0)
            handler.draw(SimpleNamespace(scene=SimpleNamespace(name="Scene"), region=region, region_data=data))
            assert not view.message
            return np.array(framebuffer.read_color(0, 0, *SIZE, 4, 0, "FLOAT").to_list(), np.float32)

    def rest():
        """Until all is measured, with the draws that are asked for; the last picture."""
        draw()
        for _ in range(500):
            if redraws:
                redraws.clear()
                draw()
            if judging.measure() is None and not redraws:
                return draw()
        raise AssertionError("it never ends")

    yield SimpleNamespace(draw=draw, rest=rest, view=view, handler=handler, judging=judging, redraws=redraws, snapshot=snapshot)
    judging.stop()
    session.end_all()
    screen.free()


def heat_of(shown):
    return shown.view.heats[7]


def test_it_lies_over_the_reflectors_in_its_colours(shown):
    plain = shown.draw()
    picture = shown.rest()
    heat = heat_of(shown)
    assert heat.settled and heat.heat.share == 1.0
    # Everything is shown a metre away: where the sky is met that is 90 degrees, the last colour, and less where the crate is.
    covered = plain[..., 3] > 0.5
    assert covered.sum() > 500 and np.array_equal(picture[..., 3] > 0.5, covered)
    y, x = np.nonzero(covered)
    encoded = np.where(picture <= 0.0031308, 12.92 * picture, 1.055 * np.maximum(picture, 0.0031308) ** (1 / 2.4) - 0.055)[y, x, :3]
    degrees = heat.heat.degrees[y // STEP, x // STEP]
    own = np.isfinite(degrees) & (heat.heat.reflector[y // STEP, x // STEP] == 0)
    assert np.abs(encoded[own] - color_at(place_of(degrees[own]))).max() < 0.01
    assert own.mean() > 0.8 and (degrees[own] == 90).any() and (degrees[own] < 80).any()
    colors = color_at(place_of(heat.heat.degrees[np.isfinite(heat.heat.degrees)]))
    assert min(np.abs(colors - c).sum(-1).min() for c in encoded[~own]) < 0.01, "edges have the colour of the reflector's nearest ray"


def test_another_view_drops_it_and_nothing_is_measured_until_that_rests(shown, monkeypatch):
    shown.rest()
    old = heat_of(shown).heat
    moved = shown.draw((1, -5, 1))
    assert heat_of(shown).heat is None and not heat_of(shown).settled
    shown.view.shows_error = False
    assert np.array_equal(shown.draw((1, -5, 1)), moved), "while it is dropped the picture is the plain one"
    assert not shown.view.heats and old is not None


def test_another_scene_and_other_assets_drop_it(shown):
    shown.rest()
    shown.view.dirty = True
    assert shown.view.refresh()
    shown.draw()
    assert heat_of(shown).heat is not None, "the same scene, looked at again"
    shown.view.set_assets("white", {"": Asset("white", "", {"unused_tx": np.zeros((8, 48, 4), np.float16)})})
    assert shown.view.refresh()
    shown.draw()
    assert heat_of(shown).heat is None
    shown.rest()
    other = scenes.snapshot(("ball", scenes.sphere_mesh(), scenes.placed(scale=0.5), scenes.MIRROR))
    shown.view.snapshot_of, shown.view.dirty = lambda: other, True
    assert shown.view.refresh()
    shown.draw()
    assert heat_of(shown).heat is None


def test_it_waits_for_rest(shown, monkeypatch):
    from reflect_addon.gpu import heat

    monkeypatch.setattr(heat, "REST", 3600.0)
    shown.draw()
    assert shown.judging.measure() == heat.PAUSE and not heat_of(shown).due and not shown.redraws


def test_off_it_costs_nothing(shown):
    shown.view.shows_error = False
    shown.draw()
    before = shown.view.current_renderer().counts()
    shown.draw()
    after = shown.view.current_renderer().counts()
    assert {k: after[k] - before[k] for k in ("uploads", "compiles", "allocations", "readbacks")} == dict.fromkeys(("uploads", "compiles", "allocations", "readbacks"), 0)
    assert not shown.view.heats and shown.judging.measure() is None


def test_what_fails_while_measuring_is_said_once(shown, monkeypatch, capsys):
    from reflect_addon.gpu import heat

    def broken(*_):
        raise RuntimeError("broken on purpose")

    monkeypatch.setattr(heat.ViewHeat, "work", broken)
    shown.draw()
    assert shown.judging.measure() is not None and "broken on purpose" in shown.view.message
    assert shown.judging.measure() is None
    capsys.readouterr()
