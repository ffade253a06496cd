"""Native reflections in a real Blender window, in Material Preview and Rendered; see run_native.py. Needs root and the blender-desktop tool."""

import pytest
from test_window import session


@pytest.mark.alone
@pytest.mark.desktop
def test_materials_mirror_the_room_and_go_again():
    found = session("run_native", "contact.blend")
    assert "08-removed-rendered" in found["steps"]


@pytest.mark.slow
@pytest.mark.alone
@pytest.mark.desktop
def test_methods_are_switched_live():
    found = session("run_native_methods", "contact.blend")
    assert "03-light_field-material" in found["steps"]


@pytest.mark.slow
@pytest.mark.alone
@pytest.mark.desktop
def test_reflections_follow_and_old_assets_change_nothing():
    found = session("run_native_follow", "contact.blend")
    assert "06-missing" in found["steps"]


@pytest.mark.slow
@pytest.mark.alone
@pytest.mark.desktop
def test_auto_by_mouse():
    found = session("run_auto", "contact.blend")
    assert "08-view" in found["steps"] and found["plan"]["measured"] <= 1.0


@pytest.mark.slow
@pytest.mark.alone
@pytest.mark.desktop
def test_errors_are_seen_and_methods_compared_by_mouse():
    found = session("run_heat", "contact.blend")
    assert "19-none" in found["steps"]
