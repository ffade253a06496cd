"""core/surface_refine.py and surface_radiance.py: subdivided where radiance changes, nowhere else, without cracks."""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
import trimesh
from mesh_scenes import MATTE, MIRROR, smooth_mirror, snapshot, tracer

from reflect_addon.core import surface_radiance
from reflect_addon.core.asset_files import load_asset, save_asset
from reflect_addon.core.errors import ReflectError
from reflect_addon.core.snapshot import Material
from reflect_addon.core.surface_asset import meshes_of
from reflect_addon.core.surface_refine import refine
from reflect_addon.core.surface_soup import normals

BALL = trimesh.creation.icosphere(2, 0.3).apply_translation([0, 0, 2])
SETTINGS = {**surface_radiance.DEFAULTS, "surface_samples": 1}


def floor(n=1):
    """A square of side 2 in z = 0, n x n cells of two triangles."""
    x, y = np.meshgrid(np.linspace(-1, 1, n + 1), np.linspace(-1, 1, n + 1))
    i = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
    faces = np.concatenate([np.stack([i, i + 1, i + n + 2], -1), np.stack([i, i + n + 2, i + n + 1], -1)])
    return trimesh.Trimesh(np.column_stack([x.ravel(), y.ravel(), 0 * x.ravel()]), faces, process=False)


def spot(points):
    """A spotlight's smooth edge, off-centre, inside no edge of the mesh."""
    r = np.hypot(points[..., 0] - 0.37, points[..., 1] + 0.21)
    t = np.clip((0.3 - r) / 0.15, 0, 1)
    return 0.2 + (t * t * (3 - 2 * t))[..., None] * np.array([1.0, 0.8, 0.5])


def constant(points):
    return np.broadcast_to([0.3, 0.2, 0.1], (*points.shape[:-1], 3)).copy()


def linear(points):
    return 2 + points[..., :1] * np.array([0.5, 0.1, -0.3]) + points[..., 1:2]


def no_shorter(least):
    """Lengths of `refine`: edges of at most `least` m are not split, and none is for its length."""
    return lambda soup: tuple(np.full(len(soup.place), length) for length in (least, least, np.inf))


def refined(shape, paint, tolerance=0.05, levels=6, **more):
    scene = snapshot(BALL, Thing=shape)
    soup = surface_radiance.soup_of(scene, scene.instances[1:])
    asked = []

    def ask(points, *_):
        asked.append(len(points))
        return paint(points)

    soup, values = refine(soup, ask, tolerance, levels, no_shorter(more.pop("shortest", 0.0)), **more)
    assert len(values) == soup.sample.max() + 1
    return soup, values, asked


def errors(soup, values, paint, rng, count=40_000):
    """Relative difference to the function at random points of the surface, by area."""
    corners = soup.points[soup.place]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=-1)
    chosen = rng.choice(len(area), count, p=area / area.sum())
    w = rng.dirichlet([1, 1, 1], count)
    told = np.einsum("nk,nkc->nc", w, values[soup.sample[chosen]])
    truth = paint(np.einsum("nk,nkx->nx", w, corners[chosen]))
    return np.abs(told - truth).max(1) / np.abs(truth).max(1)


def assert_no_cracks(soup, start):
    """Every edge is met by as many triangles as the unrefined mesh's, and no vertex lies inside another's edge."""
    side = soup.side > 0
    edges = np.sort(np.concatenate([soup.place[side][:, pair] for pair in ([0, 1], [1, 2], [2, 0])]), 1)
    uses = Counter(map(tuple, edges))
    places = {tuple(p): k for k, p in enumerate(soup.points)}
    assert len(places) == len(soup.points), "two places at one point"
    for (a, b), n in uses.items():
        assert n in (1, 2)
        assert tuple((soup.points[a] + soup.points[b]) / 2) not in places, "a T-junction"
    boundary = sum(np.linalg.norm(soup.points[a] - soup.points[b]) for (a, b), n in uses.items() if n == 1)
    assert boundary == pytest.approx(start)


@pytest.mark.parametrize("paint", [constant, linear])
def test_nothing_is_split_where_interpolation_is_right(paint):
    soup, _, asked = refined(floor(), paint)
    assert len(soup.place) == 4 and len(asked) == 1  # two triangles, two sides, one bundle
    ball, _, _ = refined(trimesh.creation.icosphere(2), paint)
    assert len(ball.place) == 320  # closed: the outside alone


@pytest.mark.parametrize("tolerance", [0.1, 0.03])
def test_a_spotlight_is_found_and_followed(rng, tolerance):
    soup, values, asked = refined(floor(), spot, tolerance, levels=8)
    off = errors(soup, values, spot, rng)
    # Asked at midpoints and grids, not everywhere: a few points between them may differ by a little more.
    assert np.quantile(off, 0.99) < tolerance and off.max() < 3 * tolerance
    assert_no_cracks(soup, 8.0)
    # Nowhere else: far from the light the triangles stay large.
    corners = soup.points[soup.place]
    far = np.hypot(corners[..., 0] - 0.37, corners[..., 1] + 0.21).min(1) > 0.6
    longest = np.linalg.norm(corners[:, [1, 2, 0]] - corners, axis=-1).max(1)
    assert far.sum() < 0.1 * len(far) and longest[far].max() > 0.5
    uniform = 4 * (2 / longest.min()) ** 2
    assert len(soup.place) < uniform / 4
    assert len(asked) <= 9


