"""The bench of a render farm: its scene moves, and what its rows say of frames that are given."""

import numpy as np
import pytest

from reflect_addon.evaluation import bench_eevee_farm as bench
from reflect_addon.evaluation import bench_eevee_farm_scene as farm
from reflect_addon.evaluation.bench import Target
from reflect_addon.evaluation.frame import open_frame

GREY = np.full((4, 4, 3), 0.5, np.float32)


def test_the_body_moves_turns_and_is_all_that_mirrors():
    scene = farm.moving_body()
    places = []
    for frame in (1, farm.FRAMES):
        with open_frame(scene, frame) as snapshot:
            (body,) = snapshot.reflectors()
            places.append(body.world_from_object)
    assert body.name == farm.BODY and scene.frame_current == 1
    assert np.linalg.norm(places[1][:3, 3] - places[0][:3, 3]) > 0.9 and not np.allclose(places[0][:3, :3], places[1][:3, :3], atol=0.2)


def test_what_is_wrong_with_frames_is_said():
    frames = [GREY * k for k in (0.5, 1.0)]
    assert farm.what_is_wrong(frames, 2) == []
    assert farm.what_is_wrong(frames, 3) == ["2 of 3 frames were written"]
    assert farm.what_is_wrong([GREY * 0, *frames], 3) == ["frame 1 is black"]
    assert farm.what_is_wrong([GREY * np.nan, *frames], 3) == ["frame 1 is black"]
    assert farm.what_is_wrong([frames[0], *frames], 3) == ["frame 2 is the one before"]


def test_rows_tell_frames_and_growth():
    well = bench.Animation("box_proxy", (), (0.02, 0.03, 0.03, 0.04), 0.02, (GREY,) * 4)
    rows = {r["id"]: r for r in bench.told([well])}
    assert rows["I7-farm"]["holds"] and rows["I7-farm"]["ours"] == 0
    assert rows["I7-farm-error"]["ours"] == pytest.approx([2.0]) and rows["I7-farm-error"]["target"] is None
    bad = bench.Animation("billboards", ("frame 3 is black",), well.flip, well.anew, well.pictures)
    rows = {r["id"]: r for r in bench.told([well, bad])}
    assert not rows["I7-farm"]["holds"] and "billboards: frame 3 is black" in rows["I7-farm"]["how"]
    [Target(**row) for row in rows.values()]
    shown = bench._exhibit([well, bad], bench.Truths(None, (GREY,) * 4, ()))
    assert len(shown.pictures) == 8 and all(len(row) == len(shown.heads) for row in shown.rows)
