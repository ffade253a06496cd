"""Parts of reflectors: each point of the surface is seen by some part's centre, exactly, and kinds are as they should be."""

import time

import numpy as np
import pytest
import reflector_shapes as shapes
from tolerances import PART_COVER, PART_NORMAL, PART_PLACE

from reflect_addon.core.reflector_parts import left_out, part_surface, parts_of


def covered(rng, mesh, parts, count=3000, sided=False):
    """Share of random points of the surface that some part gives back. sided: its normal is to look the given one's way."""
    positions, triangles, normals = mesh
    which, weight, point = shapes.points_on(rng, mesh, count)
    size = np.linalg.norm(np.ptp(positions[triangles].reshape(-1, 3), axis=0)) / 2
    true = np.einsum("nk,nkx->nx", weight, normals[which])
    true /= np.linalg.norm(true, axis=-1, keepdims=True)
    back = np.zeros(count, bool)
    for part in parts:
        away = point - part.center
        distance, normal, inside = part_surface(part, *mesh)(away)
        near = np.abs(distance - np.linalg.norm(away, axis=-1)) < PART_PLACE * size
        cosine = (normal * true).sum(-1)
        back |= inside & near & ((cosine if sided else np.abs(cosine)) > np.cos(PART_NORMAL))
    return back.mean()


def sound(mesh, parts, most=16):
    """What holds of parts of anything."""
    assert len(parts) <= most and all(p.kind in ("flat", "convex", "concave", "saddle") for p in parts)
    held = np.concatenate([p.triangles[p.own] for p in parts]) if parts else np.zeros(0, int)
    assert len(np.unique(held)) == len(held)
    for part in parts:
        assert part.size > 0 and np.isfinite(part.center).all()


# name: (mesh, its parts' kinds, the largest's first)
FORMULAS = {
    "sphere": (shapes.ellipsoid, ["convex"]),
    "ellipsoid": (lambda: shapes.ellipsoid((1, 0.6, 0.4)), ["convex"]),
    "ellipsoid 10:1": (lambda: shapes.ellipsoid((10, 1, 1)), ["convex"]),
    "flat-shaded sphere": (lambda: shapes.shaded(*shapes.ellipsoid(nu=24, nv=12)[:2], smooth_below=0), ["convex"]),
    "torus": (shapes.torus, ["convex"] + ["saddle"] * 4),
    "bowl": (shapes.bowl, ["convex", "concave", "saddle"]),
    "hollow": (shapes.cap, ["concave"]),
    "paraboloid": (shapes.paraboloid, ["concave"]),
    "cylinder": (shapes.cylinder, ["convex", "flat", "flat"]),
    "bevelled cube": (shapes.bevelled_cube, ["convex"] + ["flat"] * 6),
    "cube with a bevel of 1 %": (lambda: shapes.bevelled_cube(0.02), ["flat"] * 6 + ["convex"]),
    "bevelled cube, flat-shaded": (lambda: shapes.bevelled_cube(smooth=False), ["convex"] + ["flat"] * 6),
}


@pytest.mark.parametrize("name", FORMULAS)
def test_formulas_are_covered_by_few_parts(name, rng):
    make, kinds = FORMULAS[name]
    mesh = make()
    parts = parts_of(*mesh)
    sound(mesh, parts)
    assert [p.kind for p in parts] == kinds
    assert covered(rng, mesh, parts, sided=True) >= PART_COVER["formula"]
    assert left_out(parts, *mesh[:2]) <= 1 - PART_COVER["formula"]


def test_a_long_ellipsoid_is_cut_along_its_axis(rng):
    mesh = shapes.ellipsoid((50, 1, 1), 24, 40)
    parts = parts_of(*mesh)
    sound(mesh, parts)
    assert {p.kind for p in parts} == {"convex"} and covered(rng, mesh, parts, sided=True) >= PART_COVER["formula"]


