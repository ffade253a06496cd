"""core/cubemap.py: where levels lie, that no seam shows, what the pyramid keeps, and which level a footprint reads."""

import numpy as np
import pytest
import tolerances
from analytic import directions, hits, smooth, unit

from reflect_addon.core import cubemap, spaces
from reflect_addon.core.asset import Asset
from reflect_addon.core.kernel import evaluate, record_function

RESOLUTIONS = [4, 8, 16, 32, 64, 256, 1024, 8192]


def cube_asset(n, paint=smooth, distance=2.0, center=(0.0, 0.0, 0.0)) -> Asset:
    rays = cubemap.bundle(np.array(center), n)
    distance = np.broadcast_to(distance, (len(rays),))
    image, uniforms = cubemap.assemble(np.array(center), n, hits(rays, distance, lambda p: paint(p - center)))
    return Asset("cube", "", {"radiance_tx": image}, uniforms | {"center": tuple(center)})


def look(asset, direction, angle=0.0):
    """(radiance (N, 3), distance (N,)) by the kernel, float64."""

    def kernel(k, scope, d, a):
        radiance, distance = cubemap.look_up(k, scope, d, a)
        return {"radiance": radiance, "distance": distance}

    program = record_function(kernel, {"d": "vec3", "a": "float"}, asset.images, asset.uniforms)
    given = {"d": direction, "a": np.broadcast_to(angle, (len(direction),))}
    got = evaluate(program, given, asset, dtype=np.float64)
    return got["radiance"], got["distance"]


def texel_angle(n, level=0) -> float:
    """The angle that a footprint must have to read exactly this level."""
    return 2.0 / n * 2**level


@pytest.mark.parametrize("n", RESOLUTIONS)
def test_levels_lie_inside_the_image_and_on_no_other(n):
    height, width = cubemap.image_size(n)
    boxes = []
    for level in range(cubemap.level_count(n)):
        x, y = cubemap.level_origin(n, level)
        side = (n >> level) + 2
        boxes.append((x, y, x + 6 * side, y + side))
    assert (n >> (len(boxes) - 1)) == cubemap.COARSEST
    for i, (x0, y0, x1, y1) in enumerate(boxes):
        assert 0 <= x0 < x1 <= width and 0 <= y0 < y1 <= height
        for a0, b0, a1, b1 in boxes[:i]:
            assert x1 <= a0 or a1 <= x0 or y1 <= b0 or b1 <= y0
    assert max(b[3] for b in boxes) == height, "no empty rows on top"


@pytest.mark.parametrize("n", [0, 2, 3, 12, -8])
def test_other_resolutions_are_refused(n):
    with pytest.raises(ValueError, match="power of two"):
        cubemap.check_resolution(n)


@pytest.mark.parametrize("level", range(4))
def test_every_level_is_read_where_it_was_written(rng, level):
    """A map whose faces have a number each; the kernel must find it through its closed-form offsets, up to the edge."""
    n = 32
    asset = cube_asset(n, lambda p: np.repeat(1.0 + spaces.cube_coordinates(p)[0][:, None], 3, 1))
    face, s, t = rng.integers(0, 6, 3000), *rng.uniform(-1, 1, (2, 3000)) * (1 - 1 / (n >> level))
    radiance, _ = look(asset, spaces.cube_direction(face, s, t), texel_angle(n, level))
    np.testing.assert_allclose(radiance[:, 0], 1 + face, rtol=1e-6)


def edges(rng, count):
    """(count, 3) directions on the cube's edges, its corners among them, and (count, 3) steps across each edge."""
    axis, sign = rng.integers(0, 3, count), rng.choice([-1.0, 1.0], (count, 3))
    on, across = sign.copy(), np.zeros((count, 3))
    rows = np.arange(count)
    on[rows, axis] = rng.uniform(-1, 1, count)
    on[:8, :] = np.sign(on[:8, :])
    across[rows, (axis + 1) % 3], across[rows, (axis + 2) % 3] = sign[rows, (axis + 1) % 3], -sign[rows, (axis + 2) % 3]
    return on, across


@pytest.mark.parametrize("n", [32, 256])
@pytest.mark.parametrize("level", range(4))
def test_no_seam_shows_at_edges_and_corners(rng, level, n):
    """Both sides of each edge: what they differ by is the filter's own error there (second order in a texel), no more."""
    asset = cube_asset(n)
    on, across = edges(rng, 4000)
    sides = [look(asset, on + e * across, texel_angle(n, level))[0] for e in (1e-7, -1e-7)]
    h = texel_angle(n, level)
    assert np.abs(sides[0] - sides[1]).max() <= tolerances.CUBE_SEAM * h * h + tolerances.HALF * 4
    faces = [spaces.cube_coordinates(on + e * across)[0] for e in (1e-7, -1e-7)]
    assert np.mean(faces[0] != faces[1]) == 1.0, "the two looks are into two faces"


@pytest.mark.parametrize("level", range(4))
def test_a_smooth_world_is_what_it_was(rng, level):
    """Against the function itself, at every level: bilinear look-ups and 2x2 means of a smooth function err by h^2."""
    n = 32
    d = directions(rng, 20_000)
    radiance, distance = look(cube_asset(n), d, texel_angle(n, level))
    h = texel_angle(n, level)
    assert np.abs(radiance - smooth(d)).max() <= tolerances.CUBE_SMOOTH * h * h + tolerances.HALF * 4
    np.testing.assert_allclose(distance, 2.0, rtol=tolerances.HALF)


