"""evaluation/bench_mirrors.py and bench_limits.py: complete rows, exact counts; and a row for every target of the paper."""

import ast
import re
from pathlib import Path

import pytest

from reflect_addon.evaluation import bench, bench_limits, bench_mirrors, bench_mirrors_scene
from reflect_addon.evaluation.bench import Target


@pytest.fixture
def small(device, monkeypatch):
    # Turns: of frames this small one by itself may measure nothing beside what else the machine does.
    for name, value in {
        "TURNS": 5, "CLOSE_TURNS": 1, "RAYS": 1500, "OTHERS": ((4, 4),), "LOOK": (64, 48), "ENABLED": {1: 166, 9: 11},
        "RESOLUTIONS": {(48, 36): 46, (64, 48): 36},
    }.items():  # fmt: skip
        monkeypatch.setattr(bench_mirrors, name, value)
    monkeypatch.setattr(bench_mirrors_scene, "BAKE", {"resolution": 8, "samples": 1, "texels": 16, "sky_error": 0})
    monkeypatch.setattr(bench_mirrors_scene, "SIZE", (96, 96))


def test_rows_and_exact_counts(small):
    rows = {row["id"]: Target(**row) for row in bench_mirrors.measure(lambda share, what: None)}
    assert set(rows) == {"P1", "P1-time", "P2", "P5", "P5-linear", "P7", "P7-net", "P8", "P9"}
    assert rows["P1"].ours == [12, 12] and rows["P5"].ours == [72, 72] and rows["P9"].ours == [5, 5, 10]
    assert all(rows[name].holds for name in ("P1", "P5", "P9"))
    assert rows["P1-time"].target is None and rows["P1-time"].ours > 0
    assert rows["P7"].ours[0] == rows["P7-net"].ours[0] == 1 and len(rows["P8"].ours) == 2


def test_more_billboards_than_the_papers_program_held(device, monkeypatch):
    for name, value in {"SQUARES": 48, "RINGS": 4, "EVERY": 40}.items():
        monkeypatch.setattr(bench_limits, name, value)
    monkeypatch.setattr(bench_mirrors_scene, "BAKE", {"resolution": 8, "samples": 1, "texels": 16, "sky_error": 0})
    rows = {row["id"]: Target(**row) for row in bench_limits.measure(lambda share, what: None)}
    assert rows["P10"].ours == 48 and rows["P10"].holds and rows["P10-right"].holds


def test_every_target_has_a_row(shared):
    """Each number in the list of targets is the name of a row (P5 or P5-linear), said by one of the modules that measure."""
    wanted = re.findall(r"^\| (P\d+) \|", (shared / "papers" / "targets.md").read_text(), re.M)
    assert len(wanted) >= 17
    named = set()
    for measure in bench.PAPERS["popescu"]:
        module = Path(bench.__file__).with_name(measure.__module__.rpartition(".")[2] + ".py")
        for node in ast.walk(ast.parse(module.read_text())):
            if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "row" and isinstance(node.args[0], ast.Constant):
                named.add(node.args[0].value)
    assert set(wanted) <= named
