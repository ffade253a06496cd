"""core/billboard_fit.py: which objects are flat, where their quads lie, and what the cameras of volumes see."""

import numpy as np
import pytest
import tolerances
import trimesh
from analytic import directions, rotation, unit
from mesh_scenes import first_hits, snapshot, world_mesh

from reflect_addon.core.billboard_fit import FIELD_OF_VIEW, Quad, flat_quads, volume_quad
from reflect_addon.core.flat_parts import contains

BALL = trimesh.creation.icosphere(3, 0.3)


def turned(shape: trimesh.Trimesh, rng, away=3.0) -> tuple[trimesh.Trimesh, np.ndarray, np.ndarray]:
    """(the shape turned any way at a random place, its axes as rows, its place)."""
    axes, place = rotation(rng), rng.normal(size=3) * away
    return trimesh.Trimesh(shape.vertices @ axes + place, shape.faces, process=False), axes, place


def rectangle(width, height) -> trimesh.Trimesh:
    corners = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]) * [width / 2, height / 2, 0]
    return trimesh.Trimesh(corners, [[0, 1, 2], [0, 2, 3]], process=False)


def quads_of(shape: trimesh.Trimesh):
    scene = snapshot(BALL, Thing=shape)
    return flat_quads(scene, scene.instances[1])


def corners_of(quad: Quad) -> np.ndarray:
    """(4, 3) float64."""
    u, v = np.asarray(quad.u) * quad.half_u, np.asarray(quad.v) * quad.half_v
    return np.asarray(quad.center) + [-u - v, u - v, u + v, -u + v]


def check_frame(quad: Quad):
    np.testing.assert_allclose([quad.u, quad.v, quad.normal], unit([quad.u, quad.v, quad.normal]), atol=1e-9)
    np.testing.assert_allclose(np.cross(quad.u, quad.v), quad.normal, atol=1e-9)
    assert quad.half_u > 0 and quad.half_v > 0


def same_corners(quad: Quad, wanted: np.ndarray, precise: float):
    """The same rectangle, whichever corner comes first."""
    gaps = np.linalg.norm(corners_of(quad)[:, None] - wanted[None], axis=-1)
    assert gaps.min(1).max() <= precise and gaps.min(0).max() <= precise


@pytest.mark.parametrize("width, height", [(2, 1), (1, 1), (7, 0.1), (3, 2.9)])
def test_a_tilted_picture_is_its_own_rectangle(rng, width, height):
    """To rounding: a quad that is larger has an edge of nothing, and every ray on it pays for a contour."""
    for _ in range(5):
        shape, axes, place = turned(rectangle(width, height), rng)
        quads, whole = quads_of(shape)
        assert whole and len(quads) == 2, "it is seen from both sides"
        for quad, sign in zip(quads, np.sign([q.normal @ axes[2] for q in quads]), strict=True):
            check_frame(quad)
            np.testing.assert_allclose(quad.normal, axes[2] * sign, atol=tolerances.QUAD_TURN)
            same_corners(quad, shape.vertices, tolerances.QUAD_TURN * max(width, height))
            assert quad.shared and quad.eye is None
        assert np.dot(quads[0].normal, quads[1].normal) == pytest.approx(-1)


def test_a_thin_slab_has_a_quad_on_each_face(rng):
    """1 % as thick as wide: not in its middle, where its own front face would hide it."""
    shape, axes, place = turned(trimesh.creation.box((2, 1, 0.01)), rng)
    quads, whole = quads_of(shape)
    assert whole and len(quads) == 2
    for quad in quads:
        height = (np.asarray(quad.center) - place) @ quad.normal
        assert height == pytest.approx(0.005, abs=1e-5)
        assert quad.reach > quad.above + 0.01, "rays of the capture pass through the slab"


def test_the_capture_of_a_slab_reaches_all_of_it(rng):
    shape, _, _ = turned(trimesh.creation.box((2, 1, 0.01)), rng)
    for quad in quads_of(shape)[0]:
        rays = quad.rays(16)
        distance = first_hits(shape, rays.origin, rays.direction)[1]
        assert np.all(distance <= quad.reach) and np.all(distance > 0)
        np.testing.assert_allclose(distance, quad.above, atol=1e-5)


def test_a_closed_box_shows_its_six_outsides_only(rng):
    shape, axes, place = turned(trimesh.creation.box((2, 1, 0.5)), rng)
    quads, whole = quads_of(shape)
    assert whole and len(quads) == 6
    for quad in quads:
        check_frame(quad)
        assert (np.asarray(quad.center) - place) @ quad.normal > 0.2, "outwards"


