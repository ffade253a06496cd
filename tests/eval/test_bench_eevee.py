"""The bench of node groups in EEVEE: its room is a box, and what its rows say of pictures that are given."""

import bpy
import numpy as np
import pytest

from reflect_addon.core.errors import ReflectError
from reflect_addon.evaluation import bench, bench_eevee, bench_eevee_overlay, peer, peer_places
from reflect_addon.evaluation import bench_eevee_scene as scenes
from reflect_addon.evaluation.bench import Target
from reflect_addon.evaluation.bench_eevee import Found, Line
from reflect_addon.evaluation.bench_eevee_overlay import Pair
from reflect_addon.evaluation.frame import open_frame
from reflect_addon.scene.camera import camera_of
from reflect_addon.scene.raymap_numpy import numpy_ray_map

GREY = np.full((4, 4, 3), 0.5, np.float32)
TOLD = {"nodes": 1200, "look_ups": 9, "images": 1, "image_bytes": 2e6}


def line(name, flip, seconds=1.0, samples=peer.SAMPLES):
    ours = not name.startswith("EEVEE")
    return Line(name, samples, flip, seconds, 0.1, 2.0, TOLD if ours else {}, 3.0 if ours else None, GREY)


def job_of(scene, snapshot):
    camera = camera_of(scene, None, 16, 12)
    return peer.job_of(scene, scene.camera.name, camera, snapshot, numpy_ray_map(snapshot, camera))


def found(ours, theirs, without=(), case=scenes.CASES[0], fewer=()):
    return Found(case, tuple(ours), tuple(fewer), tuple(theirs), tuple(without), GREY)


def test_the_room_is_a_box_with_a_ball_and_only_rooms_have_a_volume():
    scene = scenes.box_room()
    with open_frame(scene, None) as snapshot:
        (ball,) = snapshot.reflectors()
        box = peer_places.room(snapshot, [ball.object_name])
        assert np.allclose(box.half, np.array(scenes.ROOM) / 2, atol=1e-3) and np.allclose(box.centre, (0, 0, scenes.ROOM[2] / 2), atol=1e-3)
        assert job_of(scene, snapshot).volume
    bpy.data.objects["Wall 0"].hide_render = True
    with open_frame(scene, None) as snapshot:
        assert not job_of(scene, snapshot).volume


def test_the_best_of_both_sides_are_compared():
    theirs = [line("EEVEE, tracing", 0.3, seconds=4.0), line("EEVEE, spheres", 0.2, seconds=2.0)]
    rows = {r["id"]: r for r in bench_eevee.told([found([line("box_proxy", 0.05), line("environment", 0.3)], theirs)], {})}
    assert rows["I7-flip"]["ours"] == pytest.approx([0.25]) and rows["I7-flip"]["holds"]
    assert rows["I7-time"]["ours"] == pytest.approx([0.5]) and rows["I7-time"]["holds"]
    [Target(**row) for row in rows.values()]


def test_a_slower_picture_is_the_best_only_where_all_are_slower():
    theirs = [line("EEVEE, spheres", 0.2, seconds=2.0)]
    fast, slow, slowest = line("box_proxy", 0.06, 1.9), line("depth_maps", 0.02, 2.1), line("light_field", 0.03, 4.0)
    assert found([fast, slow], theirs).best() == (fast, theirs[0])
    assert found([slow, slowest], theirs).best() == (slow, theirs[0])


def test_fewer_samples_count_at_equal_time_alone():
    theirs = [line("EEVEE, tracing", 0.3, seconds=4.0)]

    def told(seconds, of_fewer):
        one = found([line("depth_maps", 0.09, seconds)], theirs, fewer=[line("depth_maps", 0.09, of_fewer, bench_eevee.FEWER)])
        rows = {r["id"]: r for r in bench_eevee.told([one], {})}
        return rows["I7-time"], rows["I7-equal-time"]

    for seconds, of_fewer, in_time, at_equal_time in ((3.9, 3.0, True, True), (4.4, 3.6, False, True), (6.0, 4.8, False, False)):
        time, equal = told(seconds, of_fewer)
        assert time["ours"] == pytest.approx([seconds / 4.0]) and time["holds"] == in_time
        assert equal["holds"] == at_equal_time and equal["ours"] == pytest.approx([0.3 if at_equal_time else 1e9])
    assert f"depth_maps of {peer.SAMPLES} samples, 3.9 over 4.0 s" in told(3.9, 3.0)[1]["how"]
    assert f"depth_maps of {bench_eevee.FEWER} samples, 3.6 over 4.0 s" in told(4.4, 3.6)[1]["how"]


def test_what_is_missing_or_too_far_holds_not():
    theirs = [line("EEVEE, spheres", 0.2, seconds=2.0)]
    rows = {r["id"]: r for r in bench_eevee.told([found([line("box_proxy", 0.1, 3.0)], theirs, ["light_field has no node group."])], {})}
    assert not any(row["holds"] for row in rows.values()) and "light_field" in rows["I7-flip"]["how"]
    rows = {r["id"]: r for r in bench_eevee.told([found([], theirs, ["no"])], {})}
    assert rows["I7-flip"]["ours"] == [1e9] and not rows["I7-flip"]["holds"]
    rows = {r["id"]: r for r in bench_eevee.told([found([line("box_proxy", 0.05)], theirs)], {"kitchen": "It was ended by signal 11."})}
    assert rows["I7-flip"]["ours"] == pytest.approx([0.25, 1e9]) and "kitchen: It was ended" in rows["I7-flip"]["how"]
    assert not any(row["holds"] for row in rows.values())


def test_tables_name_both_and_what_was_left_out():
    shown = bench_eevee._exhibit(found([line("box_proxy", 0.1)], [line("EEVEE, spheres", 0.2)], ["light_field has no node group."]))
    assert [row[0] for row in shown.rows] == ["box_proxy", "EEVEE, spheres"] and "light_field" in shown.lead
    assert all(len(row) == len(shown.heads) for row in shown.rows) and len(shown.pictures) == 3


def test_groups_and_overlay_are_as_far_apart_as_their_worst_case():
    def pair(case, method, flip, **more):
        return Pair(case, method, flip, more.get("missing", 0.0), more.get("notes", ()), GREY, GREY)

    near = [pair("a", "environment", 0.004), pair("b", "environment", 0.002), pair("a", "box_proxy", 0.01, missing=0.25)]
    row = bench_eevee_overlay.told(near)
    assert row["ours"] == pytest.approx([0.004, 0.01]) and row["holds"] and "environment 0.0040 in a" in row["how"]
    far = bench_eevee_overlay.told([*near, pair("b", "light_field", 0.03)])
    none = bench_eevee_overlay.told([*near, pair("b", "light_field", None, notes=("It failed.",))])
    assert not far["holds"] and not none["holds"] and "It failed." in none["how"] and not bench_eevee_overlay.told([])["holds"]
    [Target(**one) for one in (row, far, none)]
    shown = bench_eevee_overlay.exhibit_of(near)
    assert shown.heads == ("method", "a", "b") and shown.rows[0] == ("environment", "0.0040", "0.0020") and "25.0 % in a" in shown.lead
    assert [caption for caption, _ in shown.pictures] == ["a, box_proxy: group", "a, box_proxy: overlay"]


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
