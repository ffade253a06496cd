"""evaluation/bench_planner.py: rooms that are what they say, and rows that hold where they should; one tiny room judged."""

from functools import partial

import numpy as np

from reflect_addon.evaluation.bench import Target
from reflect_addon.evaluation.bench_planner import Answered, Judged, exhibit_of, judged, planning_row, told
from reflect_addon.evaluation.bench_planner_scene import crowd, random_room
from reflect_addon.evaluation.frame import open_frame


def answered(name, mean, cost, p95=0.5):
    return Answered(name, (p95,), mean, cost, 1000, 1.0)


def scene(best=(1.0, 1.0), enough=(1.0, 1.0, 0.5), promises=((1.0, 1.0),)):
    singles = (answered("dear", 1.0, 4.0), answered("cheap", 5.0, 1.0, 30.0))
    return Judged("s", singles, answered("auto", best[0], 4.0 * best[1]), answered("auto", enough[0], 4.0 * enough[1], enough[2]), promises, 0.1, ("dear",))


def test_rows_hold_where_they_should():
    def holds(*scenes):
        return [row["holds"] for row in told(list(scenes))]

    assert holds(scene()) == [True, True]
    assert holds(scene(best=(1.2, 1.0))) == [False, True]
    assert holds(scene(best=(1.0, 1.1))) == [False, True]
    assert holds(scene(best=(1.2, 1.0), enough=(1.0, 0.5, 0.9))) == [True, True], "half the cost of the cheapest that keeps the tolerance"
    assert holds(scene(best=(1.2, 1.0), enough=(1.0, 0.5, 1.1))) == [False, True], "which it must keep itself"
    assert holds(scene(promises=((1.0, 1.6),) + 9 * ((1.0, 1.4),))) == [True, True]
    assert holds(scene(promises=2 * ((1.0, 1.6),) + 9 * ((1.0, 1.4),))) == [True, False]
    assert scene(best=(0.01, 1.0)).against_best()[0] < 1 and scene().against_cheapest() == 1.0
    assert planning_row({"a": 0.09})["holds"] and not planning_row({"a": 0.09, "b": 0.11})["holds"]
    for one in (*told([scene()]), planning_row({"a": 0.1})):
        Target(**one)
    assert len(exhibit_of([scene()]).rows) == 4


def test_rooms_are_made_again_the_same_and_differ(fresh_file):
    def places(make):
        made = make()
        return {o.name: np.array(o.matrix_world) for o in made.objects}

    first, again, other = places(partial(random_room, 1)), places(partial(random_room, 1)), places(partial(random_room, 2))
    assert first.keys() == again.keys() and all(np.array_equal(first[name], again[name]) for name in first)
    assert any(name not in other or not np.array_equal(first[name], other[name]) for name in first)
    with open_frame(crowd(), None) as snapshot:
        assert len(snapshot.reflectors()) == 10 and len(snapshot.instances) == 56


def test_a_room_is_judged(fresh_file, tmp_path):
    bake = {"resolution": 32, "texels": 32, "view_texels": 16, "views": 4, "turns": 12, "samples": 1, "sky_error": 0}
    found = judged("room", random_room(3), tmp_path, lambda share, text: None, bake)
    names = [one.name for one in found.singles]
    assert names[0] == "environment" and abs(found.singles[0].cost - 1) < 1e-9 and "depth_maps" in names
    assert all(len(one.errors) == len(found.best.errors) > 0 for one in (*found.singles, found.enough))
    error, cost = found.against_best()
    assert error <= 1.5 and cost <= 1.0 + 1e-6 and found.planning > 0 and found.promises
