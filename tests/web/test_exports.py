"""./dev exports: a sample's rows, its table and pictures as ./dev report takes them."""

import json

import pytest
from node_package import chromium, need_packages

from reflect_addon.evaluation.report import report
from tools.exports.__main__ import main

pytestmark = pytest.mark.slow


def test_a_scene_is_measured(device, tmp_path):
    need_packages()
    chromium()
    out = tmp_path / "out"
    assert main(["contact", "--methods", "environment", "--size", "160x120", "--samples", "1", "--set", "resolution=16", "--out", str(out)]) in (0, 1)  # 1: FLIP of so small a picture
    row, *_ = json.loads((out / "targets.json").read_text())["rows"]
    assert row["id"] == "export web contact environment" and 0 < row["ours"] < 0.1
    table, *_ = json.loads((out / "exhibits.json").read_text())["exhibits"]
    assert table["rows"][0][0] == "environment" and float(table["rows"][0][3]) > 0 and len(table["pictures"]) == 1
    report([out], tmp_path / "report")
    assert "contact in a browser" in (tmp_path / "report" / "index.html").read_text()
