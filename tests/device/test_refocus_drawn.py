"""A dragged focus: every step is drawn, and nothing is uploaded, compiled or allocated for it."""

from types import SimpleNamespace

import hand_scenes as scenes
import numpy as np
import pytest

from reflect_addon.core.asset import Asset
from reflect_addon.core.focus import refocused
from reflect_addon.core.light_field import Cell
from reflect_addon.core.look import Look

CELL = Cell(np.zeros(3), np.ones(3), 4, 16)
CAMERA = scenes.camera((0, -5, 1), (0, 0, 0))


@pytest.fixture
def view(device, rng):
    from reflect_addon.gpu import session

    uniforms = {**CELL.uniforms(), "light_scale": 1.0, "focus": (0.0,) * 3, "focus_back": (0.0,) * 3}
    options = {"views": 4, "texels": 16, "columns": CELL.columns(), "depth": False, "coded": False}
    atlas = rng.random((*CELL.shape(), 4)).astype(np.float16)
    ball = scenes.snapshot(("ball", scenes.sphere_mesh(), scenes.placed(), scenes.MIRROR))
    view = session.ViewportSession(lambda: ball, lambda last: last or Look())
    assets = {"ball": Asset("light_field", "ball", {"light_field_tx": atlas}, uniforms, options)}
    view.set_assets("light_field", assets)
    view.refresh()
    yield SimpleNamespace(view=view, assets=assets)
    view.free()


def test_a_drag_only_draws(view):
    renderer = view.view.current_renderer()
    pictures = [renderer.picture(CAMERA)]
    before = renderer.counts()
    for distance in (0.5, 1.0, 2.0, 0.0):
        wanted = refocused(view.assets, distance)
        assert not view.view.shows_others("light_field", wanted), "no text of compiling, no waiting"
        view.view.set_assets("light_field", wanted)
        view.view.refresh()
        assert view.view.current_renderer() is renderer
        pictures.append(renderer.picture(CAMERA))
    after = renderer.counts()
    for name in ("uploads", "upload_bytes", "compiles", "allocations"):
        assert after[name] == before[name], name
    differ = [np.abs(p - pictures[0]).max() > 0.05 for p in pictures]
    assert differ == [False, True, True, True, False]


def test_other_assets_are_others(view):
    asset = view.assets["ball"]
    other = Asset(asset.kind, "ball", dict(asset.images), asset.uniforms, asset.options)
    assert view.view.shows_others("light_field", {"ball": other}) and view.view.shows_others("light_field", {})
    assert view.view.shows_others("environment", view.assets)
