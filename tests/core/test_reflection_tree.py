"""core/tree_growth.py: the views are those that rays find, their windows are tight, what is left out is said, and work is bounded."""

from collections import Counter
from dataclasses import replace
from time import process_time

import numpy as np
import pytest
from analytic import rotation, unit
from mirror_views import camera, clip_of, mirror
from tolerances import SHARE_COUNTED

from reflect_addon.core import glossy_window
from reflect_addon.core.curved_views import CurvedMirror, approximate_view, cube_views, outline_of
from reflect_addon.core.map_size import KEEP, LEAST, STEP, side_of, targets_of
from reflect_addon.core.reflection_tree import (
    BACK_FACES_ONLY,
    BEHIND,
    DEPTH,
    FAINT,
    MOST,
    NOTHING_CULLED,
    REASONS,
    ROOT,
    SMALL,
    Culling,
    TreeSettings,
)  # fmt: skip
from reflect_addon.core.spaces import cube_coordinates
from reflect_addon.core.tree_growth import grow

SHARP = TreeSettings(depth=3, most=4000, least_pixels=1e-9, least_energy=0.0)


def paths_of(tree):
    """(mirrors from the eye) -> node."""
    found = {}
    for i, node in enumerate(tree.nodes):
        path, at = (node.mirror,), node.parent
        assert at < i
        while at != ROOT:
            path, at = (tree.nodes[at].mirror, *path), tree.nodes[at].parent
        assert path not in found and len(path) == node.depth and node.path == path
        found[path] = node
    return found


def seen_by_rays(view, planes, depth):
    """path -> share of the pixels whose ray meets these mirrors on their mirroring side in this order, others being transparent."""
    rays = view.primary_rays()
    found, work = Counter(), [((), rays.origin.astype(float), rays.direction.astype(float))]
    while work:
        path, origin, direction = work.pop()
        if len(path) == depth:
            continue
        for k, plane in enumerate(planes):
            down = direction @ plane.normal
            with np.errstate(divide="ignore", invalid="ignore"):
                t = ((plane.origin - origin) @ plane.normal) / down
            met = (down < 0) & (t > 1e-9)
            if path and path[-1] == k:
                continue
            at = origin + np.where(met, t, 0.0)[:, None] * direction
            for a, b in zip(plane.outline, np.roll(plane.outline, -1, 0), strict=True):
                met &= (at - a) @ np.cross(plane.normal, b - a) >= 0
            if met.any():
                found[(*path, k)] += met.sum() / (view.width * view.height)
                work.append(((*path, k), at[met], direction[met] - 2 * down[met, None] * plane.normal))
    return found


def scattered(rng, count):
    """Mirrors around the origin that mostly face it."""
    away = unit(rng.normal(size=(count, 3)) + [0, 0.4, 0])
    return [mirror(3 * a, -a + 0.3 * rng.normal(size=3), rng.uniform(0.8, 2), corners=rng.integers(3, 8)) for a in away]


@pytest.mark.parametrize("orthographic", [False, True])
@pytest.mark.parametrize("seed", range(4))
def test_the_views_are_those_that_rays_find(seed, orthographic):
    rng = np.random.default_rng(seed)
    planes = scattered(rng, 7)
    view = camera((0, -2, 1), (0, 0, 0), (120, 90), near=1e-3, orthographic=orthographic, lens=3.0 if orthographic else 1.2)
    found = paths_of(grow(view, planes, SHARP))
    truth = seen_by_rays(view, planes, SHARP.depth)
    assert len(truth) > 10 and max(map(len, truth)) == 3
    for path in set(found) | set(truth):
        share = found[path].share if path in found else 0.0
        assert share == pytest.approx(truth.get(path, 0.0), abs=SHARE_COUNTED)
    for node in found.values():
        x, y, w, h = node.window
        assert 0 <= x and 0 <= y and x + w <= 120 and y + h <= 90 and w >= 1 and h >= 1 and node.drawn == node.window


