"""core/spaces.py, convention by convention: each test writes the rule down a second time, in numbers."""

import numpy as np
import pytest
import tolerances
from analytic import directions, hits, unit

from reflect_addon.core import cubemap, spaces
from reflect_addon.core.asset import Asset
from reflect_addon.core.billboard_fit import Quad
from reflect_addon.core.kernel import evaluate, record_function
from reflect_addon.core.rays import Rays

# face, s, t -> direction, from the sentence "s and t are the components (a + 1) % 3 and (a + 2) % 3".
CORNERS = {
    (0, 0.25, -0.5): (1, 0.25, -0.5),
    (1, 0.25, -0.5): (-1, 0.25, -0.5),
    (2, 0.25, -0.5): (-0.5, 1, 0.25),
    (3, 0.25, -0.5): (-0.5, -1, 0.25),
    (4, 0.25, -0.5): (0.25, -0.5, 1),
    (5, 0.25, -0.5): (0.25, -0.5, -1),
}


@pytest.mark.parametrize("where, direction", CORNERS.items())
def test_a_face_has_its_axis_and_no_mirroring(where, direction):
    assert spaces.cube_direction(*where).tolist() == list(direction)
    face, s, t = spaces.cube_coordinates(np.array(direction))
    assert (int(face), float(s), float(t)) == where
    assert spaces.FACE_NAMES[where[0]] == "+-"[where[0] % 2] + "XYZ"[where[0] // 2]


def test_faces_there_and_back(rng):
    face, s, t = rng.integers(0, 6, 10_000), *rng.uniform(-1, 1, (2, 10_000))
    back = spaces.cube_coordinates(spaces.cube_direction(face, s, t) * rng.uniform(0.1, 9, (10_000, 1)))
    assert np.array_equal(back[0], face)
    np.testing.assert_allclose(back[1:], (s, t), atol=1e-14)
    d = directions(rng, 10_000)
    np.testing.assert_allclose(unit(spaces.cube_direction(*spaces.cube_coordinates(d))), d, atol=1e-14)


def test_the_first_axis_wins_ties():
    ties = [[1, 1, 1], [-1, 1, 1], [0, -1, 1], [0, 1, -1], [1, 0, -1]]
    assert spaces.cube_coordinates(np.array(ties))[0].tolist() == [0, 1, 3, 2, 0]


def test_a_border_lies_past_the_edge_in_the_faces_own_plane():
    assert spaces.cube_direction(3, 1.5, -1.25).tolist() == [-1.25, -1, 1.5]


def test_the_kernel_knows_the_same_faces(rng):
    """The look-up's own arithmetic (floats and selects) against the argmax of NumPy."""
    d = np.concatenate([directions(rng, 20_000), [[1, 1, 1], [-1, 1, 1], [0, -1, 1], [0, 1, -1]]])
    program = record_function(lambda k, s, d: dict(zip("fst", cubemap.face_of(k, d), strict=True)), {"d": "vec3"})
    got = evaluate(program, {"d": d}, dtype=np.float64)
    face, s, t = spaces.cube_coordinates(d)
    assert np.array_equal(got["f"], face)
    np.testing.assert_allclose(got["s"], s, atol=1e-12)
    np.testing.assert_allclose(got["t"], t, atol=1e-12)


def test_texel_centres_lie_at_halves():
    """Sampling at (i + 0.5, j + 0.5) gives texel (i, j) alone; x runs along a row, rows follow y."""
    image = np.arange(24, dtype="f").reshape(2, 3, 4)
    program = record_function(lambda k, s, at: {"c": k.sample(s.images["i_tx"], at)}, {"at": "vec2"}, images=("i_tx",))
    got = evaluate(program, {"at": np.array([[0.5, 0.5], [2.5, 0.5], [1.5, 1.5], [1.0, 0.5]])}, Asset("a", "", {"i_tx": image}))["c"]
    assert np.array_equal(got[:3], [image[0, 0], image[0, 2], image[1, 1]])
    assert np.array_equal(got[3], (image[0, 0] + image[0, 1]) / 2)


def test_texel_centres_of_a_cube_face():
    """n texels over -1..1: the first centre at -1 + 1/n, borders one texel outside; faces side by side in order."""
    d = cubemap.texel_directions(4)
    assert d.shape == (6, 36, 3)
    np.testing.assert_allclose(d[1, 1] / d[1, 1, 0], [1, -0.75, -0.75])
    np.testing.assert_allclose(d[0, 0] / d[0, 0, 0], [1, -1.25, -1.25])
    np.testing.assert_allclose(d[1, 4] / d[1, 4, 0], [1, 0.75, -0.75], err_msg="x to the right is s")
    np.testing.assert_allclose(d[4, 1] / d[4, 1, 0], [1, -0.75, 0.75], err_msg="y up is t")
    for face in range(6):
        middle = d[2:4, face * 6 + 2 : face * 6 + 4].mean((0, 1))
        np.testing.assert_allclose(unit(middle), np.eye(3)[face // 2] * (1 - 2 * (face % 2)), atol=1e-12)


def test_row_0_is_the_bottom():
    """Of a cube map the lowest t, of a billboard the lowest v."""
    rays = cubemap.bundle(np.zeros(3), 4)
    image, _ = cubemap.assemble(np.zeros(3), 4, hits(rays, np.ones(len(rays)), lambda p: np.maximum(p, 0)))
    assert image[1, 2, 2] == 0 < image[4, 2, 2], "on +X t is z"
    quad = Quad("q", (0, 0, 0), (1, 0, 0), (0, 0, 1), (0, -1, 0), 2.0, 1.0, None, 0.1, 0.2, True)
    points = quad.points(8).reshape(*quad.size(8), 3)
    assert points.shape == (4, 8, 3)
    np.testing.assert_allclose(points[0, 0], [-1.75, 0, -0.75])
    np.testing.assert_allclose(points[3, 7], [1.75, 0, 0.75])


def test_far_is_above_any_scene_and_finite_in_float32(rng):
    assert spaces.FAR == 1e9
    far = np.float32(spaces.FAR)
    assert np.isfinite(far * far * np.float32(3))
    assert spaces.FAR > 1e4 * 1e3 * 10
    rays = Rays(np.zeros((3, 3), "f"), directions(rng, 3).astype("f"))
    sky = hits(rays, np.full(3, np.inf), lambda p: p)
    np.testing.assert_allclose(np.linalg.norm(sky.position, axis=1), spaces.FAR, rtol=tolerances.FLOAT32)


def test_statuses_are_told_apart_by_whole_numbers():
    assert (spaces.STATUS_NONE, spaces.STATUS_HIT, spaces.STATUS_FELL_BACK) == (0.0, 1.0, 2.0)
