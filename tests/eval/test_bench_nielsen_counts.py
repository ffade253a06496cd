"""evaluation/bench_nielsen_counts.py: the paper's counts, all of them exact, from scenes read as any other; complete rows."""

import re

import pytest

from reflect_addon.evaluation import bench
from reflect_addon.evaluation.bench import Target
from reflect_addon.evaluation.bench_nielsen_counts import measure
from reflect_addon.evaluation.exhibit import Exhibit


@pytest.fixture(scope="module")
def found():
    return measure(lambda share, what: None)


def test_every_count_of_table_1(found):
    rows = {r["id"]: Target(**r) for r in found if isinstance(r, dict)}
    assert rows["N-dependent-all"].ours == [49, 16, 16, 52] and rows["N-dependent"].ours == [38, 16, 16, 46]
    assert rows["N-dynamic"].ours == [62, 19, 28, 69] and rows["N-static"].ours == [26, 1, 4, 15]
    assert rows["N-difference"].ours == [36, 18, 24, 54] and rows["N-faces"].ours == [6, 18, 12, 6]
    assert rows["N-static-faces"].ours == [0, 0, 0, 0] and rows["N-memory"].ours == [0.5, 0.5, 0.5, 0.75]
    assert [rows[f"N-mirrors_{s}"].ours for s in "abcd"] == [[2, 6, 1, 1078], [2, 1, 3, 1106], [2, 2, 2, 3890], [3, 3, 1, 1002]]
    assert all(r.holds for r in rows.values()), [r for r in rows.values() if not r.holds]


def reflections_of_fig_5(planar, curved, maxdepth, enters_itself):
    """Reflections that the pseudocode of Fig 5 generates, read line by line; enters_itself: a planar mirror's own view enters it."""
    made = 0

    def draw_scene(depth, hidden, by):
        nonlocal made
        for i in range(planar + curved):
            if i in hidden or depth >= maxdepth or (i == by and not enters_itself):
                continue
            made += 1
            draw_scene(depth + 1, {i} if i >= planar else set(), i)

    draw_scene(0, set(), None)
    return made


def test_without_culling_is_the_pseudocode_but_for_a_mirror_in_itself():
    scenes = ((6, 1, 2), (1, 3, 2), (2, 2, 2), (3, 1, 3))
    assert [reflections_of_fig_5(*scene, False) for scene in scenes] == [49, 16, 16, 52]
    assert [reflections_of_fig_5(*scene, True) for scene in scenes] == [55, 17, 18, 76]


def test_a_row_for_each_culling_and_a_table(found):
    names = [r["id"] for r in found if isinstance(r, dict)]
    assert len(set(names)) == len(names)
    assert {f"N-culling-{n}" for n in ("back_faces", "frustum", "window", "area", "energy", "scissor", "size", "pixels")} <= set(names)
    (table,) = (r for r in found if isinstance(r, Exhibit))
    assert all(len(line) == len(table.heads) == 5 for line in table.rows)


def test_the_paper_is_measured(shared):
    """The counts of the list of targets are the rows' own paper values."""
    text = (shared / "papers" / "targets.md").read_text()
    line = re.search(r"view-dependent: reflections made \|(.*)\|", text)[1]
    assert [float(n) for n in line.split("|")] == [38, 16, 16, 46]
    assert measure in bench.PAPERS["nielsen"]
