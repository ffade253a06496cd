"""An evaluation in parts is the whole, but for times; and merging sees machines that answer differently."""

import json
import shutil

import bpy
import pytest
from blender_scenes import two_mirrors
from whole_and_parts import assert_same_results

from reflect_addon import cli
from reflect_addon.core.part_record import FILE_NAME as RECORD
from reflect_addon.core.part_record import file_sum
from reflect_addon.evaluation.rows import FILE_NAME, read_rows

WORDS = ["--methods", "environment,sphere_proxy,distance_map", "--size", "24x18", "--samples", "1", "--backend", "numpy"]


@pytest.fixture(scope="module")
def hall(tmp_path_factory):
    """(.blend, folder of its assets)."""
    blend = two_mirrors(tmp_path_factory.mktemp("part") / "hall.blend")
    assets = blend.parent / "baked"
    assert cli.main(["bake", str(blend), *WORDS[:2], "--out", str(assets), "--resolution", "8", "--samples", "1"]) == 0
    return blend, assets


@pytest.fixture(scope="module")
def parts(hall):
    """The folders of four parts, made out of order; the fourth has no work."""
    blend, assets = hall
    folder = blend.parent / "parts"
    for number in (4, 2, 1, 3):
        out = ["--part", f"{number}/4", "--out", str(folder / str(number))]
        assert cli.main(["evaluate", str(blend), *WORDS, "--assets", str(assets), *out]) == 0
    return [folder / str(number) for number in (3, 1, 4, 2)]


def test_parts_are_the_whole(hall, parts, tmp_path, capfd):
    blend, assets = hall
    assert cli.main(["evaluate", str(blend), *WORDS, "--assets", str(assets), "--out", str(tmp_path / "whole")]) == 0
    assert cli.main(["merge", *map(str, parts), "--out", str(tmp_path / "merged")]) == 0
    assert capfd.readouterr().out.splitlines()[-1] == str(tmp_path / "merged" / FILE_NAME)
    assert_same_results(tmp_path / "merged", tmp_path / "whole")
    assert [row.method for row in read_rows(tmp_path / "merged")] == WORDS[1].split(",")
    assert all(row.ms_vs_environment for row in read_rows(tmp_path / "merged")), "each over the base of its own machine"
    assert cli.main(["report", str(tmp_path / "merged"), "--out", str(tmp_path / "page")]) == 0


def test_machines_that_answer_differently(parts, tmp_path, capfd):
    """The base's row is in every part with work, and compared in all that was not measured in seconds."""
    other = shutil.copytree(parts[0], tmp_path / "other")
    data, document = (json.loads((other / name).read_text()) for name in (FILE_NAME, RECORD))
    data["rows"][0]["rmse"] += 1e-9
    (other / FILE_NAME).write_text(json.dumps(data))
    document["files"][FILE_NAME] = file_sum(other / FILE_NAME)
    (other / RECORD).write_text(json.dumps(document))
    assert cli.main(["merge", str(other), *map(str, parts[1:]), "--out", str(tmp_path / "out")]) == 1
    assert "different results of environment" in capfd.readouterr().err and not (tmp_path / "out").exists()


@pytest.mark.parametrize("more, words", [([], "--assets DIR"), (["--assets", "X", "--resolution", "8"], "baked already"), (["--assets", "X"], "has no environment asset")])
def test_what_a_part_needs(hall, tmp_path, capfd, more, words):
    blend, _ = hall
    more = [str(tmp_path) if word == "X" else word for word in more]
    assert cli.main(["evaluate", str(blend), *WORDS, *more, "--part", "1/2", "--out", str(tmp_path / "out")]) == 1
    assert words in capfd.readouterr().err


def test_old_assets_are_refused(hall, tmp_path, capfd):
    blend, assets = hall
    bpy.ops.wm.open_mainfile(filepath=str(blend))
    bpy.context.scene.objects["Pillar"].location.x += 0.1
    changed = tmp_path / "changed.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(changed))
    assert cli.main(["evaluate", str(changed), *WORDS, "--assets", str(assets), "--out", str(tmp_path / "out")]) == 1
    assert "is old: the scene has changed since" in capfd.readouterr().err
