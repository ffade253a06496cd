"""exhibit.py and the curves of plot.py: what is written is read and shown, and what is not ours is a sentence."""

import json

import numpy as np
import pytest

from reflect_addon.core.errors import ReflectError
from reflect_addon.evaluation import bench, bench_table, exhibit
from reflect_addon.evaluation.plot import curves
from reflect_addon.evaluation.report import report

EVIL = "<script>alert('x')</script>"


def shown():
    picture = np.random.default_rng(1).uniform(size=(4, 6, 3))
    plot = curves({"a": [(1, 2.0), (3, 0.5)], "b": [(1, 2.0), (3, 0.0)]}, "steps", EVIL)
    return exhibit.Exhibit("A table", EVIL, ("what", "value"), (("x", "1"), (EVIL, "2")), (("a plot", plot), (EVIL, picture)))


def test_the_bench_writes_what_the_report_shows(tmp_path, monkeypatch):
    row = {"id": "P0", "paper": None, "ours": 1.0, "target": 2.0, "holds": True, "how": "By hand."}
    monkeypatch.setattr(bench, "PAPERS", {"popescu": (lambda progress: [row, shown()],)})
    paths = bench.bench("popescu", tmp_path, print)
    assert [path.name for path in paths] == ["targets.json", "exhibits.json"]
    assert "A table" in bench_table.text(paths[1])
    names = [name for _, name in json.loads(paths[1].read_text())["exhibits"][0]["pictures"]]
    assert [name[-4:] for name in names] == [".svg", ".png"] and "xmlns" in (tmp_path / names[0]).read_text()
    html = report([tmp_path], tmp_path / "out").read_text()
    assert "<script" not in html and "image/svg+xml" in html and "image/png" in html and "A table" in html
    (tmp_path / names[1]).unlink()
    assert "is missing" in report([tmp_path], tmp_path / "out").read_text()
    monkeypatch.setattr(bench, "PAPERS", {"popescu": (lambda progress: [row],)})
    bench.bench("popescu", tmp_path, print)
    assert not paths[1].exists()


@pytest.mark.parametrize(
    "spoil",
    [lambda e: e.pop("title"), lambda e: e["rows"].append(["x"]), lambda e: e["pictures"].append("x"), lambda e: e.update(lead=3), lambda e: e.update(rows=None)],
)  # fmt: skip
def test_a_damaged_file_is_a_sentence(tmp_path, spoil):
    path = exhibit.write([shown()], tmp_path)
    data = json.loads(path.read_text())
    spoil(data["exhibits"][0])
    path.write_text(json.dumps(data))
    with pytest.raises(ReflectError, match="exhibits.json"):
        exhibit.read(path)


def test_no_file_from_elsewhere_is_shown(tmp_path):
    path = exhibit.write([shown()], tmp_path / "results")
    (tmp_path / "secret.png").write_bytes(b"secret")
    data = json.loads(path.read_text())
    data["exhibits"][0]["pictures"] = [["x", "../secret.png"], ["y", "exhibits.json"]]
    path.write_text(json.dumps(data))
    assert "".join(exhibit.sections(tmp_path / "results")).count("not a picture of this folder") == 2


def test_curves_of_nothing_are_a_sentence():
    assert "Nothing was measured" in curves({"a": [(0, 1.0), (1, float("nan"))]}, "x", "y")
