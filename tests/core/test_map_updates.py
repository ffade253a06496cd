"""core/map_updates.py and reflection_passes.py: maps are made where they err most, age, settle in the frames that are said, and then cost nothing."""

import numpy as np
import pytest
from analytic import unit
from mirror_views import camera, mirror

from reflect_addon.core.curved_views import CurvedMirror
from reflect_addon.core.map_updates import MOST_COUPLED, Moved, coupling_of, moved_share, none_yet, settle_frames, solid_share, update
from reflect_addon.core.reflection_passes import view_dependent, view_independent
from reflect_addon.core.reflection_tree import BACK_FACES_ONLY, TreeSettings

BALLS = tuple(CurvedMirror(i, np.array([1.5 * i, 0.3 * i, 1.0]), 0.5, 0.8) for i in range(4))
FLOOR = (mirror((2, 0, 0), (0, 0, 1), 8.0, specular=0.6),)
TOLERANCE = 1e-3


def settle(coupling, budget, start, frames):
    """(frames until no map is due, maps made in each)."""
    kept, made = start, []
    for frame in range(frames):
        remade, kept = update(kept, np.zeros(len(coupling)), coupling, np.ones(len(coupling)), frame, budget, TOLERANCE)
        made.append(remade)
    return kept, made


@pytest.mark.parametrize("budget", [1, 2, 4])
@pytest.mark.parametrize("seed", range(5))
def test_at_rest_every_error_ends_in_the_frames_that_are_said(budget, seed):
    rng = np.random.default_rng(seed)
    for coupling in (coupling_of(BALLS, FLOOR), rng.dirichlet(np.ones(6), 5)[:, :5] * MOST_COUPLED, np.zeros((3, 3))):
        said = settle_frames(coupling, budget, TOLERANCE)
        kept, made = settle(coupling, budget, none_yet(len(coupling)), said + 5)
        assert kept.stale.max() <= TOLERANCE and None not in kept.made
        assert all(len(m) <= budget for m in made) and made[-5:] == [()] * 5


def test_the_largest_error_is_first_and_others_age():
    coupling = np.zeros((4, 4))
    kept, _ = settle(coupling, 4, none_yet(4), 1)
    changed = np.array([0.1, 0.4, 0.0, 0.2])
    first, kept = update(kept, changed, coupling, np.ones(4), 7, 1, TOLERANCE)
    assert first == (1,) and kept.age(7) == (7, 0, 7, 7)
    np.testing.assert_allclose(kept.stale, [0.1, 0, 0, 0.2])
    then, kept = update(kept, np.zeros(4), coupling, np.array([5.0, 1, 1, 1]), 8, 3, TOLERANCE)
    assert then == (0, 3) and kept.age(8) == (0, 1, 8, 0)  # weighted, and what is right is left alone
    assert update(none_yet(2), np.zeros(2), np.zeros((2, 2)), np.array([1.0, 9]), 0, 1, TOLERANCE)[0] == (1,)


def test_while_all_moves_errors_are_bounded_by_what_changes_in_a_round():
    """Two maps of four a frame: none is older than a round, so none is off by more than a round's changes and what it inherits."""
    coupling, kept = coupling_of(BALLS, FLOOR), none_yet(4)
    for frame in range(40):
        _, kept = update(kept, np.full(4, 0.01), coupling, np.ones(4), frame, 2, TOLERANCE)
        if frame > 10:
            assert kept.stale.max() <= 0.01 * 2 / (1 - coupling.sum(1).max()) and max(kept.age(frame)) <= 3


def test_shares_are_solid_angles(rng):
    directions = unit(rng.normal(size=(200000, 3)))
    center = np.array([0.4, 0.8, -0.3])
    met = (directions @ center > 0) & (np.linalg.norm(np.cross(directions, center), axis=1) < 0.5)
    assert solid_share(center, np.zeros(3), 0.5) == pytest.approx(met.mean(), abs=4e-3)
    assert solid_share(center, center, 0.5) == 1 and solid_share(center, np.full(3, 1e9), 0.5) < 1e-17


def test_couplings_hold_what_planes_show_and_leave_something_out():
    bare, floored = coupling_of(BALLS, ()), coupling_of(BALLS, FLOOR)
    assert np.all(np.diag(bare) == 0) and np.all(np.diag(floored) > 0) and np.all(floored >= bare)
    chamber = tuple(mirror(0.6 * n, -n, 5) for n in np.vstack([np.eye(3), -np.eye(3)]))
    assert coupling_of((CurvedMirror(0, np.zeros(3), 0.5, 1.0),), chamber).sum() <= MOST_COUPLED + 1e-12


def test_what_moves_near_counts_more_and_a_mirror_that_moves_is_wrong_itself():
    near, far = (Moved(np.array([0.0, d, 1.0]), 0.3, 0.1) for d in (1.0, 8.0))
    assert moved_share(BALLS[0], (near,), 0) > 10 * moved_share(BALLS[0], (far,), 0) > 0
    assert moved_share(BALLS[0], (), 0) == 0 and moved_share(BALLS[0], (), 9.0) == 1


@pytest.mark.parametrize("planar, curved, depth", [(1, 3, 2), (2, 2, 2), (3, 1, 3), (3, 2, 4)])
def test_dynamic_minus_static_is_six_times_curved_times_what_a_face_holds(planar, curved, depth):
    planes = [mirror(3 * n, -n, 2.8) for n in -np.eye(3)[:planar]]  # a corner: from anywhere in it all are seen, and each through each
    balls = [CurvedMirror(i, np.array([-1.0, 0.5 * i, -1.0]), 0.2, 1.0) for i in range(curved)]
    settings = TreeSettings(depth=depth, most=10**6, culling=BACK_FACES_ONLY)
    view = camera((2, 2.1, 2.2), (-1, -1, -1))
    static, moving = (view_independent(view, planes, balls, settings, made) for made in ({}, dict.fromkeys(range(curved), 128)))
    inside = {len(face.tree.nodes) for face in moving.faces}
    assert static.faces == () and len(moving.faces) == 6 * curved and len(inside) == 1
    assert moving.planar - static.planar == 6 * curved * inside.pop() > 0
    assert {n.depth for face in moving.faces for n in face.tree.nodes} == set(range(2, depth + 1))
    both = view_dependent(view, planes, balls, settings)
    assert both.faces == () and both.planar < len(both.main.nodes) and moving.pixels > static.pixels


def test_culling_leaves_a_face_what_it_sees():
    """Each mirror of a corner is seen by the faces that look at it, and by no others."""
    planes = [mirror(3 * n, -n, 2.8) for n in -np.eye(3)]
    ball = CurvedMirror(0, np.array([-1.0, -1.0, -1.0]), 0.2, 1.0)
    passes = view_independent(camera((2, 2.1, 2.2), (-1, -1, -1)), planes, [ball], TreeSettings(depth=2), {0: 128})
    seen = [{n.mirror for n in face.tree.nodes} for face in passes.faces]
    assert [0 in seen[1], 1 in seen[3], 2 in seen[5]] == [True] * 3 and [0 in seen[0], 1 in seen[2], 2 in seen[4]] == [False] * 3