@pytest.mark.parametrize("winding", [1, -1])
def test_a_room_is_seen_from_inside(rng, winding):
    """Whichever way its faces are wound: from inside six inner sides, from outside six outer ones."""
    shape, axes, place = turned(trimesh.creation.box((2, 1, 0.5)), rng)
    shape = trimesh.Trimesh(shape.vertices, shape.faces[:, ::winding], process=False)
    scene = snapshot(BALL, Thing=shape)
    thing = scene.instances[1]
    for quads, side in ((flat_quads(scene, thing)[0], 1), (flat_quads(scene, thing, inside=True)[0], -1)):
        assert len(quads) == 6
        assert all((np.asarray(q.center) - place) @ q.normal * side > 0.2 for q in quads)
    assert contains(scene, thing, place)
    assert not contains(scene, thing, place + axes[0] * 1.01) and not contains(scene, thing, place + axes[1] * 0.51)


def test_what_is_inside_a_mesh(rng):
    """Against trimesh's ray parity; inside the bounding box is not inside, between two shells is not in the room."""
    torus, axes, place = turned(trimesh.creation.torus(1, 0.3), rng)
    scene = snapshot(BALL, Thing=torus)
    points = place + rng.uniform(-1.3, 1.3, (200, 3)) @ axes
    wanted = torus.contains(points)
    assert [contains(scene, scene.instances[1], p) for p in points] == wanted.tolist() and 10 < wanted.sum() < 190
    inner = trimesh.creation.box((2, 2, 2))
    walls = trimesh.util.concatenate([trimesh.creation.box((2.2, 2.2, 2.2)), trimesh.Trimesh(inner.vertices, inner.faces[:, ::-1])])
    scene = snapshot(BALL, Thing=walls)
    assert not contains(scene, scene.instances[1], np.zeros(3)) and contains(scene, scene.instances[1], np.array([1.05, 0, 0]))
    lidless = trimesh.Trimesh(inner.vertices, inner.faces[2:], process=False)
    scene = snapshot(BALL, Thing=lidless)
    assert not contains(scene, scene.instances[1], np.array([0.1, 0.2, 0.3]))


def test_an_open_box_is_seen_from_both_sides(rng):
    shape = trimesh.creation.box((2, 1, 0.5))
    lidless, axes, _ = turned(trimesh.Trimesh(shape.vertices, shape.faces[np.abs(shape.face_normals[:, 2] - 1) > 0.1]), rng)
    quads, whole = quads_of(lidless)
    assert whole and len(quads) == 10


def test_round_and_rugged_things_are_not_flat(rng):
    noise = trimesh.creation.icosphere(3)
    noise.vertices *= rng.uniform(0.8, 1.2, (len(noise.vertices), 1))
    for shape in (trimesh.creation.icosphere(4), trimesh.creation.torus(1, 0.3), noise, trimesh.creation.cone(0.5, 1, sections=256)):
        quads, whole = quads_of(shape)
        assert not whole


def test_flat_parts_of_a_thing_that_is_mostly_round():
    """A can: lids, but not the whole."""
    quads, whole = quads_of(trimesh.creation.cylinder(1.0, 0.5, sections=128))
    assert not whole and len(quads) == 2
    assert sorted(round(q.normal[2]) for q in quads) == [-1, 1]


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e4])
def test_volumes_stand_through_their_centroid_facing_the_mirror(rng, scale):
    for shape in (trimesh.creation.icosphere(3), trimesh.creation.torus(1, 0.3), trimesh.creation.box((1, 0.2, 3))):
        shape, _, _ = turned(shape, rng)
        shape.apply_scale(scale)
        scene = snapshot(BALL, Thing=shape)
        vertices = world_mesh(scene, scene.instances[1]).vertices
        centroid, mirror = vertices.min(0) / 2 + vertices.max(0) / 2, rng.normal(size=3) * scale
        quad = volume_quad(scene, scene.instances[1], mirror)
        check_frame(quad)
        np.testing.assert_allclose(quad.normal, unit(mirror - centroid), atol=1e-9, err_msg="perpendicular")
        assert abs((np.asarray(quad.center) - centroid) @ quad.normal) < 1e-9 * scale, "through the centroid"
        assert not quad.shared
        # The camera: on the line, towards the mirror, and the whole thing within 10 degrees of view.
        eye = np.asarray(quad.eye)
        np.testing.assert_allclose(unit(eye - centroid), quad.normal, atol=1e-9)
        seen = unit(vertices - eye) @ -np.asarray(quad.normal)
        assert np.all(seen >= np.cos(FIELD_OF_VIEW / 2) - 1e-9) and np.degrees(FIELD_OF_VIEW) == pytest.approx(10)
        # The quad is the outline: every vertex projects into it, and it is no larger than it must be.
        toward = vertices - eye
        t = ((centroid - eye) @ quad.normal) / (toward @ quad.normal)
        local = (eye + toward * t[:, None] - quad.center) @ np.array([quad.u, quad.v]).T
        half = np.array([quad.half_u, quad.half_v])
        np.testing.assert_allclose(np.abs(local).max(0), half, rtol=1e-6)
        np.testing.assert_allclose(local.min(0), -half, rtol=1e-6)