def test_a_childs_camera_sees_what_the_polygon_says(rng):
    """The outline of every mirror, seen by its parent's camera, holds the node's polygon."""
    planes = scattered(rng, 6)
    tree = grow(camera((0, -2, 1), (0, 0, 0)), planes, SHARP)
    for node in tree.nodes:
        parent = tree.root if node.parent == ROOT else tree.nodes[node.parent].camera
        clip = clip_of(parent, planes[node.mirror].outline)
        if clip[:, 3].min() > 0:
            flat = (clip[:, :2] / clip[:, 3:] * 0.5 + 0.5) * (320, 240)
            turned = flat if np.sign(np.cross(*np.diff(np.pad(flat, ((0, 0), (0, 1)))[:3], axis=0))[2]) > 0 else flat[::-1]
            for a, b in zip(turned, np.roll(turned, -1, 0), strict=True):
                e = b - a
                assert all(e[0] * (q - a[1]) - e[1] * (p - a[0]) > -1e-6 * np.abs(e).max() for p, q in node.polygon)


@pytest.mark.parametrize("planar, curved, depth, count", [(6, 1, 2, 49), (1, 3, 2, 16), (2, 2, 2, 16), (3, 1, 3, 52)])
def test_without_culling_as_many_as_the_pseudocode_makes(planar, curved, depth, count, rng):
    mirrors = [*scattered(rng, planar), *(CurvedMirror(i, rng.normal(size=3), 0.3, 1.0) for i in range(curved))]
    tree = grow(camera((0, -2, 1), (0, 0, 0)), mirrors, replace(SHARP, depth=depth, culling=NOTHING_CULLED))
    assert len(tree.nodes) == count and sum(tree.culled.values()) == tree.culled[DEPTH] and tree.levels == depth


def test_every_mirror_is_a_node_or_counted(rng):
    """What each view meets, the mirror that it was made by aside."""
    planes = scattered(rng, 9)
    for settings in (TreeSettings(), TreeSettings(most=5), TreeSettings(culling=BACK_FACES_ONLY), SHARP):
        tree = grow(camera((0, -2, 1), (0, 0, 0)), planes, settings)
        assert set(tree.culled) == set(REASONS)
        met = 9 + sum(8 for node in tree.nodes if node.depth < settings.depth)
        assert met == len(tree.nodes) + sum(tree.culled.values()) - tree.culled[DEPTH]
        assert len(tree.ended) == sum(tree.culled[r] for r in (SMALL, FAINT, DEPTH, MOST))


@pytest.mark.parametrize("turn", [0.0, 0.01])
def test_two_facing_mirrors_have_as_many_views_as_reflections_are_seen(turn):
    """One more for each level at most: each is seen once more in the other, until it no longer is."""
    planes = [mirror((0, -1, 0), (turn, 1, 0)), mirror((0, 1, 0), (0, -1, turn))]
    view = camera((0.3, -0.5, 0.2), (0, 1, 0), (160, 120), near=1e-3, far=1e3)
    for depth in (2, 4, 8, 16, 32):
        tree = grow(view, planes, replace(SHARP, depth=depth))
        seen = seen_by_rays(view, planes, depth)
        assert set(paths_of(tree)) >= {path for path, share in seen.items() if share > 4e-4}
        assert len(tree.nodes) <= depth


def test_what_ends_for_its_depth_is_what_the_next_level_would_show(rng):
    planes = scattered(rng, 8)
    view = camera((0, -2, 1), (0, 0, 0))
    for depth in (0, 1, 2):
        deeper = grow(view, planes, replace(SHARP, depth=depth + 1))
        tree = grow(view, planes, replace(SHARP, depth=depth))
        assert tree.left_out[DEPTH] == pytest.approx(sum(n.energy for n in deeper.nodes if n.depth == depth + 1))
        assert tree.levels == depth and tree.left_out[DEPTH] > 0


