"""evaluation/bench_srdm.py: complete rows, and counts that follow from the map."""

import numpy as np

from reflect_addon.evaluation import bench_srdm
from reflect_addon.evaluation.bench import Target


def test_rows_of_a_small_map(device, monkeypatch):
    for name, value in {"W": 64, "N": 6, "POINTS": (4, 8), "ANGLES": (3, 6, 9), "TURNS": 1, "ANGLE_TURNS": 3}.items():
        monkeypatch.setattr(bench_srdm, name, value)
    rows = {row["id"]: Target(**row) for row in bench_srdm.measure(lambda share, what: None)}
    assert set(rows) == {"I3-compute-equal", "P13", "I3-half", "I3-compute", "P11", "P12", "I3-compute-card"}
    assert rows["I3-compute-equal"].holds and rows["I3-half"].holds
    assert rows["P13"].ours == 64 * 6 * 8 * 2 * 4 / 1024
    assert len(rows["I3-compute"].ours) == len(rows["P11"].ours) == 2


def test_the_papers_table_size():
    table = np.zeros((bench_srdm.N, bench_srdm.W, bench_srdm.M, 2), np.float32)
    assert table.nbytes == 960 * 1024


def test_work_is_counted():
    """A flat map: every row is one span that is looked at once. A roof: its halves are looked at once more."""
    flat = np.full((32, 32), 0.5, np.float32)
    want = {"texels": 32 * 32, "samples": 32 * 31, "priorities": 32 * 28, "points": 32 * 8, "steps": 32 + 28 + 8 + 2 * 31}
    assert bench_srdm.counted(flat, 1, 8) == want
    roof = np.tile(np.float32(0.5 - np.abs(np.arange(33) - 16) / 32), (33, 1))
    assert bench_srdm.counted(roof, 1, 8)["samples"] == 33 * (32 + 32)
