"""The sidebar's panel "Overlays": what it says of the error in a view."""

from types import SimpleNamespace

import bpy
import pytest
from panel_text import drawn

import reflect_addon
from reflect_addon.core import methods
from reflect_addon.core.planning.errors import Measured
from reflect_addon.scene import live


@pytest.fixture
def registered(fresh_file):
    reflect_addon.register()
    yield bpy.context.scene
    reflect_addon.unregister()


def test_it_says_what_is_measured_and_why_nothing_is(registered):
    assert "Measured when" not in drawn()
    registered.reflect.method = "environment"
    assert "Measured when" not in drawn()
    registered.reflect.shows_error = True
    assert "Measured when the view rests" in drawn()
    view = SimpleNamespace(heat=None, settled=False)
    live.of(registered).heat_of = {1: view}.get
    assert "Measured when the view rests" in drawn()
    view.settled = True
    assert "No reflector is seen" in drawn()
    view.heat, view.settled = SimpleNamespace(seen=Measured(3.21, 4.0, 0.456, 0.02), share=0.25), False
    text = drawn()
    assert "Mean 0.46\N{DEGREE SIGN}" in text and "95 % within 3.21\N{DEGREE SIGN}" in text and "2.0% show the sky" in text and "25% measured" in text
    view.settled = True
    assert "25%" not in drawn()
    for name in methods.names():
        registered.reflect.method = name
        assert ("there is nothing to measure" in drawn()) == (name not in methods.gathering()), name
