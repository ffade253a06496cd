"""Files with native materials where the add-on is not: another process, an empty profile, the folder moved elsewhere."""

import shutil

import bpy
import numpy as np
import pytest
from native_scene import save_assets

import reflect_addon
from reflect_addon import cli
from reflect_addon.evaluation import bench_eevee_farm_scene as farm

FRAME = 30  # the last: the reflector has left its place and turned


@pytest.mark.parametrize("kept", ["unpacked", pytest.param("packed", marks=pytest.mark.slow)])
def test_a_blender_without_the_addon_renders_the_same(fresh_file, tmp_path, kept):
    scene = farm.moving_body((32, 24), 1)
    scene.frame_start = FRAME
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "a.blend"))
    save_assets(scene)
    out = tmp_path / "out" / "native.blend"
    words = ["native", tmp_path / "a.blend", "--method", "box_proxy", "--out", out, *(["--unpacked"] if kept == "unpacked" else [])]
    assert cli.main([str(word) for word in words]) == 0
    reflect_addon.register()
    try:
        bpy.ops.wm.open_mainfile(filepath=str(out))
        here = farm.still(FRAME, "BLENDER_EEVEE", tmp_path / "here.exr")
    finally:
        reflect_addon.unregister()
    shutil.move(out.parent, tmp_path / "elsewhere")
    (there,) = farm.render_alone(tmp_path / "elsewhere" / out.name)
    assert not farm.what_is_wrong([there], 1) and np.array_equal(there, here)
