"""Hit points of trace() against two ray tracers that share nothing with it: Blender's BVH tree and Embree."""

import bpy  # noqa: F401  mathutils needs it first
import numpy as np
import pytest
from blender_scenes import add_mesh, add_soup, random_matrix, random_rays, world_triangles
from embreex import rtcore_scene
from embreex.mesh_construction import TriangleMesh
from mathutils import Vector
from mathutils.bvhtree import BVHTree
from tolerances import HIT_POINT_OF_DIAGONAL, RAYS_ON_EDGES

from reflect_addon.core.rays import Rays
from reflect_addon.core.spaces import FAR
from reflect_addon.scene.raytrace import trace

COUNT = 20_000


def random_scene(rng, scale=1.0, shift=0.0):
    place = np.diag([scale, scale, scale, 1.0])
    place[:3, 3] = shift
    for k in range(6):
        add_soup(f"Soup {k}", rng, 60, rng.normal(0, 1.5, 3), 0.6, place @ random_matrix(rng, mirrored=k % 2 == 1))
    return world_triangles()


def against(truth_distance, truth_object, origin, direction, hits, diagonal):
    """Share of rays on edges (the tracers disagree which side), then exact comparison of all others."""
    expected = origin.astype(float) + truth_distance[:, None] * direction
    error = np.linalg.norm(hits.position - expected, axis=1) / diagonal
    names = np.array([*hits.object_names, ""])[hits.object]
    both = hits.hit & np.isfinite(truth_distance)
    agree = (hits.hit == np.isfinite(truth_distance)) & (~both | (error < HIT_POINT_OF_DIAGONAL))
    assert both.sum() > 0.3 * len(origin), "the scene is too empty to test anything"
    assert (~agree).mean() <= RAYS_ON_EDGES, f"{(~agree).sum()} rays disagree, by {np.sort(error[both])[-5:]}"
    # Where two objects cross within the tolerance either may be named.
    assert (names[both & agree] == truth_object[both & agree]).mean() >= 1 - RAYS_ON_EDGES
    length = np.linalg.norm(hits.normal[hits.hit], axis=1)
    np.testing.assert_allclose(length, 1, atol=1e-5)


def embree(triangles, origin, direction):
    scene = rtcore_scene.EmbreeScene()
    TriangleMesh(scene, triangles.astype(np.float32))
    result = scene.run(origin, direction, output=True)
    return np.where(result["primID"] >= 0, result["tfar"], np.inf).astype(float), result["primID"]


def bvh_tree(triangles, origin, direction):
    faces = np.arange(triangles.size // 3).reshape(-1, 3)
    tree = BVHTree.FromPolygons(triangles.reshape(-1, 3).tolist(), faces.tolist())
    found = [tree.ray_cast(Vector(o), Vector(d)) for o, d in zip(origin, direction)]
    index = np.array([-1 if f[2] is None else f[2] for f in found])
    return np.array([np.inf if f[3] is None else f[3] for f in found]), index


@pytest.mark.parametrize("tracer", [embree, bvh_tree])
def test_hit_points_agree_with_other_ray_tracers(fresh_file, rng, tracer):
    triangles, names = random_scene(rng)
    origin, direction = random_rays(rng, COUNT, triangles)
    distance, index = tracer(triangles, origin, direction)
    hits = trace(Rays(origin, direction))
    diagonal = np.linalg.norm(np.ptp(triangles.reshape(-1, 3), axis=0))
    against(distance, names[index], origin, direction, hits, diagonal)


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e4])
def test_hit_points_agree_at_every_scale(fresh_file, rng, scale):
    triangles, names = random_scene(rng, scale)
    origin, direction = random_rays(rng, COUNT, triangles)
    # Compared at scale 1: Embree's own tolerances are absolute.
    distance, index = embree(triangles / scale, (origin / scale).astype(np.float32), direction)
    hits = trace(Rays(origin, direction))
    diagonal = np.linalg.norm(np.ptp(triangles.reshape(-1, 3), axis=0))
    against(distance * scale, names[index], origin, direction, hits, diagonal)


