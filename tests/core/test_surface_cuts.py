"""core/surface_cuts.py and surface_reach.py: steps of radiance on slivers, and triangles as fine as the reflectors see them."""

import numpy as np
import pytest
import trimesh
from mesh_scenes import first_hits, smooth_mirror, snapshot, tracer
from test_surface_radiance import SETTINGS, assert_no_cracks, constant, errors, floor, linear, no_shorter, refined, spot
from tolerances import CUT_ERROR, CUT_RADIANCE, REACH_RADIANCE

from reflect_addon.core import surface_radiance
from reflect_addon.core.surface_asset import meshes_of
from reflect_addon.core.surface_cuts import cut
from reflect_addon.core.surface_reach import WIDEST, lengths_of
from reflect_addon.core.surface_refine import refine
from reflect_addon.core.surface_soup import normals

HALVINGS = 4
FINEST = 1 / 32  # m, of the edges of a floor of 2 m


def two_tone(there):
    return np.where(there, 1.0, 0.2)[..., None] * np.array([1.0, 0.9, 0.8])


def tiles(points):
    return two_tone((np.floor(points[..., 0] * 2 + 0.3) + np.floor(points[..., 1] * 2 + 0.3)) % 2 > 0)


def stripes(points):
    return two_tone(np.floor((points[..., 0] + 0.37 * points[..., 1]) * 2 + 0.3) % 2 > 0)


def disk(points):
    return two_tone(np.hypot(points[..., 0] - 0.1, points[..., 1] + 0.2) < 0.6)


def cut_up(shape, paint, halvings=HALVINGS, **more):
    soup, values, _ = refined(shape, paint, levels=12, shortest=FINEST, **more)
    asked = []

    def ask(points, *_):
        asked.append(len(points))
        return paint(points)

    return (soup, values), cut(soup, values, ask, 0.05, halvings, no_shorter(FINEST)), asked


@pytest.mark.parametrize("paint", [tiles, stripes, disk])
def test_a_step_ends_in_slivers(rng, paint):
    before, after, asked = cut_up(floor(), paint)
    rms = [np.sqrt(np.mean(errors(*each, paint, rng) ** 2)) for each in (before, after)]
    assert rms[1] < CUT_ERROR * rms[0]
    assert len(after[0].place) < 3 * len(before[0].place) and len(asked) == HALVINGS + 1
    assert_no_cracks(after[0], 8.0)


def test_cuts_keep_the_mesh(rng):
    """Its area, its sides, one value a sample, and corners that lie where their weights say."""
    (before, _), (soup, values), _ = cut_up(floor(3), tiles)
    area = lambda s: np.linalg.norm(np.cross(*np.moveaxis(np.diff(s.points[s.place], axis=1), 1, 0)), axis=-1)  # noqa: E731
    assert area(soup).sum() == pytest.approx(area(before).sum(), rel=1e-12) and area(soup).min() > 0
    assert len(values) == soup.sample.max() + 1
    assert np.all(normals(soup)[:, 2] == soup.side)
    shape = floor(3)
    corners = np.einsum("tck,tkx->tcx", soup.weights, shape.vertices[shape.faces][soup.face])
    np.testing.assert_allclose(corners, soup.points[soup.place], atol=1e-12)


@pytest.mark.parametrize("paint", [constant, linear, spot])
def test_what_is_smooth_is_not_cut(paint):
    soup, values, _ = refined(floor(), paint, tolerance=0.02, levels=9)
    after, _ = cut(soup, values, lambda points, *_: paint(points), 0.05, HALVINGS, no_shorter(0.0))
    assert len(after.place) == len(soup.place)


def test_no_halvings_no_cuts():
    before, after, asked = cut_up(floor(), tiles, halvings=0)
    assert after[0] is before[0] and after[1] is before[1] and not asked


def test_triangles_are_as_fine_as_the_reflector_sees_them():
    """A floor under a ball: no edge covers less than a quarter of the angle (a halving, and bisection's), none of it more than WIDEST of them, and below the floor
    nothing is split."""
    angle = 1 / 40
    ball = smooth_mirror(trimesh.creation.icosphere(2, 0.3).apply_translation([0, 0, 0.4]))
    scene = snapshot(ball, Floor=floor().apply_scale(4))
    lengths = lengths_of(scene, scene.instances[1:], angle)
    soup, _ = refine(
        surface_radiance.soup_of(scene, scene.instances[1:]), lambda points, *_: tiles(points), 0.05, 9, lengths
    )
    corners = soup.points[soup.place]
    edges = np.linalg.norm(corners[:, [1, 2, 0]] - corners, axis=-1)
    away = np.linalg.norm(np.maximum(np.abs(corners - [0, 0, 0.4]) - 0.3, 0), axis=-1) + 0.3
    above = soup.side > 0
    assert np.all(edges[above].min(1) > angle * away[above].min(1) / 4)
    assert np.all(edges[above].max(1) <= WIDEST * angle * away[above].max(1))
    near, far = away[above].max(1) < 0.6, away[above].min(1) > 3
    assert edges[above][near].max(1).mean() < edges[above][far].max(1).mean() / 3
    least, _, most = lengths(soup)
    assert np.isinf(least[~above]).all() and np.isinf(most[~above]).all() and np.isfinite(least[above]).all()


def test_a_mirror_is_not_its_own_surroundings():
    scene = snapshot(smooth_mirror(trimesh.creation.icosphere(1, 0.3)), Floor=floor().apply_translation([0, 0, -1]))
    least, *_ = lengths_of(scene, scene.instances[:1], 0.02)(surface_radiance.soup_of(scene, scene.instances[:1]))
    assert np.isinf(least).all()


def test_a_chequered_floor_as_a_ball_shows_it(rng):
    """All of it through `bake`: the radiance of points by the solid angle in which the ball sees them."""
    ball = smooth_mirror(trimesh.creation.icosphere(2, 0.3).apply_translation([0, 0, 0.4]))
    scene = snapshot(ball, Floor=floor().apply_scale(4))
    settings = {**SETTINGS, "surface_angle": 1 / 32, "surface_levels": 9, "surface_cuts": HALVINGS}
    asset = surface_radiance.bake(scene, tracer(scene, lambda p, owner: tiles(p)), scene.instances[1:], settings)
    mesh = meshes_of(asset)["Floor"]
    world = mesh.positions.astype(float) + scene.named()["Floor"].world_from_object[:3, 3]
    direction = rng.normal(size=(4000, 3))
    direction[:, 2] = -np.abs(direction[:, 2])
    hit = np.array([0, 0, 0.4]) + direction * (0.4 / -direction[:, 2:])
    hit = hit[np.abs(hit).max(1) < 4]
    shape = trimesh.Trimesh(world, mesh.triangles[mesh.side[mesh.triangles[:, 0]] > 0], process=False)
    face, _ = first_hits(shape, hit + [0, 0, 1], np.broadcast_to([0.0, 0.0, -1.0], hit.shape))
    weights = trimesh.triangles.points_to_barycentric(shape.triangles[face], hit)
    shown = np.einsum("nk,nkc->nc", weights, mesh.radiance[shape.faces[face]])
    assert np.sqrt(np.mean((shown - tiles(hit)) ** 2)) < REACH_RADIANCE
    np.testing.assert_allclose(np.median(np.abs(shown - tiles(hit))), 0, atol=CUT_RADIANCE)
