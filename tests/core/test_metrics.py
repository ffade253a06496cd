"""Error measures against values worked out by hand, and what they make of nothing, NaN, infinities and suns."""

import sys

import numpy as np
import pytest

from reflect_addon.core import metrics
from reflect_addon.core.pareto import pareto_front
from reflect_addon.core.rays import Answer, Hits, Rays
from reflect_addon.core.spaces import FAR, STATUS_FELL_BACK, STATUS_HIT, STATUS_NONE
from reflect_addon.evaluation import eye


def test_rmse_and_relmse_by_hand():
    truth = np.array([[1.0, 0, 0], [0, 0, 0]])
    answer = np.array([[1.0, 0, 0], [0.6, 0, 0]])
    assert metrics.rmse(answer, truth) == pytest.approx(np.sqrt(0.36 / 6))
    assert metrics.relmse(answer, truth) == pytest.approx(0.36 / metrics.RELATIVE_FLOOR / 6)
    assert metrics.rmse(truth, truth) == metrics.relmse(truth, truth) == 0


def test_relative_median_is_a_share_and_ignores_one_sun():
    truth = np.array([[1.0, 1, 1]] * 5)
    answer = truth * 1.01
    answer[0] = 6e4
    assert metrics.median_relative(answer, truth) == pytest.approx(0.01, rel=1e-3)


def test_hdr_peaks_do_not_overflow():
    truth, answer = np.full((4, 3), 3e38, np.float32), np.zeros((4, 3), np.float32)
    assert np.isfinite(metrics.rmse(answer, truth))
    assert metrics.relmse(answer, truth) == pytest.approx(1.0)


def test_nonfinite_is_counted_and_costs_what_black_costs():
    truth = np.ones((2, 3))
    answer = np.array([[np.nan, 1, 1], [np.inf, 1, -np.inf]])
    assert metrics.nonfinite(answer, truth) == 3
    assert metrics.rmse(answer, truth) == pytest.approx(np.sqrt(3 / 6))


def test_no_rays_give_none_not_nan():
    none = np.zeros((0, 3), np.float32)
    assert metrics.rmse(none, none) is metrics.relmse(none, none) is metrics.median_relative(none, none) is None
    errors = metrics.hit_errors(*_case([], [], []), diagonal=1.0)
    assert all(v is None for v in vars(errors).values())


def _case(positions, truths, status):
    """Rays along +X from the origin; None is the sky."""
    n = len(positions)
    origin, direction = np.zeros((n, 3), np.float32), np.tile(np.float32([1, 0, 0]), (n, 1))
    sky = np.float32([FAR, 0, 0])
    shown = np.array([sky if p is None else p for p in positions], np.float32).reshape(n, 3)
    real = np.array([sky if p is None else p for p in truths], np.float32).reshape(n, 3)
    hit = np.array([p is not None for p in truths], bool)
    zero = np.zeros((n, 3), np.float32)
    answer = Answer(zero, np.ones(n, np.float32), shown, np.array(status, np.float32))
    return answer, Hits(zero, real, zero, np.where(hit, 0, -1).astype(np.int32), hit), Rays(origin, direction)


def test_hit_errors_by_hand():
    a, fell = STATUS_HIT, STATUS_FELL_BACK
    shown = [(10, 0, 0), (10, 10, 0), (5, 0, 0), None, None, (3, 0, 0)]
    real = [(10, 0, 0), (10, 0, 0), None, (4, 0, 0), None, (4, 0, 0)]
    errors = metrics.hit_errors(*_case(shown, real, [a, fell, a, fell, fell, STATUS_NONE]), diagonal=100.0)
    assert errors.hit_p50 == pytest.approx(0.05) and errors.hit_p95 == pytest.approx(0.095)
    assert errors.angle_p50 == pytest.approx(22.5) and errors.angle_p95 == pytest.approx(45 * 0.95)
    assert errors.false_hit == pytest.approx(1 / 6)
    assert errors.missed_hit == pytest.approx(2 / 6), "no answer at all is a miss too"


def test_small_angles_are_not_lost():
    errors = metrics.hit_errors(*_case([(1, 1e-5, 0)], [(1, 0, 0)], [STATUS_HIT]), diagonal=1.0)
    assert errors.angle_p50 == pytest.approx(np.degrees(1e-5), rel=1e-4)


def test_a_position_that_is_not_finite_is_a_miss():
    errors = metrics.hit_errors(*_case([(np.nan, 0, 0)], [(1, 0, 0)], [STATUS_HIT]), diagonal=1.0)
    assert errors.missed_hit == 1 and errors.hit_p50 is None


def test_a_scene_without_size_is_refused():
    with pytest.raises(ValueError, match="diagonal"):
        metrics.hit_errors(*_case([(1, 0, 0)], [(1, 0, 0)], [STATUS_HIT]), diagonal=0.0)


@pytest.mark.parametrize("measure, equal", [(eye.flip, 0.0), (eye.ssim, 1.0)])
def test_eye_measures_judge_the_mask_only(measure, equal, rng):
    truth = rng.random((24, 32, 3)).astype(np.float32)
    mask = np.zeros((24, 32), bool)
    mask[8:16, 8:24] = True
    elsewhere = np.where(mask[..., None], truth, 1 - truth)
    assert measure(elsewhere, truth, mask)[0] == pytest.approx(equal, abs=1e-5), "only unmasked pixels differ"
    inside, _ = measure(np.where(mask[..., None], 1 - truth, truth), truth, mask)
    assert abs(inside - equal) > 0.1
    narrow, _ = measure(elsewhere, truth, ~mask)
    assert abs(narrow - equal) > 0.1


@pytest.mark.parametrize("measure", [eye.flip, eye.ssim])
def test_eye_measures_survive_degenerate_pictures(measure):
    black, mask = np.zeros((3, 2, 3), np.float32), np.ones((3, 2), bool)
    broken = np.full((3, 2, 3), np.nan, np.float32)
    broken[0] = np.inf
    value, note = measure(broken, black, mask)
    assert np.isfinite(value) and note == ""
    value, note = measure(black, black, ~mask)
    assert value is None and "no reflector pixel" in note


@pytest.mark.parametrize("measure, module", [(eye.flip, "flip_evaluator"), (eye.ssim, "skimage.metrics")])
def test_a_missing_package_is_a_note(measure, module, monkeypatch):
    monkeypatch.setitem(sys.modules, module, None)
    picture = np.zeros((8, 8, 3), np.float32)
    value, note = measure(picture, picture, np.ones((8, 8), bool))
    assert value is None and "not installed" in note


def test_pareto_front_by_hand():
    points = [(1, 5), (2, 2), (3, 3), (4, 1), (None, 0), (2, 2), (float("nan"), 0), (5, 1)]
    assert pareto_front(points) == [0, 1, 3]
    assert pareto_front([]) == []


def test_nothing_beats_the_front(rng):
    points = [tuple(p) for p in rng.random((200, 2))]
    front = pareto_front(points)
    for i, p in enumerate(points):
        beaten = any(q[0] <= p[0] and q[1] <= p[1] and q != p for q in points)
        assert beaten == (i not in front)
