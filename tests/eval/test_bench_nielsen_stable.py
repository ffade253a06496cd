"""The stability table of recursive mirrors: its cases, and what it says of two of them."""

from dataclasses import replace

import numpy as np

from reflect_addon.evaluation import bench, bench_nielsen_stable, bench_nielsen_stable_cases


def test_every_case_has_mirrors_and_eyes():
    cases = bench_nielsen_stable_cases.cases()
    assert len({case.name for case in cases}) == len(cases)
    for case in cases:
        assert case.cameras and any(i.is_reflector for i in case.scene.instances)
        assert all(np.isfinite(c.clip_from_world()).all() for c in case.cameras)
    assert {name for name in bench_nielsen_stable.SHOWN} <= {case.name for case in cases}
    assert bench_nielsen_stable.measure in bench.PAPERS["nielsen"]


def test_mirrors_at_an_edge_show_what_rays_meet(device):
    case = next(case for case in bench_nielsen_stable_cases.cases() if case.name == "two mirrors that meet at an edge")
    found = bench_nielsen_stable.measured(case)
    assert found.views == 4 and found.deepest == 2 and found.share <= 1 and found.nonfinite == 0
    assert found.drawn == found.pixels == found.judged > 300 and found.wrong < 0.05 * found.judged and max(found.errors) < 0.02
    rows = bench_nielsen_stable._rows([found])
    assert [row["holds"] for row in rows] == [True] * 3
    bad = bench_nielsen_stable._rows([found, replace(found, nonfinite=1, views=65, wrong=found.judged // 2)])
    assert [row["holds"] for row in bad] == [False] * 3
    assert len(bench_nielsen_stable._shown([found]).rows[0]) == len(bench_nielsen_stable._shown([found]).heads)
