"""The command line's `native`: a file with native reflections, written beside the one that was opened, and the way back."""

import bpy
import pytest
from blender_dump import dump_saved
from native_scene import animated, ball, mixed, principled, save_assets

from reflect_addon import cli


@pytest.fixture
def saved(fresh_file, tmp_path):
    ball("Ball", principled("Metal", Metallic=1.0), mixed("Mixed"), animated("Animated"))
    bpy.context.scene.frame_set(1)
    path = tmp_path / "a.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return path


def run(*words) -> int:
    return cli.main(["native", *map(str, words)])


def test_there_and_back(saved, tmp_path, capfd):
    save_assets(bpy.context.scene)
    before, there, back = saved.read_bytes(), tmp_path / "out" / "there.blend", tmp_path / "back.blend"
    assert run(saved, "--method", "box_proxy", "--unpacked", "--out", there) == 0
    assert "3 materials of 1 object" in capfd.readouterr().out and saved.read_bytes() == before
    assert not hasattr(bpy.types.Object, "reflect_native"), "what the work needs is gone after it"
    bpy.ops.wm.open_mainfile(filepath=str(there), load_ui=False)
    assert {s.material.name for s in bpy.data.objects["Ball"].material_slots} == {f"{n} · Reflect" for n in ("Metal", "Mixed", "Animated")}
    for image in bpy.data.images:
        assert image.source == "FILE" and image.size[0] > 0 and not image.packed_file
        assert bpy.path.abspath(image.filepath).startswith(str(tmp_path / "out" / "reflect"))
    assert run(there, "--remove", "--out", back) == 0
    now = dump_saved(back)
    assert now == dump_saved(saved)


def test_what_is_missing_is_said(saved, tmp_path, capfd):
    out = tmp_path / "b.blend"
    assert run(saved, "--out", out) == 1 and "Add --method" in capfd.readouterr().err
    assert run(saved, "--method", "box_proxy", "--out", out) == 1
    assert "Ball has no asset of box_proxy: bake first." in capfd.readouterr().err
    save_assets(bpy.context.scene)
    ball("New")
    bpy.ops.wm.save_mainfile()
    assert run(saved, "--method", "box_proxy", "--out", out) == 1
    assert "Ball was baked from another state of the scene: bake again first." in capfd.readouterr().err
    assert not out.exists()
    with pytest.raises(SystemExit):
        run(saved, "--method", "box_proxy", "--out", tmp_path / "b.png")
