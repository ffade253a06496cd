"""The bench of node groups in EEVEE: its room is a box, and what its rows say of pictures that are given."""

import numpy as np
import pytest

from reflect_addon.core.errors import ReflectError
from reflect_addon.evaluation import bench, bench_eevee, peer_places
from reflect_addon.evaluation import bench_eevee_scene as scenes
from reflect_addon.evaluation.bench import Target
from reflect_addon.evaluation.bench_eevee import Found, Line
from reflect_addon.evaluation.frame import open_frame

GREY = np.full((4, 4, 3), 0.5, np.float32)
TOLD = {"nodes": 1200, "look_ups": 9, "images": 1, "image_bytes": 2e6}


def line(name, flip, apart=None, seconds=1.0):
    return Line(name, flip, apart, seconds, 0.1, 2.0, TOLD if apart is not None else {}, 3.0 if apart is not None else None, GREY)


def found(ours, theirs, without=(), case=scenes.CASES[0]):
    return Found(case, tuple(ours), tuple(theirs), tuple(without), GREY)


def test_the_room_is_a_box_with_a_ball():
    with open_frame(scenes.box_room(), None) as snapshot:
        (ball,) = snapshot.reflectors()
        box = peer_places.room(snapshot, [ball.object_name])
        assert np.allclose(box.half, np.array(scenes.ROOM) / 2, atol=1e-3) and np.allclose(box.centre, (0, 0, scenes.ROOM[2] / 2), atol=1e-3)


def test_the_best_of_both_sides_are_compared():
    theirs = [line("EEVEE, tracing", 0.3, seconds=4.0), line("EEVEE, spheres", 0.2, seconds=2.0)]
    rows = {r["id"]: r for r in bench_eevee.told([found([line("box_proxy", 0.05, 0.01), line("environment", 0.3, 0.015)], theirs)])}
    assert rows["I7-flip"]["ours"] == pytest.approx([0.25]) and rows["I7-flip"]["holds"]
    assert rows["I7-time"]["ours"] == pytest.approx([0.5]) and rows["I7-time"]["holds"]
    assert rows["I7-overlay"]["ours"] == pytest.approx([0.01, 0.015]) and rows["I7-overlay"]["holds"]
    [Target(**row) for row in rows.values()]


def test_what_is_missing_or_too_far_holds_not():
    theirs = [line("EEVEE, spheres", 0.2, seconds=2.0)]
    rows = {r["id"]: r for r in bench_eevee.told([found([line("box_proxy", 0.1, 0.03, 3.0)], theirs, ["light_field has no node group."])])}
    assert not any(row["holds"] for row in rows.values()) and "light_field" in rows["I7-overlay"]["how"]
    rows = {r["id"]: r for r in bench_eevee.told([found([], theirs, ["no"])])}
    assert rows["I7-flip"]["ours"] == [1e9] and not rows["I7-flip"]["holds"] and not rows["I7-overlay"]["holds"]


def test_tables_name_both_and_what_was_left_out():
    shown = bench_eevee._exhibit(found([line("box_proxy", 0.1, 0.03)], [line("EEVEE, spheres", 0.2)], ["light_field has no node group."]))
    assert [row[0] for row in shown.rows] == ["box_proxy", "EEVEE, spheres"] and "light_field" in shown.lead
    assert all(len(row) == len(shown.heads) for row in shown.rows) and len(shown.pictures) == 3


def test_all_leaves_it_out(tmp_path, monkeypatch):
    asked = []
    monkeypatch.setattr(bench, "PAPERS", {name: (lambda progress, name=name: asked.append(name) or [],) for name in ("yu", "eevee")})
    monkeypatch.setattr(bench.stability, "measure", lambda progress: [])
    bench.bench("all", tmp_path, print)
    assert asked == ["yu"]
    bench.bench("eevee", tmp_path, print)
    assert asked == ["yu", "eevee"]


def test_a_missing_sample_is_a_sentence(tmp_path, monkeypatch):
    monkeypatch.setattr(scenes, "SAMPLES", tmp_path)
    with pytest.raises(ReflectError, match="contact"):
        scenes.open_case(scenes.CASES[0], tmp_path / "copy")
