"""methods/billboards.py: the kernel's nearest quad against Embree, contours, sides, levels, and what a bake stands up."""

import numpy as np
import pytest
import tolerances
import trimesh
from analytic import directions, rotation, unit
from mesh_scenes import first_hits, job, snapshot

from reflect_addon.core import spaces
from reflect_addon.core.asset import Asset
from reflect_addon.core.billboard_atlas import pack, table_rows
from reflect_addon.core.billboard_fit import Quad
from reflect_addon.core.kernel import Counts, emit_glsl, record, run_numpy
from reflect_addon.core.methods import billboards
from reflect_addon.core.rays import Rays

SKY = {"cube_size": 4.0, "cube_coarsest": 0.0, "radiance_scale": 1.0, "distance_scale": 1.0}


def quad_at(center, axes, half_u, half_v, name="q") -> Quad:
    u, v, n = axes
    return Quad(name, tuple(center), tuple(u), tuple(v), tuple(n), half_u, half_v, None, 0.1, 0.2, True)


def asset_of(quads, images, center=(0.0, 0.0, 0.0)) -> Asset:
    """Quads over a black sky; row i of the images is painted by the caller."""
    atlas, placed = pack(images)
    opaque = [bool(image[..., 3].min() == 1) for image in images]
    return Asset(
        "billboards", "",
        {
            "radiance_tx": np.zeros((6, 36, 4), np.float16),
            "billboard_tx": atlas.astype(np.float16),
            "billboard_buf": table_rows(quads, placed, opaque, center),
        },
        {**SKY, "center": center, "billboard_scale": 1.0},
        {"count": len(quads), "mirrors": 0, "glossy": 0, "lamps": 0, "contours": not all(opaque), "ground": False},
    )  # fmt: skip


def plain(colour=(1.0, 1.0, 1.0), size=8) -> np.ndarray:
    return np.broadcast_to(np.array([*colour, 1.0], "f"), (size, size, 4)).copy()


def answer(asset, rays, width=0.0, spread=0.0, counts=None):
    return run_numpy(record(billboards.trace, asset), asset, rays, width, spread, counts=counts)


def as_mesh(quads) -> trimesh.Trimesh:
    """Two triangles a quad, in order."""
    corners, faces = [], []
    for q in quads:
        u, v = np.asarray(q.u) * q.half_u, np.asarray(q.v) * q.half_v
        faces += [[len(corners) + k for k in three] for three in ((0, 1, 2), (0, 2, 3))]
        corners += [np.asarray(q.center) + step for step in (-u - v, u - v, u + v, -u + v)]
    return trimesh.Trimesh(np.array(corners), faces, process=False)


