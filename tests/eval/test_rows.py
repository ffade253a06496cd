"""results.json: exactly the design's fields, never NaN, written whole, and a clear sentence for everything else."""

import json
from dataclasses import fields, replace

import numpy as np
import pytest

from reflect_addon.core.errors import ReflectError
from reflect_addon.evaluation.rows import Row, read_rows, write_rows

DESIGN = """scene camera frame size method settings device backend blender pixels rmse relmse flip ssim floor_rmse
hit_p50 hit_p95 angle_p50 angle_p95 false_hit missed_hit ms ms_spread ms_vs_environment bake_s upload_ms bytes counts
nonfinite""".split()

ROW = Row("teapots", "Camera", 1, "64x48", "environment", {"resolution": 256}, "none", "NUMPY", "5.2.3", 100, rmse=0.25)


def test_fields_are_the_designs():
    names = [f.name for f in fields(Row)]
    assert names[: len(DESIGN)] == DESIGN
    assert set(names[len(DESIGN) :]) == {"median_relative", "pictures", "notes"}


def test_round_trip(tmp_path):
    rows = [ROW, replace(ROW, method="box_proxy", notes=("no clock",), pictures={"answer": "pictures/a.png"})]
    write_rows(rows, tmp_path)
    assert read_rows(tmp_path) == rows
    assert [p.name for p in tmp_path.iterdir()] == ["results.json"], "no temporary file stays"


def test_nan_infinity_and_numpy_never_reach_the_file(tmp_path):
    row = replace(ROW, rmse=float("nan"), relmse=np.float32("inf"), bytes=np.int64(7), counts={"steps": np.float32(1.5)})
    path = write_rows([row], tmp_path)
    assert "NaN" not in path.read_text() and "Infinity" not in path.read_text()
    back = read_rows(tmp_path)[0]
    assert back.rmse is None and back.relmse is None and back.bytes == 7 and back.counts == {"steps": 1.5}


def test_an_old_file_survives_a_failed_write(tmp_path):
    write_rows([ROW], tmp_path)
    with pytest.raises(TypeError):
        write_rows([replace(ROW, settings={"x": object()})], tmp_path)
    assert read_rows(tmp_path) == [ROW]


def test_a_folder_that_is_a_file_is_a_sentence(tmp_path):
    (tmp_path / "taken").write_text("")
    with pytest.raises(ReflectError, match="could not be written"):
        write_rows([ROW], tmp_path / "taken")


def _content(**changes):
    row = json.loads(json.dumps({f.name: getattr(ROW, f.name) for f in fields(Row)}))
    return {"format": 1, "rows": [row | changes]}


@pytest.mark.parametrize(
    "content, part",
    [
        ("{", "not valid JSON"),
        (b"\xff\xfe", "not valid JSON"),
        ("[" * 100_000, "not valid JSON"),
        ('{"format": 1, "rows": [NaN]}', "not valid JSON"),
        ([], "format"),
        ({"format": 1}, "rows"),
        ({"format": 2, "rows": []}, "Update Reflect"),
        ({"format": "1", "rows": []}, "format '1'"),
        ({"format": 1, "rows": [3]}, "row 1"),
        ({"format": 1, "rows": [{}]}, "lacks"),
        (_content(surprise=1), "surprise"),
        (_content(rmse="much"), "rmse 'much'"),
        (_content(pixels=True), "pixels True"),
        (_content(scene=5), "scene 5"),
        (_content(counts=[]), "counts"),
        (_content(notes=[1]), "notes"),
    ],
)
def test_wrong_files_are_named(tmp_path, content, part):
    data = content if isinstance(content, bytes) else (content if isinstance(content, str) else json.dumps(content)).encode()
    (tmp_path / "results.json").write_bytes(data)
    with pytest.raises(ReflectError) as caught:
        read_rows(tmp_path)
    assert part in str(caught.value) and str(tmp_path) in caught.value.message


def test_a_missing_file_says_how_to_make_one(tmp_path):
    with pytest.raises(ReflectError, match="evaluate"):
        read_rows(tmp_path / "nowhere")