def test_coarser_texels_are_means(rng):
    n = 16
    asset = cube_asset(n, lambda p: rng.uniform(0, 1, p.shape))
    image = asset.images["radiance_tx"].astype(np.float64)
    fine = image[1 : n + 1, :, :3].reshape(n, -1, 3)
    for level in (1, 2):
        x, y = cubemap.level_origin(n, level)
        m = n >> level
        for face in range(6):
            inside = fine[:, face * (n + 2) + 1 : face * (n + 2) + 1 + n]
            want = inside.reshape(m, 1 << level, m, 1 << level, 3).mean((1, 3))
            got = image[y + 1 : y + 1 + m, x + face * (m + 2) + 1 : x + face * (m + 2) + 1 + m, :3]
            np.testing.assert_allclose(got, want, rtol=2 * tolerances.HALF)


def test_a_sun_of_a_hundred_thousand_survives():
    """Peaks above half floats' end keep their value, and the dim sky beside them keeps its own."""
    sun = unit([0.3, -0.5, 0.8])

    def paint(p):
        return np.where((unit(p) @ sun > 0.98)[:, None], [1e5, 9e4, 8e4], [0.02, 0.03, 0.05])

    asset = cube_asset(64, paint)
    assert np.isfinite(asset.images["radiance_tx"]).all()
    radiance, _ = look(asset, np.array([sun, -sun]))
    np.testing.assert_allclose(radiance, [[1e5, 9e4, 8e4], [0.02, 0.03, 0.05]], rtol=tolerances.HALF)
    coarse, _ = look(asset, np.array([sun]), 10.0)
    assert 1e3 < coarse[0, 0] < 1e5, "the pyramid spreads it out"


def test_sky_and_surface_are_told_apart():
    """No hit is FAR, exactly; a distance is never mixed from the two beside an edge between them."""
    n = 16
    up = cubemap.texel_directions(n).reshape(-1, 3)[:, 2] > 0
    asset = cube_asset(n, distance=np.where(up, np.inf, 3.0))
    d = directions(np.random.default_rng(1), 5000)
    _, distance = look(asset, d)
    near_edge = np.abs(d[:, 2]) < texel_angle(n)
    assert np.all(distance[(d[:, 2] > 0) & ~near_edge] == spaces.FAR)
    np.testing.assert_allclose(distance[(d[:, 2] < 0) & ~near_edge], 3.0, rtol=tolerances.HALF)
    assert set(np.round(distance[near_edge], 2)) <= {3.0, spaces.FAR}


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e4])
def test_near_things_under_a_far_horizon_keep_their_distance(scale):
    """A tabletop before a landscape: eight decades in one map, none of it taken for the sky."""
    n = 16
    distance = np.geomspace(1e-4, 1e4, 6 * (n + 2) ** 2) * scale
    d = cubemap.texel_directions(n)[1:-1, 1 : n + 1].reshape(-1, 3)
    wanted = distance.reshape(n + 2, -1)[1:-1, 1 : n + 1].ravel()
    np.testing.assert_allclose(look(cube_asset(n, distance=distance), d)[1], wanted, rtol=tolerances.HALF)


def test_surface_points_are_where_the_rays_ended(rng):
    n, center = 16, np.array([3.0, -2.0, 1.0])
    along = cubemap.texel_directions(n).reshape(-1, 3)
    asset = cube_asset(n, distance=np.where(along[:, 0] > 0.9, np.inf, 1 + along[:, 2] ** 2), center=tuple(center))
    points, weight = cubemap.surface_points(asset.images["radiance_tx"], asset.uniforms)
    d = unit(points - center)
    np.testing.assert_allclose(np.linalg.norm(points - center, axis=1), 1 + d[:, 2] ** 2, rtol=2 * tolerances.HALF)
    # The cap x > 0.9 of the sphere is missing: 2 pi (1 - 0.9) of 4 pi, to a ring of half a texel.
    assert weight.sum() == pytest.approx(4 * np.pi - 0.2 * np.pi, abs=2 * np.pi * 0.44 * texel_angle(n) / 2)


def test_the_footprint_picks_the_level():
    """Each level holds its own number: a footprint as wide as a level's texel reads it, between two it is blended."""
    n = 64
    asset = cube_asset(n)
    for level in range(5):
        x, y = cubemap.level_origin(n, level)
        side = (n >> level) + 2
        asset.images["radiance_tx"][y : y + side, x : x + 6 * side, :3] = level + 1
    d = np.tile(unit([[0.2, 0.9, -0.4]]), (9, 1))
    levels = np.array([-3, 0, 0.25, 1, 1.5, 2, 3.75, 4, 9])
    radiance, _ = look(asset, d, 2.0 / n * np.exp2(levels))
    np.testing.assert_allclose(radiance[:, 0], 1 + levels.clip(0, 4), atol=1e-5)


def test_a_null_direction_and_huge_ones_are_finite():
    asset = cube_asset(8)
    d = np.array([[0.0, 0, 0], [1e-25, 0, 0], [0, 1e9, 0], [3e8, -1e9, 1e9], [-0.0, -0.0, -1e-12]])
    for angle in (0.0, 1.0, 1e9):
        radiance, distance = look(asset, d, angle)
        assert np.isfinite(radiance).all() and np.isfinite(distance).all()
