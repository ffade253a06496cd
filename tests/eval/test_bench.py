"""targets.json: the design's schema, measured rows only, and a sentence where nothing can be measured yet."""

import json

import pytest

from reflect_addon.core.errors import ReflectError
from reflect_addon.evaluation import bench


def test_schema(tmp_path, monkeypatch):
    row = {"id": "P0", "paper": None, "ours": 1.0, "target": 2.0, "holds": True, "how": "By hand."}
    monkeypatch.setattr(bench, "PAPERS", {"popescu": (lambda progress: [row],)})
    data = json.loads(bench.bench("all", tmp_path, print).read_text())
    assert data == {"format": 1, "rows": [row]}


def test_a_paper_without_methods_is_a_sentence(tmp_path):
    with pytest.raises(ReflectError, match="yu"):
        bench.bench("yu", tmp_path, print)
    assert not (tmp_path / "targets.json").exists()
