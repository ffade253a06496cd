"""The job type for Flamenco: its settings by the documented schema, its tasks, and what they make when workers run them: the whole, bit for bit."""

import pytest
from blender_scenes import two_mirrors
from node_manager import compiled, manager, run_tasks
from whole_and_parts import assert_same_assets, assert_same_results

from reflect_addon import cli

# flamenco-openapi.yaml, AvailableJobSetting.
KEYS = {"key", "type", "subtype", "choices", "propargs", "description", "default", "eval", "evalInfo", "visible", "required", "editable"}
TYPES = {"string": str, "int32": int, "float": float, "bool": bool}
SUBTYPES = {"file_path", "dir_path", "file_name", "hashed_file_path"}
VISIBLE = {"visible", "hidden", "submission", "web"}

SETTINGS = {
    "methods": "environment,sphere_proxy,billboards", "parts": 2, "objects": "", "resolution": 16, "samples": 1, "bake_options": "--set texels=16", "evaluate": True,
    "evaluate_size": "32x24", "evaluate_samples": 2, "evaluate_parts": 2, "output_root": "", "output_path": "", "blendfile": "", "scene": "hall",
}  # fmt: skip


def test_settings_are_as_documented():
    kind = manager()["type"]
    assert kind["label"] and set(kind) <= {"label", "description", "settings"}
    for setting in kind["settings"]:
        assert {"key", "type"} <= setting.keys() <= KEYS, setting
        assert setting["key"].isidentifier() and setting["type"] in TYPES and setting.get("visible", "visible") in VISIBLE
        assert "subtype" not in setting or setting["type"] == "string" and setting["subtype"] in SUBTYPES
        assert "default" not in setting or type(setting["default"]) is TYPES[setting["type"]], setting
        assert setting.keys().isdisjoint({"required", "editable"}) or {type(setting[k]) for k in ("required", "editable") if k in setting} == {bool}
        assert set(setting.get("propargs", {})) <= {"min", "max"} and "description" in setting
        for expression in filter(None, [setting.get("eval")]):
            compile(expression, setting["key"], "eval")
    keys = [setting["key"] for setting in kind["settings"]]
    assert len(keys) == len(set(keys)) and set(keys) == SETTINGS.keys()


def test_what_is_left_out_is_no_option(tmp_path):
    plain = SETTINGS | {"resolution": 0, "samples": 0, "bake_options": "", "evaluate": False, "parts": 3, "output_path": "/farm/{timestamp}", "blendfile": "/a b.blend"}
    job = compiled(plain, tmp_path)
    assert job["settings"]["output_path"] == "/farm/2026-01-02_030405"
    *bakes, merge = job["tasks"]
    assert [task["type"] for task in job["tasks"]] == ["blender"] * 4
    assert merge["dependencies"] == [task["name"] for task in bakes] and not any(task["dependencies"] for task in bakes)
    words = bakes[1]["commands"][0]["parameters"]["args"]
    out = "/farm/2026-01-02_030405/parts/bake-2"
    assert words == ["-b", "/a b.blend", "--command", "reflect", "bake", "--methods", plain["methods"], "--scene", "hall", "--part", "2/3", "--out", out]


@pytest.mark.parametrize("wrong", [{"parts": 0}, {"evaluate_parts": 0}, {"objects": "Near"}, {"output_path": ""}])
def test_a_job_that_cannot_be_is_refused(tmp_path, wrong):
    with pytest.raises(RuntimeError):
        compiled(SETTINGS | {"output_path": "/farm", "blendfile": "/a.blend"} | wrong, tmp_path)


def _run(tmp_path, settings: dict, whole_options: list[str], workers: int):
    """The job's folder and the folder of what one process makes of the same, both with `assets` and, where it was asked for, `evaluation`."""
    blend = two_mirrors(tmp_path / "a hall.blend")
    job = compiled(settings | {"blendfile": str(blend), "output_path": str(tmp_path / "farm" / "{timestamp}")}, tmp_path)
    ended = run_tasks(job["tasks"], tmp_path, workers)
    assert len(ended) == len(job["tasks"]) and ended[-1].startswith("merge")
    whole = tmp_path / "whole"
    assert cli.main(["bake", str(blend), "--methods", settings["methods"], "--out", str(whole / "assets"), *whole_options]) == 0
    if settings["evaluate"]:
        words = ["--methods", settings["methods"], "--size", settings["evaluate_size"], "--samples", str(settings["evaluate_samples"])]
        assert cli.main(["evaluate", str(blend), *words, "--assets", str(whole / "assets"), "--out", str(whole / "evaluation")]) == 0
    return tmp_path / "farm" / "2026-01-02_030405", whole


def test_workers_make_what_one_process_makes(tmp_path):
    made, whole = _run(tmp_path, SETTINGS | {"evaluate": False}, ["--resolution", "16", "--samples", "1", "--set", "texels=16"], 2)
    assert_same_assets(made / "assets", whole / "assets")


@pytest.mark.slow
def test_workers_make_what_one_process_makes_of_everything(tmp_path, device):
    words = "--set texels=16 --set views=4 --set view_texels=8 --set turns=12 --set surface_tolerance=1"
    settings = SETTINGS | {"methods": "all,auto", "parts": 5, "evaluate_parts": 4, "bake_options": words}
    made, whole = _run(tmp_path, settings, ["--resolution", "16", "--samples", "1", *words.split()], 2)
    assert_same_assets(made / "assets", whole / "assets")
    assert_same_results(made / "evaluation", whole / "evaluation")
