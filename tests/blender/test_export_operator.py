"""File > Export > Reflections, without a window: when it can run, what a worker writes, what goes wrong in a sentence."""

import json
import os

import bpy
import pytest
from native_scene import ball, principled, save_assets

import reflect_addon
from reflect_addon.core.exchange.reading import read_export
from reflect_addon.ops import export
from reflect_addon.scene.export_job import folder_in


@pytest.fixture
def saved(fresh_file, tmp_path):
    """A baked ball in a file, the add-on on."""
    reflect_addon.register()
    ball("Ball", principled("Metal", Metallic=1.0), segments=8)
    path = tmp_path / "file" / "a.blend"
    path.parent.mkdir()
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    yield path
    reflect_addon.unregister()


def test_it_asks_for_a_bake_first(saved):
    assert not bpy.ops.reflect.export.poll()
    save_assets(bpy.context.scene)
    assert bpy.ops.reflect.export.poll()


def test_a_worker_writes_the_folder(saved, tmp_path):
    save_assets(bpy.context.scene)
    before = saved.read_bytes()
    assert bpy.ops.reflect.export(directory=str(tmp_path)) == {"FINISHED"}
    (out,) = set(tmp_path.iterdir()) - {saved.parent}
    assert set(read_export(out).manifest.reflectors[0].methods) == {"environment", "box_proxy"} and saved.read_bytes() == before
    assert folder_in(out, bpy.context.scene) == out, "an earlier export is replaced"
    assert set(os.listdir(tmp_path)) == {"file", out.name} and export._running is None


def test_what_goes_wrong_is_reported(saved, tmp_path):
    save_assets(bpy.context.scene)
    with pytest.raises(RuntimeError, match="No folder was chosen"):
        bpy.ops.reflect.export()
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "reflect.json").write_text(json.dumps({"what": "else"}))
    with pytest.raises(RuntimeError, match="no export of Reflect"):
        bpy.ops.reflect.export(directory=str(tmp_path / "mine"))
    assert os.listdir(tmp_path / "mine") == ["reflect.json"] and export._running is None


def test_a_folder_with_other_things_gets_one_inside(saved, tmp_path):
    scene = bpy.context.scene
    assert folder_in(tmp_path / "new", scene) == tmp_path / "new"
    assert folder_in(tmp_path, scene).parent == tmp_path and folder_in(tmp_path, scene).name.startswith("a_reflections")


def test_the_menu_has_it_once_and_not_after(saved):
    def entries():
        return [f for f in bpy.types.TOPBAR_MT_file_export._dyn_ui_initialize() if f.__module__.startswith("reflect_addon")]

    assert len(entries()) == 1
    reflect_addon.unregister()
    assert entries() == []
    reflect_addon.register()