def test_a_volume_around_the_mirrors_own_centre_still_gets_a_quad(rng):
    scene = snapshot(BALL, Thing=trimesh.creation.torus(1, 0.1))
    check_frame(volume_quad(scene, scene.instances[1], np.zeros(3)))


def test_needles_have_an_area(rng):
    """A wire as a line of points, as a thin rod, and end on."""
    d = directions(rng, 40)[-1]
    line = trimesh.Trimesh(np.linspace(-1, 1, 9)[:, None] * d, [[0, 4, 8], [1, 3, 7]], process=False)
    quads, whole = quads_of(line)
    # Which of the two triangles has no area at all, and so no quad, is the processor's rounding.
    assert whole and quads and all(min(q.half_u, q.half_v) >= 0.99e-4 * max(q.half_u, q.half_v) for q in quads)
    assert all(max(q.half_u, q.half_v) > 0.7 for q in quads)
    rod, axes, place = turned(trimesh.creation.cylinder(1e-5, 2.0, sections=8), rng)
    scene = snapshot(BALL, Thing=rod)
    for mirror in (place + axes[0], place + 5 * axes[2]):
        quad = volume_quad(scene, scene.instances[1], mirror)
        check_frame(quad)
        assert min(quad.half_u, quad.half_v) >= 0.99e-4 * max(quad.half_u, quad.half_v)


def test_empty_and_collapsed_meshes(rng):
    """No triangles: nothing, and nothing is left out. All in one point, or in degenerate triangles: no crash."""
    empty = trimesh.Trimesh(np.zeros((3, 3)), np.zeros((0, 3), int), process=False)
    assert quads_of(empty) == ([], True)
    point = trimesh.Trimesh(np.ones((3, 3)), [[0, 1, 2]], process=False)
    quads_of(point)
    ball = trimesh.creation.icosphere(1)
    spoilt = trimesh.Trimesh(ball.vertices, np.concatenate([ball.faces, [[0, 0, 1]] * 9]), process=False)
    assert not quads_of(spoilt)[1]


def test_texels_are_powers_of_two_and_nearly_square():
    for ratio in (1.0, 0.7, 0.3, 1e-4):
        quad = Quad("q", (0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), 2.0, 2.0 * ratio, None, 0.1, 0.2, True)
        h, w = quad.size(128)
        assert w == 128 and 4 <= h <= 128 and h & (h - 1) == 0
        if ratio >= 0.3:
            assert 0.5 < (quad.half_v / h) / (quad.half_u / w) < 2
    for texels, side in ((100, 64), (6, 4), (1, 4), (128, 128)):
        assert Quad("q", (0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), 2.0, 2.0, None, 0.1, 0.2, True).size(texels) == (side, side)


@pytest.mark.parametrize("sides, quads", [(4, 6), (6, 8), (12, 0), (24, 0), (48, 0)])
def test_a_tube_is_round_and_a_prism_is_not(sides, quads):
    """From nine sides on facets stand for a round surface: the tube is one quad that faces the mirror."""
    tube = trimesh.creation.cylinder(radius=0.1, height=1.0, sections=sides)
    found, complete = quads_of(tube)
    assert complete == bool(quads) and sum(abs(q.normal[2]) < 0.5 for q in found) == max(quads - 2, 0)


def test_a_bevelled_box_keeps_its_faces():
    """Its narrow rims meet the faces at small angles, but are no neighbours of their size."""
    box = trimesh.creation.box((1, 1, 1))
    corners = np.concatenate([box.vertices * scale for scale in ((1, 0.94, 0.94), (0.94, 1, 0.94), (0.94, 0.94, 1), (0.97,) * 3)])
    found, _ = quads_of(trimesh.convex.convex_hull(corners))
    assert len(found) == 6


def test_texels_that_nobody_can_tell_apart_are_left_out():
    quad = Quad("a", (10.0, 0, 0), (0, 1.0, 0), (0, 0, 1.0), (-1.0, 0, 0), 0.1, 0.05, (9.0, 0, 0), 0, 1, False)
    near, far = (np.full(3, -1.0), np.full(3, 1.0)), (np.full(3, -1.0), np.full(3, 1.0) - 1000 * np.eye(3)[0])
    assert quad.enough(128, near) == 8 and quad.enough(128, (near[0], near[1] * 9.5)) == 128
    assert quad.enough(128, (near[0], near[1] * 9)) == 64 and quad.enough(4, near) == 4
    assert quad.enough(128, far) == 8