def test_thresholds_leave_out_no_more_than_they_say(rng):
    planes = [replace(p, specular=0.3, grazing=0.6) for p in scattered(rng, 10)]
    view = camera((0, -2, 1), (0, 0, 0))
    every = paths_of(grow(view, planes, SHARP))
    for settings in (replace(SHARP, least_energy=2e-3), replace(SHARP, least_pixels=60.0), replace(SHARP, most=9)):
        tree = grow(view, planes, settings)
        kept = paths_of(tree)
        cut = {p: n for p, n in every.items() if p not in kept and (len(p) == 1 or p[:-1] in kept)}
        assert len(kept) < len(every) and set(kept) <= set(every)
        assert sum(tree.left_out.values()) - tree.left_out[DEPTH] == pytest.approx(sum(n.energy for n in cut.values()))
        assert all(n.energy >= settings.least_energy and n.share * 320 * 240 >= settings.least_pixels for n in kept.values())
    assert min(n.energy for n in kept.values()) >= max(n.energy for n in cut.values()) * (1 - 1e-9)  # `most` keeps the strongest


def test_weights_are_products_and_rise_towards_grazing():
    glass = mirror((0, 0, 0), (0, 0, 1), 0.01, specular=0.04)
    weights = []
    for height in (10.0, 2.0, 0.3):
        (node,) = grow(camera((0, -3, height), (0, 0, 0)), [glass], SHARP).nodes
        cosine = height / np.hypot(3, height)
        assert node.weight == pytest.approx(0.04 + 0.96 * (1 - cosine) ** 5, rel=0.05)
        weights.append(node.weight)
    assert weights == sorted(weights)
    planes = [mirror((0, -1, 0), (0, 1, 0), specular=0.5, grazing=0.5), mirror((0, 1, 0), (0, -1, 0), specular=0.25, grazing=0.25)]
    tree = grow(camera((0.3, -0.5, 0.2), (0, 1, 0), near=1e-3), planes, SHARP)
    assert [n.weight for n in tree.nodes] == [0.25, 0.125, 0.03125]


def test_each_culling_can_be_switched_off(rng):
    planes = scattered(rng, 8)
    view = camera((0, -2, 1), (0, 0, 0))
    settings = replace(SHARP, depth=2, least_pixels=60.0, least_energy=1e-3)
    counts, pixels = {}, {}
    for name in ("back_faces", "frustum", "window", "area", "energy", "scissor"):
        tree = grow(view, planes, replace(settings, culling=replace(Culling(), **{name: False})))
        counts[name], pixels[name] = len(tree.nodes), tree.pixels
    base = grow(view, planes, settings)
    assert all(counts[name] >= len(base.nodes) for name in counts) and pixels["scissor"] > 3 * base.pixels
    assert counts["scissor"] == len(base.nodes) and counts["back_faces"] > len(base.nodes) < counts["window"]
    # Seen from behind a mirror shows nothing.
    off = grow(view, planes, replace(settings, culling=replace(Culling(), back_faces=False)))
    assert {n.mirror for n in off.nodes if n.depth == 1 and n.facing} == {n.mirror for n in base.nodes if n.depth == 1}


def test_order_is_depth_first_with_a_branch_at_a_time(rng):
    tree = grow(camera((0, -2, 1), (0, 0, 0)), scattered(rng, 8), SHARP)
    order, stack = [], [ROOT]
    while stack:
        at = stack.pop()
        order.append(at)
        stack += reversed(tree.children[at])
    assert order == [ROOT, *range(len(tree.nodes))]
    assert all(tree.nodes[c].parent == at for at, kids in tree.children.items() for c in kids)


def finite(tree):
    for node in tree.nodes:
        numbers = [node.camera.world_from_camera, node.camera.clip_from_camera, np.ravel(node.polygon), [node.weight, node.share]]
        assert all(np.isfinite(n).all() for n in numbers) and 0 <= node.share <= 1 and 0 <= node.weight <= 1
    assert all(np.isfinite(e.energy) for e in tree.ended) and np.isfinite(sum(tree.left_out.values()))


