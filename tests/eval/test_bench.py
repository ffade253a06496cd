"""targets.json: the design's schema, measured rows only, and a sentence where nothing can be measured yet."""

import json
from dataclasses import asdict, replace

import pytest

from reflect_addon.core.errors import ReflectError
from reflect_addon.evaluation import bench, bench_table, stability
from reflect_addon.evaluation.report import report

STABLE = stability.Stability("scale 1", "environment", 100, 50, 0, 0, 0, 0.0, 1.5, 2.5, 1e-7)


def test_schema(tmp_path, monkeypatch):
    row = {"id": "P0", "paper": None, "ours": 1.0, "target": 2.0, "holds": True, "how": "By hand."}
    monkeypatch.setattr(bench, "PAPERS", {"popescu": (lambda progress: [row],)})
    (path,) = bench.bench("popescu", tmp_path, print)
    assert json.loads(path.read_text()) == {"format": 1, "rows": [row]}
    assert "P0" in bench_table.text(path) and "By hand." in bench_table.text(path)


def test_all_is_papers_and_stability(tmp_path, monkeypatch):
    monkeypatch.setattr(bench, "PAPERS", {"popescu": (lambda progress: [],)})
    monkeypatch.setattr(bench.stability, "measure", lambda progress: [STABLE])
    assert [path.name for path in bench.bench("all", tmp_path, print)] == ["targets.json", "stability.json"]
    assert bench.bench("stability", tmp_path / "alone", print) == [tmp_path / "alone" / "stability.json"]
    assert bench_table.read(tmp_path / "stability.json") == [STABLE]


def test_the_report_shows_both_without_results(tmp_path):
    evil = "<script>alert('x')</script>"
    rows = [bench.Target(evil, [1.0, 2.0], 3.0, None, True, evil), bench.Target("P1", None, 1.0, 2.0, False, "By hand.")]
    (tmp_path / "targets.json").write_text(json.dumps({"format": 1, "rows": [asdict(r) for r in rows]}))
    stability.write([STABLE, replace(STABLE, wrong=2)], tmp_path)
    html = report([tmp_path], tmp_path / "out").read_text()
    assert "<script" not in html and "1 of 2 rows hold." in html and "1 rows have values or hits that are wrong." in html
    assert html.count("class=bad") == 2
    stability.write([STABLE], tmp_path)
    assert "Nothing non-finite and no wrong hit." in report([tmp_path], tmp_path / "out").read_text()


@pytest.mark.parametrize("content", ["", "[]", '{"format": 2, "rows": []}', '{"format": 1, "rows": [{"case": 1}]}', "\xff"])
def test_a_damaged_file_is_a_sentence(tmp_path, content):
    (tmp_path / "stability.json").write_bytes(content.encode("latin-1"))
    with pytest.raises(ReflectError, match="stability.json"):
        report([tmp_path], tmp_path / "out")


def test_scenes_are_chosen_where_there_are_any(tmp_path, monkeypatch):
    asked = []
    monkeypatch.setattr(bench, "PAPERS", {"eevee": (lambda progress, only=(): asked.append(only) or [],)})
    bench.bench("eevee", tmp_path, print, ("columns", "box room"))
    bench.bench("eevee", tmp_path, print)
    assert asked == [("columns", "box room"), ()]
    for which, only, word in (("eevee", ("attic",), "box room"), ("yu", ("columns",), "--only")):
        with pytest.raises(ReflectError) as caught:
            bench.bench(which, tmp_path, print, only)
        assert word in caught.value.remedy


def test_a_paper_without_methods_is_a_sentence(tmp_path, monkeypatch):
    monkeypatch.setattr(bench, "PAPERS", {"popescu": (lambda progress: [],)})
    with pytest.raises(ReflectError, match="nielsen"):
        bench.bench("nielsen", tmp_path, print)
    assert not (tmp_path / "targets.json").exists()
