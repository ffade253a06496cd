"""A render farm's own command, `blender -b FILE -a`, by a real Blender with factory settings and no add-on. Needs root and the blender-desktop
tool; no window is opened."""

import os
import subprocess
from pathlib import Path

import bpy
import numpy as np
import pytest
from native_scene import save_assets
from test_window import LIMIT, tool
from tolerances_nodes import NATIVE_OTHER_BLENDER

from reflect_addon import cli
from reflect_addon.evaluation import bench_eevee_farm_scene as farm

STILL = 20  # the frame that is looked at closely
SAID = "import sys; print('ours:', sum('reflect' in name for name in sys.modules))"


@pytest.mark.alone
@pytest.mark.desktop
def test_a_real_blender_renders_all_frames(fresh_file, tmp_path):
    run = tool()
    farm.moving_body((64, 48), 4)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "a.blend"))
    save_assets(bpy.context.scene)
    out = tmp_path / "farm" / "native.blend"
    assert cli.main(["native", str(tmp_path / "a.blend"), "--method", "box_proxy", "--unpacked", "--out", str(out)]) == 0
    bpy.ops.wm.open_mainfile(filepath=str(out))
    here = farm.still(STILL, "BLENDER_EEVEE", tmp_path / "here.exr")
    command = f"blender --factory-startup --gpu-backend opengl -b '{out}' -a --python-expr \"{SAID}\""
    environment = os.environ | {"LIBGL_ALWAYS_SOFTWARE": "1"}
    done = subprocess.run([run, "shell"], input=command, cwd=out.parent, env=environment, capture_output=True, text=True, timeout=LIMIT, check=False)
    assert done.returncode == 0 and "ours: 0" in done.stdout, f"{done.stdout[-2000:]}\n{done.stderr[-2000:]}"
    frames = [farm.picture_in(Path(path)) for path in sorted((out.parent / farm.FOLDER).iterdir())]
    assert not farm.what_is_wrong(frames)
    differs = np.abs(frames[STILL - 1] - here).max(-1)
    print(f"frame {STILL}: {(differs > 0).mean():.3f} of the pixels differ, by {differs.mean():.2g} in the mean")
    assert differs.mean() < NATIVE_OTHER_BLENDER