def test_a_hard_edge_ends_at_the_shortest_edge(rng):
    """A checker's border can never be interpolated: the triangles along it end at the limit, their area is small."""
    checker = lambda p: np.where((np.floor(p[..., 0] * 2 + 0.3) + np.floor(p[..., 1] * 2 + 0.3)) % 2, 1.0, 0.2)[..., None] * np.ones(3)  # noqa: E731
    soup, values, _ = refined(floor(), checker, levels=12, shortest=1 / 32)
    corners = soup.points[soup.place]
    edges = np.linalg.norm(corners[:, [1, 2, 0]] - corners, axis=-1)
    assert edges.min() > 1 / 32 / 2 - 1e-9
    assert_no_cracks(soup, 8.0)
    off = errors(soup, values, checker, rng)
    # Borders: 2 x 4 lines of 2 m, wrong within one short edge to both sides; the floor has 4 m2.
    assert np.mean(off > 0.05) < 2 * 4 * 2 * 2 * (1 / 32) / 4
    assert np.mean(off < 1e-9) > 0.5


def test_angles_do_not_degenerate():
    soup, _, _ = refined(floor(), spot, 0.01, levels=10)
    corners = soup.points[soup.place]
    a, b = corners[:, [1, 2, 0]] - corners, corners[:, [2, 0, 1]] - corners
    cosine = (a * b).sum(-1) / (np.linalg.norm(a, axis=-1) * np.linalg.norm(b, axis=-1))
    assert np.degrees(np.arccos(cosine)).min() > 22.4  # half of the start's 45 degrees, the bound of bisection


def test_noise_is_no_reason_to_split(rng):
    noisy = lambda p: constant(p) * (1 + rng.uniform(-0.2, 0.2, (len(p), 1)))  # noqa: E731
    scene = snapshot(BALL, Thing=floor(4))
    soup = surface_radiance.soup_of(scene, scene.instances[1:])
    ask = lambda points, *_: noisy(points)  # noqa: E731
    noise = surface_radiance.noise_of(soup, ask)
    assert 0.4 < noise[0] < 0.8  # answers differ by a third at most
    after, _ = refine(soup, ask, 0.05, 5, no_shorter(0.0), noise)
    assert len(after.place) < 1.2 * len(soup.place)
    assert surface_radiance.noise_of(soup, lambda p, *_: constant(p)) == 0


def test_the_number_of_samples_is_bounded():
    soup, values, _ = refined(floor(), lambda p: np.sin(40 * p), 0.001, levels=12, most=2000)
    assert 2000 <= len(values) < 20_000


def test_sides_and_sharp_edges():
    """A box has three samples at each corner; a sheet has two sides whose normals are opposite."""
    box, _, _ = refined(trimesh.creation.box((1, 1, 1)), constant)
    assert len(box.points) == 8 and box.sample.max() == 23
    assert np.all(((normals(box) * (box.points[box.place].mean(1) - box.points.mean(0))).sum(1)) > 0)
    sheet, _, _ = refined(floor(), constant)
    assert sheet.sample.max() == 7 and sorted(normals(sheet)[:, 2]) == [-1, -1, 1, 1]
    flipped = trimesh.creation.box((1, 1, 1))
    flipped.faces[0] = flipped.faces[0][::-1]
    assert len(refined(flipped, constant)[0].place) == 24, "a face that winds the wrong way: both sides"


# --- through a tracer, and as an asset


def baked(paint, **shapes):
    scene = snapshot(BALL, **shapes)
    return scene, surface_radiance.bake(scene, tracer(scene, paint), scene.instances[1:], SETTINGS)


def test_an_asset_comes_back(tmp_path, rng):
    shapes = {"Box": trimesh.creation.box((1, 1, 1)).apply_translation([3, 0, 0]), "Floor": floor()}
    scene, asset = baked(lambda p, owner: spot(p), **shapes)
    assert (asset.kind, asset.reflector, asset.source) == ("surface_radiance", "", "trace")
    found = meshes_of(load_asset(save_asset(asset, tmp_path / "a")))
    assert list(found) == ["Box", "Floor"]
    for name, mesh in found.items():
        world = mesh.positions @ np.eye(3) + scene.named()[name].world_from_object[:3, 3]
        np.testing.assert_allclose(mesh.radiance, spot(world), rtol=0, atol=2e-2)  # asked a thousandth inwards
        own = scene.meshes[scene.named()[name].mesh]
        again = replace(mesh, mesh=mesh.mesh + " deformed").on(own)
        np.testing.assert_array_equal(again.positions, mesh.positions)
        np.testing.assert_array_equal(again.normals, mesh.normals)
        corners = mesh.positions[mesh.triangles].astype(float)
        facing = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        assert np.all((facing * mesh.normals[mesh.triangles[:, 0]]).sum(1) > 0), "counter-clockwise as seen"
        spare = np.concatenate([own.positions, own.positions[:1]])
        assert mesh.on(replace(own, positions=spare)) is None, "as many triangles, of other vertices: not the same mesh deformed"


