"""The bench of what recursive draws: its parts on the smallest scene, and what it says of errors that are given."""

from dataclasses import replace

import numpy as np
import pytest

from reflect_addon.evaluation import (
    bench,
    bench_nielsen_culling,
    bench_nielsen_curved,
    bench_nielsen_draw,
    bench_nielsen_maps,
    bench_nielsen_motion,
)
from reflect_addon.evaluation.bench_nielsen_drawn import drawn


@pytest.fixture(scope="module")
def balls(device, tmp_path_factory):
    return drawn("mirrors_b", (64, 48), tmp_path_factory.mktemp("mirrors_b"))


def test_passes_are_the_papers(balls):
    """(b) alone: 1 and 18 more planar reflections, 18 faces; at rest none."""
    ours = {row["id"]: row["ours"] for row in bench_nielsen_draw._passes([balls])}
    assert ours == {"N-drawn-dynamic": [19], "N-drawn-static": [1], "N-drawn-faces": [18], "N-drawn-static-faces": [0]}


def test_view_dependent_passes_are_the_papers(balls):
    """(b) alone: 16, with back faces culled and without; three balls, the floor in each, and they and the floor's balls in each other."""
    ours = {row["id"]: row["ours"] for row in bench_nielsen_draw._view_dependent([balls])}
    assert ours == {"N-drawn-view-dependent": [16], "N-drawn-view-dependent-unculled": [16]}


def test_a_level_has_one_set_of_targets(balls):
    row = bench_nielsen_draw._targets([balls])
    assert row["holds"] and row["ours"][0] > 0


def test_what_each_culling_saves(balls, monkeypatch):
    """(b) alone: one view; what is left out is counted."""
    chosen = {name: bench_nielsen_culling.CULLINGS[name] for name in ("every", "none", "all but scissor", "scissor alone")}
    monkeypatch.setattr(bench_nielsen_culling, "CULLINGS", chosen)
    monkeypatch.setattr(bench_nielsen_culling, "NAMES", ("scissor",))
    monkeypatch.setattr(bench_nielsen_culling, "TURNS", 1)
    row, exhibit = bench_nielsen_culling.table([balls], bench_nielsen_draw._live, lambda share, text: None)
    assert row["id"] == "N-cull-scissor" and row["holds"] and len(exhibit.rows) == 4
    every, none, without, _ = ([float(cell) for cell in line[2:]] for line in exhibit.rows)
    assert every[0] == none[0] == 1 and every[1] < without[1] <= none[1] and every[2] <= without[2] <= none[2]


def test_reused_maps_settle(balls, monkeypatch):
    monkeypatch.setattr(bench_nielsen_motion, "FRAMES", 4)
    found, ages, enough = bench_nielsen_motion.errors(balls)
    rows = bench_nielsen_motion.told(found, ages, enough)
    assert max(found[:4]) > bench_nielsen_motion.ZERO and rows[1]["holds"] and found[-1] <= bench_nielsen_motion.ZERO
    assert len(rows[2].rows) == len(found) == 4 + enough + 1


def test_errors_that_grow_do_not_hold():
    still = [0.0] * 4
    for later, holds in ((0.012, True), (0.05, False)):
        moving = [0.01] * 8 + [later] * 8
        assert bench_nielsen_motion.told(moving + still, [1] * 20, 3)[0]["holds"] == holds


def test_everything_moves(balls):
    now = bench_nielsen_motion.moved(balls.snapshot, 3)
    apart = [np.abs(a.world_from_object - b.world_from_object).max() for a, b in zip(balls.snapshot.instances, now.instances, strict=True)]
    assert min(apart) > 1e-3
    again = bench_nielsen_motion.moved(replace(balls.snapshot), 0)
    assert all(np.allclose(a.world_from_object, b.world_from_object) for a, b in zip(balls.snapshot.instances, again.instances, strict=True))


def test_the_table_of_maps():
    found = bench_nielsen_maps.errors(bench_nielsen_maps.sky)
    row, exhibit = bench_nielsen_maps.table({"sky": found})
    assert min(found, key=lambda name: found[name][0]) == "cube" and row["holds"]
    assert found["sphere"][1] > 5 * found["dual paraboloid"][1]  # the rim
    assert [line[0] for line in exhibit.rows] == ["sphere", "cube", "dual paraboloid", "octahedral"]


def test_they_are_the_papers_targets():
    parts = bench.PAPERS["nielsen"]
    assert all(module.measure in parts for module in (bench_nielsen_draw, bench_nielsen_motion, bench_nielsen_curved, bench_nielsen_maps))