def test_a_hollow_is_seen_from_before_it_and_a_ball_from_inside():
    hollow, ball = parts_of(*shapes.cap())[0], parts_of(*shapes.ellipsoid())[0]
    assert hollow.reverse and hollow.two_sided and np.linalg.norm(hollow.center) < 0.4
    assert not ball.reverse and not ball.two_sided and np.linalg.norm(ball.center) < 0.05


# name: (file, degrees below which it is shaded smooth)
MODELS = {"teapot": ("teapot.obj", 180), "spot": ("spot.obj", 180), "fandisk": ("fandisk.obj", 40)}
LARGE = {"rocker-arm": ("rocker-arm.obj", 180), "stanford-bunny": ("stanford-bunny.obj", 180)}


def model_is_covered(rng, shared, file, smooth_below):
    mesh = shapes.from_obj(shared / "models" / file, smooth_below)
    start = time.process_time()
    parts = parts_of(*mesh)
    seconds = time.process_time() - start
    sound(mesh, parts)
    cover = covered(rng, mesh, parts)
    kinds = {k: sum(len(p.triangles) for p in parts if p.kind == k) for k in ("flat", "convex", "concave", "saddle")}
    print(f"{file}: {len(parts)} parts, {kinds} triangles, {cover:.4f} covered, {seconds:.1f} s")
    assert cover >= PART_COVER["model"]


@pytest.mark.parametrize("name", MODELS)
def test_models_are_covered(name, rng, shared):
    model_is_covered(rng, shared, *MODELS[name])


@pytest.mark.slow
@pytest.mark.parametrize("name", LARGE)
def test_large_models_are_covered(name, rng, shared):
    model_is_covered(rng, shared, *LARGE[name])


def test_a_fringe_lies_around_a_part_and_ends_at_creases():
    torus = shapes.torus()
    outer, *inner = parts_of(*torus)
    assert all(0 < (~p.own).sum() < p.own.sum() for p in (outer, *inner))
    tube = torus[1][outer.triangles[~outer.own]]
    assert (np.linalg.norm(torus[0][tube].mean(1)[:, :2], axis=-1) < 1.0).all()  # beyond the border, in the hole
    assert all(p.own.all() for p in parts_of(*shapes.cylinder()))


def test_the_same_parts_every_time_and_at_any_scale():
    positions, triangles, normals = shapes.torus(nu=32, nv=16)
    one = parts_of(positions, triangles, normals)
    for scale in (2.0**-13, 2.0**17):  # powers of two: rounding is the same
        other = parts_of(scale * positions, triangles, normals)
        assert [p.triangles.tolist() for p in one] == [p.triangles.tolist() for p in other]
        assert [(scale * p.center).tolist() for p in one] == [p.center.tolist() for p in other]


def test_the_outside_of_a_closed_mesh_mirrors_whatever_its_windings(rng):
    positions, triangles, normals = shapes.torus(nu=32, nv=16)
    parts = parts_of(positions, triangles[:, ::-1], -normals[:, ::-1])
    assert covered(rng, (positions, triangles, normals), parts, sided=True) >= PART_COVER["formula"]


def test_faces_in_one_plane_are_one_part():
    a = shapes.bevelled_cube(0.3, smooth=False)
    tiles = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float)
    positions = np.concatenate([tiles, tiles + [2, 0, 0], tiles + [0, 0, 1]])
    faces = [[s, s + i, s + i + 1] for s in (0, 4, 8) for i in (1, 2)]
    parts = parts_of(*shapes.shaded(positions, faces, smooth_below=0))
    assert [p.kind for p in parts] == ["flat", "flat"] and sorted(len(p.triangles) for p in parts) == [2, 4]
    assert sum(p.kind == "flat" for p in parts_of(*a)) == 6