def test_mirrors_are_not_subdivided():
    scene = snapshot(floor(), Other=floor())
    paint = lambda p, owner: spot(p)  # noqa: E731
    found = meshes_of(surface_radiance.bake(scene, tracer(scene, paint), scene.instances, SETTINGS))
    assert len(found["Mirror"].triangles) == 4 < len(found["Other"].triangles)


def test_of_a_mirror_its_own_light_is_kept():
    """What it mirrors is added when it is shown. A metal has none; a varnished thing has the paint below the varnish, as
    the tracer of these tests makes it: the paint less what the surface mirrors straight above."""
    varnish = Material("varnish", metallic=0.0, roughness=0.0, ior=1.5, is_reflector=True)
    ball = lambda x, material: smooth_mirror(  # noqa: E731
        trimesh.creation.icosphere(3, 0.5).apply_translation([x, 0, 0]), material
    )
    scene = snapshot(ball(0, MIRROR), Varnished=ball(3, varnish), Matt=trimesh.creation.box((1, 1, 1)).apply_translation([0, 3, 0]))
    paint = lambda p, owner: np.full((len(p), 3), 0.7)  # noqa: E731
    found = meshes_of(surface_radiance.bake(scene, tracer(scene, paint), scene.instances, SETTINGS))
    assert not found["Mirror"].radiance.any()
    np.testing.assert_allclose(found["Matt"].radiance, 0.7, rtol=1e-5)
    np.testing.assert_allclose(found["Varnished"].radiance, 0.7, rtol=0.02)
    share = {name: mesh.share(scene, scene.named()[name]) for name, mesh in found.items()}
    assert share["Mirror"].all() and share["Varnished"].all() and not share["Matt"].any()


def test_only_the_part_that_mirrors_counts():
    """A box with one shiny side: its vertices there mirror, the others do not; of another mesh nobody can tell."""
    box = trimesh.creation.box((1, 1, 1)).apply_translation([3, 0, 0])
    box.metadata.update(material=(MATTE, MIRROR), faces=(box.face_normals[:, 2] > 0.5).astype(int))
    scene, asset = baked(lambda p, owner: constant(p), Box=box)
    mesh, instance = meshes_of(asset)["Box"], scene.named()["Box"]
    np.testing.assert_array_equal(mesh.share(scene, instance), mesh.normals[:, 2] > 0.5)
    assert not mesh.radiance[mesh.normals[:, 2] > 0.5].any() and mesh.radiance[mesh.normals[:, 2] < 0.5].all()
    assert replace(mesh, faces=99).share(scene, instance) is None


def test_a_deformed_mesh_takes_its_radiance_along():
    scene, asset = baked(lambda p, owner: spot(p), Floor=floor())
    mesh = meshes_of(asset)["Floor"]
    own = scene.meshes[1]
    bent = replace(own, positions=own.positions * np.float32([2, 1, 1]) + np.float32([0, 0, 1]))
    moved = mesh.on(bent)
    np.testing.assert_allclose(moved.positions, mesh.positions * [2, 1, 1] + [0, 0, 1], atol=1e-6)
    assert moved.radiance is mesh.radiance
    assert mesh.on(scene.meshes[0]) is None, "other triangles"


def test_a_damaged_asset_is_a_sentence():
    _, asset = baked(lambda p, owner: constant(p), Floor=floor())
    for name in asset.images:
        for bad in (np.full_like(asset.images[name], 1e9), asset.images[name][:0]):
            with pytest.raises(ReflectError, match="damaged"):
                meshes_of(replace(asset, images={**asset.images, name: bad}))


def test_nothing_to_bake():
    scene = snapshot(BALL)
    asset = surface_radiance.bake(scene, tracer(scene), (), SETTINGS)
    assert meshes_of(asset) == {} and all(a.size for a in asset.images.values())


def test_large_meshes_have_fewer_paths_a_question():
    """As many as are asked for where that is cheap, and never less than a few, however large the mesh."""
    counts = []
    for n in (1, 40, 150):
        scene = snapshot(BALL, Thing=floor(n))
        soup = surface_radiance.soup_of(scene, scene.instances[1:])
        counts.append(surface_radiance.paths_of(soup, {**surface_radiance.DEFAULTS, "surface_samples": 64, "surface_paths": 1 << 20}))
    assert counts[0] == 64 and 64 > counts[1] > counts[2] == surface_radiance.FEWEST
    assert surface_radiance.paths_of(soup, SETTINGS) == 1, "what asks for fewer gets them"
