"""A light field in a window, as the panel tells it: a reflector that moves in its cell, one that leaves it, focus and background."""

import bpy
import numpy as np
import pytest
from panel_text import drawn
from test_ops import ball, fake_worker, live_state, registered  # noqa: F401  two of them are fixtures

from reflect_addon.core.asset import Asset
from reflect_addon.core.asset_files import save_asset
from reflect_addon.core.light_field import Cell


def light_field(inputs="old", **settings):
    """Of the ball of radius 1 at the origin: a cell of twice its size."""
    cell = Cell(np.zeros(3), np.full(3, 2.0), 2, 4)
    uniforms = {**cell.uniforms(), "light_scale": 1.0, "focus": (0.0,) * 3, "focus_back": (0.0,) * 3}
    uniforms |= {"rays": 300.0, "views_used": 24.0, "contact": 1.0, "everywhere": 1.0}
    options = {"views": 2, "texels": 4, "columns": cell.columns(), "depth": False, "coded": False}
    images = {"light_field_tx": np.ones((*cell.shape(), 4), np.float16)}
    return Asset("light_field", "Ball", images, uniforms, options, inputs_hash=inputs, settings=settings)


@pytest.fixture
def baked(ball, monkeypatch, tmp_path):  # noqa: F811
    """The ball's light field, baked from this window."""
    from reflect_addon.scene.places import assets_of

    bpy.context.scene.reflect.method = "light_field"
    folder, source = assets_of(bpy.context.scene) / "light_field-Ball", save_asset(light_field(cameras=True), tmp_path / "made")
    fake_worker(
        monkeypatch,
        f"import shutil; shutil.copytree({str(source)!r}, {str(folder)!r}); print(json.dumps({{'done': [{str(folder)!r}]}}))",
    )
    assert bpy.ops.reflect.bake() == {"FINISHED"}
    return ball


def move(obj, x):
    obj.location.x = x
    bpy.context.view_layer.update()
    bpy.ops.reflect.refresh()


def test_a_reflector_moves_in_its_cell_and_is_told_when_it_leaves(baked):
    assert live_state().stale == ()
    move(baked, 0.9)
    assert (live_state().stale, live_state().compared.remarks) == ((), {}), "in its cell: nothing is stale"
    move(baked, 1.5)
    assert live_state().stale == ("Ball",)
    text = drawn()
    assert "Ball has left its light field's cell" in text and "Bake Again" in text
    assert "The scene changed" not in text, "one sentence for one thing"
    move(baked, 0.0)
    assert live_state().stale == () and "has left" not in drawn()


def test_another_object_that_moves_makes_it_stale(baked):
    bpy.ops.mesh.primitive_cube_add(location=(5, 0, 0))
    bpy.ops.reflect.refresh()
    text = drawn()
    assert live_state().stale == ("Ball",) and "The scene changed since the bake of Ball" in text and "has left" not in text


def test_the_scenes_camera_that_leaves_is_told_of(baked):
    scene = bpy.context.scene
    scene.camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.collection.objects.link(scene.camera)
    move(scene.camera, 1.8)
    assert live_state().compared.remarks == {}
    move(scene.camera, 2.5)
    assert "The camera has left" in drawn()


def test_what_was_left_out_is_said(baked):
    assert "Ball: Light field: 6 of 6 slabs, 24 of 24 views" in drawn()


def test_fields_are_there_for_methods_that_can(baked):
    settings = bpy.context.scene.reflect
    assert {"focus_distance", "background", "reflect.focus_here"} <= set(drawn().split())
    settings.method = "environment"
    assert not {"focus_distance", "background", "reflect.focus_here"} & set(drawn().split())


def test_a_background_that_cannot_be_drawn_is_explained(baked):
    settings = bpy.context.scene.reflect
    outside = {"eye": (3, 0, 0)}
    assert "in no cell" not in drawn(**outside)
    settings.background = True
    assert "in no cell" in drawn(**outside) and "Camera in Cell" in drawn(**outside)
    assert "in no cell" not in drawn(eye=(1.9, 0, 0))