def nearest_facing(quads, rays):
    """((N,) index of the quad met first from its front, -1 = none; (N,) distance; (N,) distance of the last back it
    passed through) by Embree, which starts again just after each back and cannot see what lies within that step."""
    mesh, normals = as_mesh(quads), np.array([q.normal for q in quads])
    origin, d = rays.origin.astype(np.float64), rays.direction.astype(np.float64)
    size = np.ptp(mesh.bounds, axis=0).max()
    travelled, index, passed = np.zeros(len(d)), np.full(len(d), -1), np.full(len(d), np.inf)
    going = np.arange(len(d))
    for _ in range(100):
        start = origin[going] + d[going] * travelled[going, None]
        triangle, t = first_hits(mesh, start, d[going])
        met = triangle >= 0
        front = met & ((normals[triangle // 2] * d[going]).sum(1) < 0)
        passed[going[met & ~front]] = (travelled[going] + t)[met & ~front]
        index[going[front]] = triangle[front] // 2
        travelled[going] += np.where(front, t, np.maximum(t, 0) + 1e-5 * size)
        going = going[met & ~front]
    assert len(going) < 5
    return index, np.where(index >= 0, travelled, np.inf), passed


def margin(quads, rays, index):
    """(N,) how far inside (or outside, negative) each ray meets its quad, in half extents; -inf for index -1."""
    q = [np.array([getattr(x, f) for x in quads])[index] for f in ("center", "u", "v", "normal", "half_u", "half_v")]
    center, u, v, normal, half_u, half_v = q
    o, d = rays.origin.astype(np.float64), rays.direction.astype(np.float64)
    t = ((center - o) * normal).sum(1) / (d * normal).sum(1)
    p = o + d * t[:, None] - center
    inside = 1 - np.maximum(np.abs((p * u).sum(1)) / half_u, np.abs((p * v).sum(1)) / half_v)
    return np.where(index >= 0, inside, -np.inf)


@pytest.mark.parametrize("scale, away", [(1.0, 0.0), (1e-3, 0.0), (1e4, 0.0), (1.0, 100.0)])
def test_the_nearest_quad_is_embrees(rng, scale, away):
    """10^5 rays and 300 quads that cut each other; those told apart are within rounding of an edge or of two quads."""
    shift = away * scale * unit(rng.normal(size=3))
    center = tuple(float(x) for x in shift.astype("f"))
    quads = [
        quad_at(rng.uniform(-1, 1, 3) * scale + shift, rotation(rng), *(rng.uniform(0.02, 0.3, 2) * scale)) for _ in range(300)
    ]
    images = [plain((i + 1, 0, 0), 4) for i in range(300)]
    count = 100_000 if scale == 1.0 and not away else 20_000
    origin = rng.uniform(-1.2, 1.2, (count, 3)) * scale + shift
    rays = Rays(origin.astype("f"), rng.permutation(directions(rng, count)).astype("f"))
    found = answer(asset_of(quads, images, center), rays)
    index, distance, passed = nearest_facing(quads, rays)
    got = np.where(found.status == spaces.STATUS_HIT, np.round(found.radiance[:, 0]).astype(int) - 1, -1)
    assert np.array_equal(np.unique(found.status), [spaces.STATUS_HIT, spaces.STATUS_FELL_BACK])
    assert 0.2 < np.mean(index >= 0) < 0.99
    differ = got != index
    assert differ.mean() <= tolerances.RAYS_ON_EDGES
    # What one of the two met is at its edge, or as far away as what the other met, or as what it passed, or the ray
    # starts on it.
    at_edge = np.minimum(np.abs(margin(quads, rays, got)), np.abs(margin(quads, rays, index))) < tolerances.QUAD_EDGE
    t_got = np.linalg.norm(found.position - rays.origin, axis=1)
    tied = np.minimum(np.abs(t_got - distance), np.abs(t_got - passed)) < 1e-4 * scale * (1 + away)
    starts_on = np.minimum(t_got, distance) < 1e-4 * scale * (1 + away)
    assert np.all((at_edge | tied | starts_on)[differ])
    same = ~differ & (index >= 0) & (distance > 1e-2 * scale)
    rounding = tolerances.FLOAT32 * (1 + away) * scale * 10
    # Along a plane its distance is the quotient of two roundings.
    facing = np.abs((np.array([q.normal for q in quads])[index] * rays.direction).sum(1))
    np.testing.assert_array_less((np.abs(t_got - distance) * facing)[same], rounding + 1e-5 * distance[same])


def test_it_is_one_sided():
    quads = [quad_at((0, 0, 0), np.eye(3), 1.0, 1.0)]
    along = np.array([[0, 0, -1], [0, 0, 1], [0, 0, -1], [1, 0, 0], [1, 0, -1e-9]], "f")
    start = np.array([[0, 0, 1], [0, 0, -1], [0, 0, -1], [-3, 0, 0], [-3, 0, 0]], "f")
    got = answer(asset_of(quads, [plain()]), Rays(start, along)).status
    assert got.tolist() == [1.0, 2.0, 2.0, 2.0, 2.0], "front, back, behind it, in its plane"


def test_the_contour_is_where_alpha_is_half(rng):
    """A disc in the texels: hits within it, misses outside it, decided within a texel of its edge; light passes on."""
    n = 64
    y, x = (np.mgrid[:n, :n] + 0.5) / n * 2 - 1
    disc = np.zeros((n, n, 4), "f")
    disc[x * x + y * y < 0.49] = (0.5, 0.25, 0.125, 1)
    quads = [quad_at((0, 0, 0), np.eye(3), 2.0, 2.0), quad_at((0, 0, -1), np.eye(3), 3.0, 3.0)]
    asset = asset_of(quads, [disc, plain((0, 7, 0))])
    assert asset.options["contours"]
    end = np.c_[rng.uniform(-2, 2, (20_000, 2)), np.zeros(20_000)]
    start = end + [0.3, -0.2, 1.0]
    rays = Rays(start.astype("f"), unit(end - start).astype("f"))
    found = answer(asset, rays)
    radius = np.linalg.norm(end[:, :2], axis=1) / 2
    front = np.abs(found.position[:, 2]) < 1e-3
    texel = 2 / n
    assert np.all(front[radius < 0.7 - texel]) and not np.any(front[radius > 0.7 + texel])
    # At the contour too the colour is the object's: premultiplied texels do not darken it.
    np.testing.assert_allclose(found.radiance[front], np.tile([0.5, 0.25, 0.125], (front.sum(), 1)), rtol=1e-5)
    np.testing.assert_allclose(found.radiance[~front, 1], 7, rtol=1e-5)
    np.testing.assert_allclose(found.position[~front, 2], -1, atol=1e-5)


def test_a_straight_edge_lies_between_its_texels(rng):
    """Half covered: alpha is a half exactly on the line between the last full texel and the first empty one."""
    image = plain(size=16)
    image[:, 8:] = 0
    at = rng.uniform(-1, 1, (5000, 2))
    found = answer(
        asset_of([quad_at((0, 0, 0), np.eye(3), 1.0, 1.0)], [image]),
        Rays(np.c_[at, np.ones(5000)].astype("f"), np.tile(np.float32([0, 0, -1]), (5000, 1))),
    )
    clear = np.abs(at[:, 0]) > 1e-5
    assert np.array_equal((found.status == spaces.STATUS_HIT)[clear], (at[:, 0] < 0)[clear])


def test_texels_lie_where_they_were_captured(rng):
    """A picture of its own coordinates, whatever block of the atlas it stands in: radiance tells (u, v)."""
    quads, images = [], []
    for i, (w, h) in enumerate([(64, 64), (64, 8), (4, 32), (16, 16), (128, 4)]):
        v, u = np.mgrid[:h, :w] + 0.5
        images.append(np.stack([u / w, v / h, np.full((h, w), i + 1.0), np.ones((h, w))], -1).astype("f"))
        quads.append(quad_at((10.0 * i, 0, 0), np.eye(3), 1.0, 1.0))
    asset = asset_of(quads, images)
    which, at = rng.integers(0, 5, 5000), rng.uniform(-1, 1, (5000, 2))
    start = np.c_[10.0 * which + at[:, 0], at[:, 1], np.full(5000, 3.0)]
    found = answer(asset, Rays(start.astype("f"), np.tile(np.float32([0, 0, -1]), (5000, 1))))
    np.testing.assert_allclose(found.radiance[:, 2], which + 1, rtol=1e-5)
    size = np.array([image.shape[1::-1] for image in images])[which]
    want = ((at + 1) / 2).clip(0.5 / size, 1 - 0.5 / size)  # the outer half texel repeats its edge
    np.testing.assert_allclose(found.radiance[:, :2], want, atol=2 * tolerances.HALF)


def test_no_two_blocks_overlap_and_levels_are_means(rng):
    images = [rng.random((2 ** rng.integers(2, 7), 2 ** rng.integers(2, 7), 4)).astype("f") for _ in range(60)]
    atlas, placed = pack(images)
    taken = np.zeros(atlas.shape[:2], bool)
    for image, place in zip(images, placed, strict=True):
        h, w = image.shape[:2]
        level, x, y = image, place.x, place.y
        for i in range(place.levels):
            m, n = level.shape[:2]
            if i:
                x = place.x + w + 2
                y = place.y + int(h * (1 - 2.0 ** (1 - i))) + 2 * (i - 1)
            block = np.s_[y - 1 : y + m + 1, x - 1 : x + n + 1]
            assert atlas[block].shape == (m + 2, n + 2, 4) and not taken[block].any()
            taken[block] = True
            np.testing.assert_allclose(atlas[y : y + m, x : x + n], level, rtol=1e-6)
            np.testing.assert_array_equal(atlas[y - 1, x : x + n], atlas[y, x : x + n], err_msg="the border repeats the edge")
            level = image.reshape(h >> (i + 1), 2 << i, w >> (i + 1), 2 << i, 4).mean((1, 3)) if min(m, n) > 1 else level
        assert min(w, h) >> (place.levels - 1) == 4, "down to four texels"
    assert taken.mean() > 0.5, "not mostly empty"


@pytest.mark.parametrize("w, h", [(64, 64), (64, 16)])
def test_the_footprint_picks_the_level(rng, w, h):
    """Levels hold their own numbers: a footprint of 2^i texels reads level i, in the middle blends, at the end stays."""
    asset = asset_of([quad_at((0, 0, 0), np.eye(3), 1.0, h / w)], [plain(size=64)[:h, :w]])
    levels = 1 + int(np.log2(min(w, h) // 4))
    for i in range(levels):
        x = 1 + (w + 2 if i else 0)
        y = 1 + (int(h * (1 - 2.0 ** (1 - i))) + 2 * (i - 1) if i else 0)
        m, n = h >> i, w >> i
        asset.images["billboard_tx"][y - 1 : y + m + 1, x - 1 : x + n + 1, :3] = i + 1
    distance, spread = 2.0, rng.uniform(0, 0.4, 500)
    width = rng.uniform(0, 0.4, 500)
    start = np.tile(np.float32([0.3, 0.1, distance]), (500, 1))
    found = answer(asset, Rays(start, np.tile(np.float32([0, 0, -1]), (500, 1))), width, spread)
    level = np.log2(np.maximum((width + spread * distance) * w / 2, 1)).clip(0, levels - 1)
    np.testing.assert_allclose(found.radiance[:, 0], 1 + level, atol=2e-3)


def test_no_billboards_no_loop(rng):
    asset = asset_of([], [])
    text = emit_glsl(record(billboards.trace, asset), ("radiance",)).source
    assert "float facing" not in text and "billboard" not in text.replace("billboards", "")
    counts = Counts()
    found = answer(asset, Rays(np.zeros((9, 3), "f"), directions(rng, 9).astype("f")), counts=counts)
    assert counts.steps == 0 and np.all(found.status == spaces.STATUS_FELL_BACK)
    one = asset_of([quad_at((0, 0, 0), np.eye(3), 1, 1)], [plain()])
    assert "float facing" in emit_glsl(record(billboards.trace, one), ("radiance",)).source


def test_a_closed_room_around_the_mirror_stays(rng):
    """Six inner sides stand for it; none of it is lost, seen by rays in all directions."""
    room = trimesh.creation.box((4, 5, 3))
    scene = snapshot(trimesh.creation.icosphere(2, 0.4), Room=room)
    made = []
    work = job(scene, {"resolution": 8, "samples": 1, "texels": 16, "sky_error": 0}, made=made)
    quads, hidden = billboards.quads_for(work)
    assert len(quads) == 6 and hidden == ("Room",)
    asset = billboards.bake(work)
    d = directions(rng, 2000)
    found = answer(asset, Rays((0.4 * d).astype("f"), d.astype("f")))
    assert np.all(found.status == spaces.STATUS_HIT)
    on_wall = np.abs(np.abs(found.position) - [2, 2.5, 1.5]).min(1)
    assert on_wall.max() < 1e-4
    assert made[0][1] == ("Mirror", "Room") and made[1][1] == ("Mirror",), "the backdrop is captured without the room"


def test_a_round_room_lends_its_floor_and_stays_in_the_map():
    """A rotunda: its round wall has no quad, so it must not be hidden."""
    wall = trimesh.creation.cylinder(3.0, 4.0, sections=200)
    scene = snapshot(trimesh.creation.icosphere(2, 0.4), Rotunda=wall, Ball=trimesh.creation.icosphere(2, 0.2).apply_translation([1, 0, 0]))
    quads, hidden = billboards.quads_for(job(scene, {"texels": 16}))
    assert hidden == ("Ball",)
    assert sorted(q.instance for q in quads) == ["Ball", "Rotunda", "Rotunda"]
    assert all(q.normal[2] * q.center[2] < 0 for q in quads if q.instance == "Rotunda"), "floor and ceiling, inwards"


@pytest.mark.parametrize("away", [0.0, 1e4])
def test_texels_are_traced_from_above_the_surface(away):
    """Rays that started below it, by rounding far from the origin, would show its other side."""
    place = np.array([1.0, -0.7, 0.4]) * away
    tilted = trimesh.creation.box((2, 1.5, 1.0)).apply_transform(trimesh.transformations.euler_matrix(0.3, 0.5, 0.2))
    tilted.apply_translation(place + [2, 0, 0])
    scene = snapshot(trimesh.creation.icosphere(2, 0.4).apply_translation(place), Crate=tilted)
    made = []
    billboards.bake(job(scene, {"resolution": 4, "samples": 1, "texels": 16, "sky_error": 0}, made=made))
    rays = made[1][0]
    assert len(rays) > 200
    _, distance = first_hits(tilted, rays.origin.astype(np.float64), rays.direction)
    assert np.all(distance > 0) and distance.max() < 1e-2
