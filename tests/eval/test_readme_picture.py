"""The README's picture: there, small, and drawn from results alone, alike each time."""

import sys
from dataclasses import replace
from pathlib import Path

from reflect_addon.evaluation.png import write_png
from reflect_addon.evaluation.rows import Row, write_rows

ROOT = Path(__file__).resolve().parents[2]
sys.path.append(str(ROOT / "tools"))

import readme_picture  # noqa: E402

ROW = Row("s", "Camera", 1, "24x18", "environment", {}, "none", "NUMPY", "5.2.3", 9, rmse=0.2, flip=0.5, hit_p95=0.1,
          pictures={what: "p.png" for what in ("frame", "truth", "answer", "difference")})  # fmt: skip


def test_the_readme_has_its_picture():
    assert "docs/pictures/demo.png" in (ROOT / "README.md").read_text()
    content = (ROOT / "docs" / "pictures" / "demo.png").read_bytes()
    assert content.startswith(b"\x89PNG") and len(content) <= readme_picture.LARGEST


def test_equal_results_give_an_equal_picture(tmp_path, rng):
    write_png(tmp_path / "p.png", rng.random((18, 24, 3)))
    peer = replace(ROW, method="eevee", hit_p95=None, settings={"sphere_probe": True})
    write_rows([ROW, peer, replace(peer, flip=0.3, settings={"sphere_probe": False})], tmp_path)
    pictures = [tmp_path / "a.png", tmp_path / "b.png"]
    assert [readme_picture.main([str(tmp_path), "--out", str(p)]) for p in pictures] == [0, 0]
    assert pictures[0].read_bytes() == pictures[1].read_bytes()


def test_of_a_peers_rows_the_better_one_is_shown():
    worse, better = (replace(ROW, method="eevee", flip=f) for f in (0.5, 0.3))
    assert readme_picture.chosen([ROW, worse, better]) == [ROW, better]


def test_without_results_it_says_what_to_run(tmp_path, capsys):
    assert readme_picture.main([str(tmp_path / "none")]) == 1
    assert "evaluate" in capsys.readouterr().err