EYE = (0.0, -4.0, 1.0)
EXTREMES = {
    "in the plane": [mirror((0, 0, 1), (0, 0, 1)), mirror((0, 1, 1), (0, -1, 0))],
    "almost in the plane": [mirror((0, 0, 1 - 1e-9), (0, 0, 1)), mirror((0, 0, 1 - 1e-5), (0, 0, 1))],
    "behind": [mirror((0, 0, 1), (0, 1, 0))],
    "meeting at an edge": [mirror((0, 0, 0), (0, -1, 0)), mirror((1, -1, 0), (-1, 0, 0)), mirror((0, -1, -1), (0, 0, 1))],
    "at a sharp angle": [mirror((0, 0, 0), (0.05, -1, 0)), mirror((0, -0.02, 0), (-0.05, 1, 0))],
    "both sides of a pane": [mirror((0, 0, 1), (0, -1, 0)), mirror((0, 0, 1), (0, 1, 0))],
    "the same twice": [mirror((0, 0, 1), (0, -1, 0)), mirror((0, 0, 1), (0, -1, 0))],
    "through one another": [mirror((0, 0, 1), (1, -1, 0), 2), mirror((0, 0, 1), (-1, -1, 0), 2)],
    "one pixel": [mirror((0.1 * i, 0, 1), (0.2 * (i - 5), -1, 0), 0.008) for i in range(10)],
    "tiny": [mirror((0, -4 + 2e-4, 1), (0, -1, 0), 1e-4), mirror((0, -4 - 2e-4, 1), (0, 1, 0), 1e-4)],
    "huge": [mirror((0, 1e5, 0), (0, -1, 0), 1e5), mirror((0, -1e5, 0), (0, 1, 0), 1e5), mirror((0, 0, -1), (0, 0, 1), 1e5)],
    "cut by the near plane": [mirror((0, -3.9, 1), (0.3, -1, 0)), mirror((0, -4, 0.99), (0, 0, 1), 5), mirror((0, 0, 3), (0, 0, -1), 5)],
    "the eye on its outline": [mirror((1, -4, 0), (0, 0, 1), 1), mirror((0, 0, 1), (0, -1, 0))],
}


@pytest.mark.parametrize("orthographic", [False, True])
@pytest.mark.parametrize("name", EXTREMES)
def test_extremes_are_finite_and_bounded(name, orthographic):
    for near in (1e-5, 0.1, 10.0):
        view = camera(EYE, (0, 0, 1), near=near, far=4e5, orthographic=orthographic)
        for culling in (Culling(), BACK_FACES_ONLY, NOTHING_CULLED):
            tree = grow(view, EXTREMES[name], TreeSettings(depth=6, most=200, least_pixels=1e-3, least_energy=0, culling=culling))
            finite(tree)
            assert len(tree.nodes) <= 200
    if name in {"behind", "both sides of a pane"}:
        assert len(grow(view, EXTREMES[name], SHARP).nodes) == (name != "behind") * (near < 4)


def test_the_other_side_of_a_pane_is_never_seen_through_it(rng):
    for _ in range(200):
        place, normal = 3 * rng.normal(size=3), rng.normal(size=3)
        tree = grow(camera(10 * rng.normal(size=3), place), [mirror(place, normal), mirror(place, -normal)], SHARP)
        assert len(tree.nodes) == 1


def test_a_mirror_in_the_eyes_plane_is_behind():
    tree = grow(camera(EYE, (0, 0, 1)), EXTREMES["in the plane"][:1], SHARP)
    assert tree.nodes == () and tree.culled[BEHIND] == 1 and sum(tree.left_out.values()) == 0


