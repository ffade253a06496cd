"""core/mirror_series.py: which pictures a ray goes on through beyond the last level, how many passes that makes at most, and where a picture has a place."""

import numpy as np
import pytest
from mirror_views import camera, mirror, pixels

from reflect_addon.core.mirror_planes import MirrorPlane
from reflect_addon.core.mirror_series import PICTURES, ROWS, branch, continued, rows_of
from reflect_addon.core.reflection_tree import ROOT, TreeSettings
from reflect_addon.core.tree_growth import grow

FACING = (mirror((0, 2, 0), (0, -1, 0), 1.5), mirror((0, -2, 0), (0, 1, 0), 1.5))
EYE = camera((0.3, -1.0, 0.2), (0.0, 2.0, 0.0))


def grown(planes, depth):
    return grow(EYE, planes, TreeSettings(depth=depth, most=4000, least_pixels=1e-9, least_energy=0.0))


@pytest.mark.parametrize("depth", [1, 2, 3, 6])
def test_the_last_level_goes_on_from_two_views_on(depth):
    """At depth 1 the other mirror was not looked through yet."""
    tree = grown(FACING, depth)
    last = max(range(len(tree.nodes)), key=lambda i: tree.nodes[i].depth)
    found = branch(tree, last, FACING)
    assert next(iter(found.values())) == last and len(found) == min(depth, 2)
    ended = continued(tree, last, found)
    assert [one.mirror for one in ended] == ([] if depth == 1 else [1 - tree.nodes[last].mirror])
    for mirror_index, node in found.items():
        assert tree.nodes[node].mirror == mirror_index


def test_each_picture_is_the_nearest_of_its_mirror():
    tree = grown(FACING, 6)
    for node in range(len(tree.nodes)):
        way, at = [], node
        while at != ROOT:
            way.append(at)
            at = tree.nodes[at].parent
        for of, found in branch(tree, node, FACING).items():
            assert found == next(i for i in way if tree.nodes[i].mirror == of)
    assert branch(tree, ROOT, FACING) == {}


def test_rough_mirrors_have_no_part():
    rough = MirrorPlane(**{**vars(FACING[0]), "roughness": (0.0, 0.1)})
    tree = grown((rough, FACING[1]), 4)
    assert all(0 not in branch(tree, node, (rough, FACING[1])) for node in range(len(tree.nodes)))


@pytest.mark.parametrize("depth", [2, 3, 5])
def test_passes_are_bounded_by_views(depth):
    """However many mirrors there are: a view shows no more than PICTURES - 1 of its branch's others. Here a ring of eight."""
    places = [np.array([3 * np.cos(turn), 3 * np.sin(turn), 0.0]) for turn in np.arange(8) * np.pi / 4]
    planes = tuple(mirror(place, -place, 1.1) for place in places)
    tree = grow(EYE, planes, TreeSettings(depth=depth, most=200, least_pixels=1e-9, least_energy=0.0))
    passes = [len(continued(tree, node, branch(tree, node, planes))) for node in range(len(tree.nodes))]
    assert len(tree.nodes) > 10 and 0 < max(passes) <= PICTURES - 1


def test_rows_place_what_the_camera_places(rng):
    """Pixels, depth and eye are the picture's, for a mirrored view as for any camera."""
    tree = grown(FACING, 3)
    for node in tree.nodes:
        seen, plane = node.camera, FACING[node.mirror]
        rows = dict(zip(ROWS, rows_of(seen, plane, node.drawn, 0.01).astype(float), strict=True))
        points = plane.origin + plane.normal * rng.uniform(0.5, 3.0, (20, 1)) + rng.uniform(-0.5, 0.5, (20, 3))
        around = np.column_stack([points - rows["eye"][:3], np.ones(len(points))])
        x, y, w = (around @ rows[name] for name in ("row_x", "row_y", "row_w"))
        np.testing.assert_allclose(np.column_stack([x, y]) / w[:, None], pixels(seen, points), atol=0.01)
        np.testing.assert_allclose(w, (points - rows["eye"][:3]) @ rows["forward"][:3], rtol=1e-5)
        assert rows["plane_origin"][3] == pytest.approx(0.01) and tuple(rows["plane_normal"][:3]) == pytest.approx(tuple(plane.normal))