def test_far_from_the_origin_positions_are_as_good_as_float32(fresh_file, rng):
    triangles, names = random_scene(rng, shift=1000.0)
    origin, direction = random_rays(rng, COUNT, triangles)
    distance, index = embree(triangles - 1000.0, origin - np.float32(1000), direction)
    hits = trace(Rays(origin, direction))
    both = hits.hit & np.isfinite(distance)
    first, second, third = np.moveaxis(triangles[index[both]], 1, 0)
    normal = np.cross(second - first, third - first)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    off_surface = np.abs(np.einsum("ij,ij->i", hits.position[both] - first, normal))
    off_ray = np.linalg.norm(np.cross(hits.position[both] - origin[both].astype(float), direction[both]), axis=1)
    # One step of float32 at 1000 m is 6e-5 m.
    assert np.percentile(off_surface, 99) < 4 * np.spacing(np.float32(1000))
    assert np.percentile(off_ray, 99) < 4 * np.spacing(np.float32(1000))
    assert (hits.hit != np.isfinite(distance)).mean() <= 10 * RAYS_ON_EDGES


def test_misses_end_far_out_on_their_ray(fresh_file):
    direction = np.float32([[0, 0, 1], [0.6, 0, -0.8]])
    hits = trace(Rays(np.float32([[1, 2, 3], [0, 0, 0]]), direction))
    assert not hits.hit.any()
    assert (hits.object == -1).all()
    assert (hits.normal == 0).all()
    np.testing.assert_allclose(hits.position, FAR * direction, rtol=1e-6, atol=FAR * 1e-6)


def test_rays_that_start_micrometres_from_a_surface_see_it(fresh_file):
    add_mesh("Floor", [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], [(0, 1, 2, 3)])
    origin = np.float32([[0.1, 0.2, 3e-6], [0.1, 0.2, 1e-3], [0.1, 0.2, -3e-6]])
    hits = trace(Rays(origin, np.float32([[0, 0, -1], [0, 0, -1], [0, 0, 1]])))
    assert hits.hit.all()
    np.testing.assert_allclose(hits.position, np.tile([0.1, 0.2, 0], (3, 1)), atol=1e-7)


@pytest.mark.parametrize("height", [1e-8, 1e-7, 1e-6])
def test_in_a_scene_of_millimetres_nothing_is_too_near(fresh_file, height):
    """Cycles clips a micrometre; rays that start below it see the surface still, and none that they have left."""
    add_mesh("Plate", [(-1e-3, -1e-3, 0), (1e-3, -1e-3, 0), (0, 1e-3, 0)], [(0, 1, 2)])
    down = np.tile(np.float32([0.6, 0, -0.8]), (64, 1))
    assert trace(Rays(np.tile(np.float32([0, 0, height]), (64, 1)), down)).hit.all()
    assert not trace(Rays(np.tile(np.float32([0, 0, -height]), (64, 1)), down)).hit.any()


def test_no_rays_give_no_hits(fresh_file):
    hits = trace(Rays(np.zeros((0, 3), np.float32), np.zeros((0, 3), np.float32)))
    assert hits.radiance.shape == (0, 3)
    assert hits.hit.shape == (0,)


def test_every_bundle_size_keeps_the_order(fresh_file, rng, monkeypatch):
    """Rows, padding and parts: ray i must get answer i."""
    from reflect_addon.scene import raytrace

    add_mesh("Floor", [(-50, -50, 0), (50, -50, 0), (50, 50, 0), (-50, 50, 0)], [(0, 1, 2, 3)])
    monkeypatch.setattr(raytrace, "PATHS_PER_RENDER", 700)
    monkeypatch.setattr(raytrace, "FEWEST_RAYS", 700)
    monkeypatch.setattr(raytrace, "COLUMNS", 64)
    for count in (1, 2, 63, 64, 65, 700, 701, 2111):
        origin = np.column_stack([rng.uniform(20, 40, (count, 2)), np.full(count, 1.0)]).astype(np.float32)
        hits = trace(Rays(origin, np.tile(np.float32([0, 0, -1]), (count, 1))))
        np.testing.assert_allclose(hits.position, origin * [1, 1, 0], atol=2e-5)


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_rays_that_are_not_finite_are_refused(fresh_file, bad):
    with pytest.raises(ValueError, match="finite"):
        trace(Rays(np.full((2, 3), bad, np.float32), np.ones((2, 3), np.float32)))
    with pytest.raises(ValueError, match="direction"):
        trace(Rays(np.ones((2, 3), np.float32), np.zeros((2, 3), np.float32)))