@pytest.mark.parametrize("size", [1e-4, 1.0, 1e5])
def test_the_tree_is_the_same_at_any_scale(size):
    trees = []
    for s in (1.0, size):
        rng = np.random.default_rng(5)
        planes = [replace(p, origin=s * p.origin, outline=s * p.outline) for p in scattered(rng, 7)]
        trees.append(paths_of(grow(camera((0, -2 * s, s), (0, 0, 0), near=0.01 * s, far=100 * s), planes, SHARP)))
    assert set(trees[0]) == set(trees[1])
    for path, node in trees[0].items():
        assert trees[1][path].share == pytest.approx(node.share, abs=1e-9) and trees[1][path].window == node.window


def test_fifty_mirrors_end_in_time(rng):
    """A round room of fifty: everything sees everything. `most` bounds the views, and work is mirrors times views."""
    angle = 2 * np.pi * np.arange(50) / 50
    planes = [mirror((5 * np.cos(a), 5 * np.sin(a), 0), (-np.cos(a), -np.sin(a), 0), 0.3, reflector=i) for i, a in enumerate(angle)]
    view = camera((0.5, 0.2, 0.1), (3, 1, 0), near=1e-3)
    start = process_time()
    tree = grow(view, planes, TreeSettings(depth=8, most=64, least_pixels=0, least_energy=0))
    assert len(tree.nodes) == 64 and tree.culled[MOST] > 0 and tree.left_out[MOST] > 0
    assert process_time() - start < 5
    finite(tree)


def test_no_mirrors_and_no_depth_are_no_views():
    view = camera(EYE, (0, 0, 1))
    assert grow(view, [], SHARP).nodes == () and grow(view, EXTREMES["huge"], replace(SHARP, depth=0)).nodes == ()
    tree = grow(view, EXTREMES["huge"], replace(SHARP, most=0))
    assert tree.nodes == () and tree.left_out[MOST] > 0


def test_a_ball_is_within_its_outline_and_hidden_from_itself(rng):
    ball = CurvedMirror(0, np.array([0.3, 0.2, 0.8]), 0.7, 1.0)
    for orthographic in (False, True):
        view = camera(EYE, (0, 0, 1), orthographic=orthographic, lens=1.2 if not orthographic else 2.0)
        tree = grow(view, [ball, mirror((0, -5, 1), (0, 1, 0), 3)], SHARP)
        paths = paths_of(tree)
        assert (0, 0) not in paths and (0, 1) in paths and (0, 1, 0) in paths
        surface = ball.center + ball.radius * np.array([rotation(rng)[0] for _ in range(200)])
        clip = clip_of(view, surface)
        flat = (clip[:, :2] / clip[:, 3:] * 0.5 + 0.5) * (320, 240)
        (x, y, w, h) = paths[0,].window
        assert flat[:, 0].min() >= x and flat[:, 0].max() <= x + w and flat[:, 1].min() >= y and flat[:, 1].max() <= y + h
        env = approximate_view(ball, view, 64)
        assert np.linalg.det(env.world_from_camera[:3, :3]) == pytest.approx(1) and tree.nodes[0].drawn == (0, 0, tree.nodes[0].camera.width, tree.nodes[0].camera.height)
    within = replace(ball, center=np.array(EYE))
    assert outline_of(within, camera(EYE, (0, 0, 1))) is None
    assert grow(camera(EYE, (0, 0, 1)), [within], SHARP).nodes[0].share == 1


def test_cube_faces_lie_as_cube_maps_do():
    ball = CurvedMirror(0, np.array([0.3, 0.2, 0.8]), 0.7, 1.0)
    for index, view in enumerate(cube_views(ball, 16, 50.0)):
        assert np.linalg.det(view.world_from_camera[:3, :3]) == pytest.approx(1)
        face, s, t = cube_coordinates(view.primary_rays().direction.reshape(16, 16, 3))
        step = (np.arange(16) + 0.5) / 16 * 2 - 1
        assert np.all(face == index)
        np.testing.assert_allclose(s, np.broadcast_to(step, (16, 16)), atol=1e-6)
        np.testing.assert_allclose(t, np.broadcast_to(step[:, None], (16, 16)), atol=1e-6)


