"""The report: whole in one file, every number's text escaped, and honest about what is missing."""

import re
from dataclasses import replace

import numpy as np
import pytest

from reflect_addon.core.errors import ReflectError
from reflect_addon.evaluation.plot import Point, scatter
from reflect_addon.evaluation.png import write_png
from reflect_addon.evaluation.report import report
from reflect_addon.evaluation.rows import Row, write_rows

ROW = Row(
    "teapots", "Camera", 1, "64x48", "environment", {"resolution": 256}, "llvmpipe (SOFTWARE)", "OPENGL", "5.2.3", 100,
    rmse=0.25, floor_rmse=0.01, ms=2.0, bytes=10**6, nonfinite=0, pictures={"answer": "pictures/a.png"},
)  # fmt: skip


def page(tmp_path, *rows) -> str:
    write_png(tmp_path / "pictures" / "a.png", np.zeros((4, 6, 3), np.float32))
    write_rows(list(rows), tmp_path)
    return report([tmp_path], tmp_path / "out").read_text()


def test_nothing_is_loaded_from_elsewhere(tmp_path):
    html = page(tmp_path, ROW, replace(ROW, method="box_proxy", rmse=0.1))
    assert not re.findall(r"(?:src|href)='(?!data:)|url\(|<script|<link|@import", html)
    assert html.count("data:image/png;base64,") == 2 and "<svg" in html and "noise of the truth" in html


def test_every_text_is_escaped(tmp_path):
    evil = "<script>alert('x')</script>&\""
    row = replace(
        ROW, scene=evil, camera=evil, method=evil, device=evil, size=evil, blender=evil, backend=evil, notes=(evil,),
        settings={evil: evil}, counts={evil: 1.0},
    )  # fmt: skip
    html = page(tmp_path, row)
    assert "<script" not in html and "&lt;script&gt;" in html


def test_software_is_said(tmp_path):
    assert "milliseconds do not" in page(tmp_path, ROW)
    assert "milliseconds do not" not in page(tmp_path, replace(ROW, device="NVIDIA H200 (NVIDIA)"))


def test_missing_numbers_and_pictures_are_shown_as_missing(tmp_path):
    row = replace(ROW, rmse=None, ms=None, bytes=None, pictures={"answer": "pictures/gone.png", "difference": "../../x.png"})
    html = page(tmp_path, row, replace(ROW, flip=0.5))
    assert "gone.png is missing" in html and "not a picture of this folder" in html and "–" in html


def test_no_rows_is_a_sentence(tmp_path):
    write_rows([], tmp_path)
    with pytest.raises(ReflectError, match="no rows"):
        report([tmp_path], tmp_path / "out")


@pytest.mark.parametrize("values", [[], [(None, 1)], [(0, 1)], [(-1, 1)], [(float("nan"), 1)]])
def test_a_plot_of_nothing_is_a_sentence(values):
    assert "Nothing was measured" in scatter([Point("a", *v) for v in values], "ms", "RMSE")


@pytest.mark.parametrize("values", [[(1, 1)], [(1e-9, 1e9), (1e9, 1e-9)], [(3, 2), (3, 2)]])
def test_points_lie_inside_the_plot(values):
    svg = scatter([Point("a", *v) for v in values], "ms", "RMSE", floor=0.5)
    for x, y in re.findall(r"class='dot s0' cx='([\d.-]+)' cy='([\d.-]+)'", svg):
        assert 62 <= float(x) <= 442 and 14 <= float(y) <= 254


def test_png_is_read_back_right_way_up(tmp_path):
    from skimage.io import imread

    picture = np.zeros((3, 2, 3), np.float32)
    picture[0, 0] = (1, 0.5, np.nan)
    write_png(tmp_path / "p.png", picture)
    assert imread(tmp_path / "p.png")[2, 0].tolist() == [255, 128, 0], "row 0 is the bottom"