def test_a_floor_of_loose_tiles_is_one_part():
    tile = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float)
    at = np.stack(np.meshgrid(np.arange(40), np.arange(40), [0.0]), -1).reshape(-1, 1, 3) * 1.1
    faces = 4 * np.arange(1600)[:, None, None] + np.array([[0, 1, 2], [0, 2, 3]])
    floor = (at + tile).reshape(-1, 3), faces.reshape(-1, 3), np.tile([0, 0, 1.0], (3200, 3, 1))
    (part,) = parts_of(*floor)
    assert part.kind == "flat" and len(part.triangles) == 3200 and part.center[2] < 0


NOTHING = ("nothing", "no triangles", "a dot", "a line", "extents of 1e30")


def odd_meshes():
    """(name, (positions, triangles)); those of the names in NOTHING have no area to speak of."""
    rng = np.random.default_rng(5)
    none = (np.zeros((0, 3)), np.zeros((0, 3), int))
    one = (np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], float), np.array([[0, 1, 2]]))
    yield "nothing", none
    yield "no triangles", (one[0], none[1])
    yield "a triangle", one
    yield "a dot", (one[0], np.array([[0, 0, 0]]))
    yield "a line", (one[0] * [1, 0, 0], one[1])
    yield "both sides", (one[0], np.array([[0, 1, 2], [0, 2, 1], [0, 1, 2]]))
    fin = np.array([[0, 0, 0], [0, 0, 1], [1, 0, 0], [-1, 1, 0], [-1, -1, 0.0]])
    yield "three on an edge", (fin, np.array([[0, 1, 2], [0, 1, 3], [1, 0, 4]]))
    a = np.linspace(0, 2 * np.pi, 21)[:-1]
    out = np.stack([np.cos(a), np.sin(a), 0 * a], -1)
    lean = 0.3 * (np.cos(a / 2)[:, None] * out + np.sin(a / 2)[:, None] * np.array([0, 0, 1.0]))
    k, after = np.arange(20), (np.arange(20) + 1) % 20
    low, high = np.where(k == 19, after + 20, after), np.where(k == 19, after, after + 20)
    yield "one side", (np.concatenate([out - lean, out + lean]), np.concatenate([np.stack([k, low, high], -1), np.stack([k, high, k + 20], -1)]))
    yield "soup", (rng.normal(size=(900, 3)), np.arange(900).reshape(-1, 3))
    sheets = np.concatenate([one[0] * 5 + [0, 0, z] for z in np.linspace(0, 1, 150)])
    yield "sheets", (sheets, np.arange(450).reshape(-1, 3))
    wild = rng.normal(size=(60, 3))
    wild[5], wild[9, 1] = np.nan, np.inf
    yield "not numbers", (wild, rng.integers(0, 60, (100, 3)))
    wild = wild.copy()
    wild[20] = 1e30
    yield "extents of 1e30", (wild, rng.integers(0, 60, (100, 3)))
    needles = rng.normal(size=(300, 1, 3)) + rng.normal(size=(300, 3, 1)) * rng.normal(size=(300, 1, 3)) + 1e-7 * rng.normal(size=(300, 3, 3))
    yield "needles", (needles.reshape(-1, 3), np.arange(900).reshape(-1, 3))


@pytest.mark.parametrize("name", [name for name, _ in odd_meshes()])
@pytest.mark.parametrize("most", [16, 1])
@pytest.mark.filterwarnings("error")
def test_odd_meshes_raise_nothing_and_take_no_time(name, most):
    positions, triangles = dict(odd_meshes())[name]
    with np.errstate(all="ignore"):
        mesh = shapes.shaded(positions, triangles, smooth_below=0)
    for normals in (mesh[2], np.zeros_like(mesh[2])):
        start = time.process_time()
        parts = parts_of(positions, triangles, normals, most)
        assert time.process_time() - start < 5
        sound((positions, triangles, normals), parts, most)
        assert 0 <= left_out(parts, positions, triangles) <= 1
        assert bool(parts) == (name not in NOTHING)