def test_maps_are_as_large_as_seen_and_do_not_pop():
    ball = CurvedMirror(0, np.array([0.0, 0.0, 0.0]), 0.5, 1.0)
    sides, tree = [], None
    for frame in range(60):
        distance = 6 + 0.05 * np.sin(frame)  # less than the step between sizes
        tree = grow(camera((0, -distance, 0), (0, 0, 0)), [ball], SHARP, before=tree)
        sides.append(tree.nodes[0].camera.width)
    assert len(set(sides[2:])) == 1
    near = grow(camera((0, -1.5, 0), (0, 0, 0)), [ball], SHARP, before=tree).nodes[0].camera.width
    far = grow(camera((0, -60, 0), (0, 0, 0)), [ball], SHARP, before=tree).nodes[0].camera.width
    assert far < sides[0] < near <= 256 and far >= LEAST
    fixed = grow(camera((0, -60, 0), (0, 0, 0)), [ball], replace(SHARP, culling=replace(Culling(), size=False)))
    assert fixed.nodes[0].camera.width == 256


def test_sizes_go_in_steps_with_hysteresis():
    steps = sorted({side_of(n, 1000) for n in range(1, 1200)})
    assert steps[0] == LEAST and steps[-1] == 1000 and all(b / a < STEP * 1.1 for a, b in zip(steps, steps[1:], strict=False))
    for needed in np.linspace(1, 1000, 333):
        assert needed <= side_of(needed, 1000) <= max(LEAST, STEP * 1.1 * needed)
    for low, high in zip(steps, steps[1:], strict=False):
        assert side_of(low * 1.001, 1000, high) == side_of(low * (KEEP + 0.01), 1000, high) == high
        assert side_of(low * (KEEP - 0.01), 1000, high) <= low and side_of(high + 1, 2000, low) > low
    assert side_of(50, 1000, 999) == side_of(50, 1000)  # no step: another picture's


def test_a_target_a_level_holds_all_its_views(rng):
    planes = scattered(rng, 8)
    tree = grow(camera((0, -2, 1), (0, 0, 0)), planes, SHARP)
    whole = tree.root.width, tree.root.height
    targets = targets_of(tree.nodes, whole)
    assert len(targets) == tree.levels
    for node in tree.nodes:
        assert all(n <= t <= w for n, t, w in zip(node.drawn[2:], targets[node.depth], whole, strict=True))
    assert targets_of(tree.nodes, whole, targets) == targets
    assert set(targets_of(tree.nodes, whole, by_area=False).values()) == {whole}


def test_a_finer_view_shows_what_a_coarse_one_does(monkeypatch):
    """Of a narrow lobe: mirrors in it have the same shares of the picture, in windows of its own pixels; deeper views are as their parent."""
    floor = replace(mirror((0, 3, 0), (0, 0, 1), 3.0), roughness=(0.05, 0.05))
    wall = replace(mirror((0, 6, 1.5), (0, -1, 0.1), 1.2, reflector=1), roughness=(0.05, 0.05))
    view, trees = camera((0, -2, 1.5), (0, 3, 0.3), size=(160, 120)), []
    for finest in (1, glossy_window.FINEST):
        monkeypatch.setattr(glossy_window, "FINEST", finest)
        trees.append(paths_of(grow(view, (floor, wall), TreeSettings(depth=3, least_energy=0.0))))
    coarse, fine = trees
    assert set(coarse) == set(fine) and (0, 1) in fine and fine[(0,)].finer > 1 and fine[(0, 1)].finer == 1
    for path, node in fine.items():
        times = fine[path[:1]].finer if len(path) > 1 else 1
        assert node.share == pytest.approx(coarse[path].share, rel=1e-6)
        np.testing.assert_allclose(np.array(node.window) / times, coarse[path].window, atol=2.0)
    assert fine[(0, 1)].camera.width == fine[(0,)].camera.width == fine[(0,)].finer * view.width
