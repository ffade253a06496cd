"""core/mirror_planes.py and mirror_outline.py: planar mirrors of any mesh, their sides and outlines; none in round things."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh
from analytic import rotation
from mesh_scenes import MATTE, MIRROR, smooth_mirror, snapshot
from mirror_views import camera, clip_of, mirror
from tolerances import CLIPPED_AREA, PLANE_FIT

from reflect_addon.core.curved_views import curved_of
from reflect_addon.core.mirror_outline import MOST_CORNERS, area, hull, seen_through, window_of
from reflect_addon.core.mirror_planes import planes_of
from reflect_addon.core.snapshot import Material

VARNISH = Material("varnish", roughness=0.3, is_reflector=True)


def quad(size=1.0):
    return trimesh.Trimesh(size * np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]), [[0, 1, 2], [0, 2, 3]])


def faces_of(planes):
    return sorted(tuple(np.round(p.normal, 6) + 0.0) for p in planes)


@pytest.mark.parametrize("size, away", [(1e-4, 0.0), (1.0, 30.0), (1e5, 0.0)])
def test_both_sides_of_a_pane_at_any_size(size, away, rng):
    turn = trimesh.transformations.random_rotation_matrix(rng.random(3))
    pane = quad(size).apply_transform(turn).apply_translation([away, -away, 2 * away])
    planes = planes_of(snapshot(pane))
    assert len(planes) == 2 and all(p.reflector == 0 and p.specular == pytest.approx(0.8) and p.grazing == 1 for p in planes)
    np.testing.assert_allclose(planes[0].normal, -planes[1].normal, atol=1e-12)
    np.testing.assert_allclose(np.abs(planes[0].normal @ turn[:3, 2]), 1, atol=PLANE_FIT)
    for plane in planes:
        np.testing.assert_allclose((plane.outline - plane.origin) @ plane.normal, 0, atol=PLANE_FIT * size)
        np.testing.assert_allclose(plane.origin, [away, -away, 2 * away], atol=PLANE_FIT * size)
        spokes = plane.outline - plane.origin
        assert np.all(np.cross(spokes, np.roll(spokes, -1, 0)) @ plane.normal > 0) and len(spokes) == 4
        np.testing.assert_allclose(np.linalg.norm(spokes, axis=1), np.sqrt(2) * size, rtol=PLANE_FIT)


def test_a_box_mirrors_outwards_and_inwards_where_something_is_within():
    box = trimesh.creation.box((2, 2, 2))
    outwards = faces_of(planes_of(snapshot(box)))
    assert outwards == sorted(tuple(sign * row) for sign in (1.0, -1.0) for row in np.eye(3) + 0.0)
    ball = trimesh.creation.icosphere(subdivisions=1, radius=0.2)
    assert len(planes_of(snapshot(box, Ball=ball))) == 12
    assert len(planes_of(replace(snapshot(box), camera=(0.1, 0.2, 0.3)))) == 12
    assert len(planes_of(snapshot(box, Ball=ball.copy().apply_translation((3, 0, 0))))) == 6


def test_turned_windings_are_one_side():
    box = trimesh.creation.box((2, 2, 2))
    box.faces[::3] = box.faces[::3, ::-1]
    assert len(planes_of(snapshot(box))) == 6


def test_round_things_have_none_but_their_caps():
    assert planes_of(snapshot(smooth_mirror(trimesh.creation.icosphere(subdivisions=3)))) == ()
    assert planes_of(snapshot(trimesh.creation.icosphere(subdivisions=3))) == ()
    assert planes_of(snapshot(smooth_mirror(trimesh.creation.box((1, 1, 1))))) == ()
    tube = trimesh.creation.cylinder(1, 2, sections=64)
    planes = planes_of(snapshot(tube))
    assert faces_of(planes) == [(0.0, 0.0, -1.0), (0.0, 0.0, 1.0)] and all(len(p.outline) <= MOST_CORNERS for p in planes)


def test_what_is_curved():
    """A tube with caps is curved and has two planar mirrors; a pane and a flat disc are not; a point has no ball."""
    tube, disc = trimesh.creation.cylinder(1, 2, sections=64), trimesh.creation.cylinder(1, 0.1, sections=64)
    ball = smooth_mirror(trimesh.creation.icosphere(subdivisions=2, radius=0.5)).apply_translation((3, 2, 1))
    for shape, curved in ((tube, True), (disc, False), (quad(), False), (ball, True)):
        scene = snapshot(shape)
        found = curved_of(scene, planes_of(scene))
        assert len(found) == curved
    assert found[0].ball == MIRROR and found[0].radius == pytest.approx(0.5) and found[0].specular == pytest.approx(0.8)
    np.testing.assert_allclose(found[0].center, (3, 2, 1), atol=1e-6)
    scene = snapshot(smooth_mirror(trimesh.Trimesh(np.zeros((3, 3)), [[0, 1, 2]], process=False)))
    assert curved_of(scene, ()) == ()


def test_what_is_a_ball():
    """Whole, round and smooth, of one material, whichever way it is turned; no cube has room in the ball, though its corners are on it."""
    coarse = trimesh.creation.uv_sphere(count=(10, 20))
    assert curved_of(snapshot(smooth_mirror(coarse)), ())[0].ball == MIRROR
    round_ = trimesh.creation.icosphere(subdivisions=3)
    half = trimesh.Trimesh(round_.vertices, round_.faces[round_.triangles_center[:, 2] > 0], process=True)
    long = round_.copy().apply_scale((1, 1, 1.1))
    pierced = smooth_mirror(trimesh.Trimesh(round_.vertices, round_.faces[200:]))
    two = smooth_mirror(round_.copy(), (MIRROR, MATTE))
    two.metadata["faces"] = np.arange(len(two.faces)) % 2
    for shape in (smooth_mirror(half), smooth_mirror(long), pierced, two, smooth_mirror(trimesh.creation.box((1, 1, 1))), round_):
        assert all(curved.ball is None for curved in curved_of(snapshot(shape), ()))


def test_only_faces_of_mirror_like_materials_and_one_mirror_for_all_of_a_plane():
    floor = trimesh.util.concatenate([quad().apply_translation((2.5 * i, 0, 0)) for i in range(4)])
    floor.metadata.update(material=(MIRROR, VARNISH, MATTE), faces=np.repeat([2, 0, 1, 2], 2))
    planes = planes_of(snapshot(floor))
    assert len(planes) == 2
    assert planes[0].specular == pytest.approx(0.8) and planes[0].roughness == (0.0, pytest.approx(0.3))
    assert planes[0].outline[:, 0].min() == pytest.approx(1.5) and planes[0].outline[:, 0].max() == pytest.approx(6)


def test_several_planes_in_one_object_and_what_is_too_small():
    small = quad(0.05).apply_translation((0, 0, 3))
    walls = trimesh.util.concatenate([quad(), quad().apply_transform(trimesh.transformations.rotation_matrix(np.pi / 2, (1, 0, 0), (0, 1, 0))), small])
    assert len(planes_of(snapshot(walls))) == 4


def test_a_window_pane_in_a_large_house_is_found():
    house = trimesh.util.concatenate([trimesh.creation.box((50, 50, 20)), quad(0.5).apply_translation((0, 0, 40))])
    house.metadata.update(material=(MATTE, MIRROR), faces=np.repeat([0, 1], [12, 2]))
    assert len(planes_of(snapshot(house))) == 2


def test_dull_things_only_when_marked_by_hand():
    scene = snapshot(smooth_mirror(quad(), MATTE))
    marked = replace(scene, instances=tuple(replace(i, is_reflector=True, mark="YES") for i in scene.instances))
    assert planes_of(scene) == () and len(planes_of(marked)) == 2 and planes_of(marked)[0].specular == pytest.approx(0.04)
    black = Material("black", specular_weight=0.0)
    scene = snapshot(smooth_mirror(quad(), black))
    assert planes_of(replace(scene, instances=tuple(replace(i, is_reflector=True, mark="YES") for i in scene.instances))) == ()


def test_a_mirroring_and_stretching_matrix_keeps_the_outside_out(rng):
    scene = snapshot(trimesh.creation.box((1, 2, 3)))
    stretch = np.diag([-3.0, 0.2, 1.0, 1.0])
    stretch[:3, :3] = rotation(rng) @ stretch[:3, :3]
    scene = replace(scene, instances=tuple(replace(i, world_from_object=stretch) for i in scene.instances))
    planes = planes_of(scene)
    assert len(planes) == 6 and all(p.origin @ p.normal > 0 for p in planes)


def test_impossible_meshes_have_none():
    flat = trimesh.Trimesh(np.zeros((3, 3)), [[0, 1, 2]], process=False)
    assert planes_of(snapshot(flat)) == ()
    scene = snapshot(quad())
    mesh = replace(scene.meshes[0], positions=np.full((4, 3), np.nan, np.float32))
    assert planes_of(replace(scene, meshes=(mesh,))) == ()


@pytest.mark.parametrize("count", [5, 500])
def test_the_hull_holds_all_points(count, rng):
    normal = rotation(rng)[0]
    plane = mirror((1, 2, 3), normal)
    points = plane.origin + rng.normal(size=(count, 2)) @ np.linalg.svd(normal[None])[2][1:]
    if count > 5:
        points = plane.origin + (points - plane.origin) / np.linalg.norm(points - plane.origin, axis=1, keepdims=True)
    corners = hull(points, normal)
    assert len(corners) <= MOST_CORNERS
    edges = np.roll(corners, -1, 0) - corners
    inside = np.einsum("kx,nkx->nk", np.cross(normal, edges), points[:, None] - corners[None])
    assert inside.min() > -1e-9
    if count > 5:
        assert np.linalg.norm(corners - plane.origin, axis=1).max() < 1.01 / np.cos(np.pi / MOST_CORNERS)


def test_what_is_seen_through_a_polygon_by_counting_points(rng):
    """Random mirrors, some through the eye's own plane: the share of a fine grid of pixels whose rays meet the mirror."""
    view = camera((0, 0, 0), (0, -1, 0.2), (64, 48), near=0.05)
    window = ((5.0, 3.0), (60.0, 8.0), (50.0, 44.0), (12.0, 40.0))
    x, y = np.meshgrid((np.arange(640) + 0.5) / 10, (np.arange(480) + 0.5) / 10)
    inside = np.ones_like(x, bool)
    for (ax, ay), (bx, by) in zip(window, window[1:] + window[:1], strict=True):
        inside &= (bx - ax) * (y - ay) - (by - ay) * (x - ax) >= 0
    ndc = np.stack([x / 32 - 1, y / 24 - 1, np.ones_like(x), np.ones_like(x)], -1)
    there = ndc @ np.linalg.inv(view.clip_from_world()).T
    ray = there[..., :3] / there[..., 3:]
    some = 0
    for _ in range(60):
        plane = mirror(rng.normal(size=3), rng.normal(size=3), rng.uniform(0.2, 2))
        t = (plane.origin @ plane.normal) / (ray @ plane.normal)
        hit = t[..., None] * ray
        depth = -(hit - view.world_from_camera[:3, 3]) @ view.world_from_camera[:3, 2]
        met = inside & (t > 0) & (depth > 0.05)
        for a, b in zip(plane.outline, np.roll(plane.outline, -1, 0), strict=True):
            met &= (hit - a) @ np.cross(plane.normal, b - a) >= 0
        found = seen_through(clip_of(view, plane.outline), 64, 48, window)
        assert area(found) == pytest.approx(met.mean() * 64 * 48, abs=CLIPPED_AREA)
        if found:
            left, below, wide, high = window_of(found, 64, 48)
            assert np.all(x[met] >= left) and np.all(x[met] <= left + wide) and np.all(y[met] >= below) and np.all(y[met] <= below + high)
            some += 1
    assert some > 15
