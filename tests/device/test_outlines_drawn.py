"""gpu/outlines.py: lines where the stand-ins are, faint behind things, of the active reflector and of nothing else."""

from types import SimpleNamespace

import hand_scenes as scenes
import numpy as np
import pytest

from reflect_addon.core import methods
from reflect_addon.core.look import Look
from reflect_addon.core.outlines import Outlines, of_box

SIZE = (192, 128)
CAMERA = scenes.camera((0, -5, 1), (0, 0, 0), SIZE)


@pytest.fixture
def shown(device, monkeypatch):
    """A session on a mirror ball with a box around it that is nothing but an outline."""
    from reflect_addon.gpu import handler, session

    made = []

    def outlines(asset):
        made.append(asset)
        return of_box([-1.5] * 3, [1.5] * 3) + Outlines(points=np.zeros((1, 3)))

    snapshot = scenes.snapshot(("ball", scenes.sphere_mesh(), scenes.placed(scale=0.2), scenes.MIRROR))
    monkeypatch.setitem(methods._METHODS, "sky", SimpleNamespace(NAME="sky", outlines=outlines, trace=scenes.sky_kernel, REQUIRES=(), DEFAULTS={}))
    view = session.ViewportSession(lambda: snapshot, lambda last: last or Look(), kernel=scenes.kernels)
    view.set_assets("sky", {"": scenes.sky_asset()})
    view.shows_outlines = True
    session.set_session("Scene", view)
    view.refresh()
    screen = device.types.GPUOffScreen(*SIZE, format="RGBA16F")

    def draw(active="ball", depth=1.0):
        data = SimpleNamespace(view_matrix=np.linalg.inv(CAMERA.world_from_camera), window_matrix=CAMERA.clip_from_camera)
        region = SimpleNamespace(width=SIZE[0], height=SIZE[1])
        with screen.bind():
            framebuffer = device.state.active_framebuffer_get()
            framebuffer.clear(color=(0, 0, 0, 0), depth=depth)
            handler.draw(
                SimpleNamespace(scene=SimpleNamespace(name="Scene"), region=region, region_data=data, object=active and SimpleNamespace(name=active))
            )
            assert not view.message, view.message
            return np.array(framebuffer.read_color(0, 0, *SIZE, 4, 0, "FLOAT").to_list(), np.float32)

    yield SimpleNamespace(draw=draw, view=view, made=made)
    session.end_all()
    screen.free()


def pixels_of(points):
    clip = np.concatenate([points, np.ones((len(points), 1))], -1) @ CAMERA.clip_from_world().T
    return ((clip[:, :2] / clip[:, 3:] * 0.5 + 0.5) * SIZE).astype(int)


def test_lines_lie_on_the_edges(shown):
    plain = shown.draw(active=None)
    seen = shown.draw()
    added = np.abs(seen - plain).max(-1) > 0.05
    lines = of_box([-1.5] * 3, [1.5] * 3).lines
    along = lines[:, :1] + (lines[:, 1:] - lines[:, :1]) * np.linspace(0, 1, 200)[None, :, None]
    x, y = pixels_of(along.reshape(-1, 3)).T
    inside = (x >= 2) & (x < SIZE[0] - 2) & (y >= 2) & (y < SIZE[1] - 2)
    near = np.zeros(SIZE[::-1], bool)
    for dx in range(-2, 3):
        for dy in range(-2, 3):
            near[(y + dy)[inside], (x + dx)[inside]] = True
    center = pixels_of(np.zeros((1, 3)))[0]
    near[center[1] - 6 : center[1] + 7, center[0] - 6 : center[0] + 7] = True
    assert added.sum() > 300 and not (added & ~near).any()
    assert added[y[inside], x[inside]].mean() > 0.95


def test_what_is_behind_is_faint(shown):
    bright, faint = shown.draw()[..., 0], shown.draw(depth=0.0)[..., 0]
    assert 0 < faint.max() < 0.5 * bright.max()


def test_only_of_the_active_reflector_and_uploaded_once(shown):
    for _ in range(3):
        shown.draw()
    assert len(shown.made) == 1
    plain = shown.draw(active=None)
    assert not shown.view.outlines and np.array_equal(shown.draw(active="Camera"), plain)
    shown.view.shows_outlines = False
    assert np.array_equal(shown.draw(), plain) and len(shown.made) == 1


def test_a_method_without_outlines_has_none(shown, monkeypatch):
    monkeypatch.delattr(methods.get("sky"), "outlines")
    assert np.array_equal(shown.draw(), shown.draw(active=None))
