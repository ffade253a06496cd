"""The mesh that is reflected: whole, fine where curved mirrors look, in chunks; and which chunks a piece of a reflector may show."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh
from analytic import directions, rotation, unit
from mesh_scenes import smooth_mirror, snapshot, tracer
from virtual_scenes import SURFACES, ball, paint

from reflect_addon.core import surface_radiance
from reflect_addon.core.map_space import map_space
from reflect_addon.core.part_pieces import WIDEST, half_angle, pieces_of
from reflect_addon.core.surface_asset import meshes_of
from reflect_addon.core.virtual_cull import may_show, runs
from reflect_addon.core.virtual_mesh import CHUNK, virtual_mesh


def scene_of(mirror, **more):
    found = snapshot(mirror, Floor=trimesh.creation.box((6, 6, 0.01)), Crate=trimesh.creation.box((1, 1, 1)).apply_translation((2, 0, 1)), **more)
    return replace(found, light_hash="day")


def mesh_of(scene, **settings):
    surfaces = meshes_of(surface_radiance.bake(scene, tracer(scene, paint), scene.instances, {**SURFACES, "surface_levels": 0}))
    return virtual_mesh(scene, surfaces, **settings)


@pytest.fixture(scope="module")
def found():
    scene = scene_of(ball())
    return scene, mesh_of(scene)


def world(scene, mesh):
    named = scene.named()
    matrices = np.stack([named[name].world_from_object for name in mesh.names])[mesh.instance]
    return np.einsum("vij,vj->vi", matrices[:, :3, :3], mesh.positions.astype(float)) + matrices[:, :3, 3]


def test_edges_are_narrow_as_seen_from_a_curved_mirror(found):
    scene, mesh = found
    at = world(scene, mesh)[mesh.triangles]
    length = np.linalg.norm(at - at[:, [1, 2, 0]], axis=-1)
    apart = np.minimum(*(np.linalg.norm(p - np.clip(p, [-0.5, -0.5, 0], [0.5, 0.5, 1]), axis=-1) for p in (at, at[:, [1, 2, 0]])))
    assert (length / np.maximum(apart, 0.25)).max() <= 0.2 * 1.001


def test_no_edge_is_split_on_one_side_alone(found):
    """Every edge of a closed box belongs to two triangles, by the places of its ends."""
    scene, mesh = found
    at, named = world(scene, mesh), mesh.names.index("Crate")
    triangles = mesh.triangles[mesh.instance[mesh.triangles[:, 0]] == named]
    place = np.unique(np.round(at, 6), axis=0, return_inverse=True)[1].ravel()[triangles]
    edges = np.sort(np.concatenate([place[:, [0, 1]], place[:, [1, 2]], place[:, [2, 0]]]), 1)
    assert set(np.unique(edges, axis=0, return_counts=True)[1].tolist()) == {2}
    area = np.linalg.norm(np.cross(at[triangles[:, 1]] - at[triangles[:, 0]], at[triangles[:, 2]] - at[triangles[:, 0]]), axis=1).sum() / 2
    assert area == pytest.approx(6.0, rel=1e-5)


def test_nothing_is_split_for_flat_mirrors():
    scene = scene_of(trimesh.creation.box((1, 1, 1)).apply_translation((0, 0, 2)))
    assert len(mesh_of(scene).triangles) == 3 * 12


def test_chunks_hold_all_once(found):
    _, mesh = found
    first_vertex, vertices, first, count = mesh.chunks.T
    assert count.max() <= CHUNK and np.array_equal(np.cumsum(count), first + count) and count.sum() == len(mesh.triangles)
    assert np.array_equal(np.cumsum(vertices), first_vertex + vertices) and vertices.sum() == len(mesh.positions)
    for row, ball_of, instance in zip(mesh.chunks, mesh.chunk_ball, mesh.chunk_instance, strict=True):
        own = mesh.triangles[row[2] : row[2] + row[3]]
        assert own.min() >= row[0] and own.max() < row[0] + row[1] and (mesh.instance[own] == instance).all()
        assert np.linalg.norm(mesh.positions[own] - ball_of[:3], axis=-1).max() <= ball_of[3] * 1.0001 + 1e-6


def test_a_scene_without_surfaces_has_no_triangles():
    scene = scene_of(ball())
    mesh = virtual_mesh(scene, {})
    assert len(mesh.triangles) == 0 and len(mesh.chunks) == 0


def test_runs_join_neighbours(found):
    _, mesh = found
    chosen = np.zeros(len(mesh.chunks), bool)
    chosen[[1, 2, 5]] = True
    vertices, triangles = runs(chosen, mesh.chunks)
    assert [n for _, n in triangles] == [mesh.chunks[1:3, 3].sum(), mesh.chunks[5, 3]] and vertices[0][0] == mesh.chunks[1, 0]
    assert runs(chosen & False, mesh.chunks) == ([], [])


def test_what_a_piece_reflects_is_never_left_out(rng):
    """Points along reflected rays of random caps of a ball, as chunks without a size and with one."""
    for _ in range(60):
        axis, cosine, eye = directions(rng, 27)[-1], rng.uniform(-0.3, 0.95), directions(rng, 27)[-1] * rng.uniform(1.3, 6)
        normal = unit(rng.normal(size=(2000, 3)))
        normal = normal[(normal @ axis > cosine) & (((eye - normal) * normal).sum(1) > 0)]
        if len(normal) < 5:
            continue
        away = unit(normal - eye)
        reflected = away - 2 * (away * normal).sum(1, keepdims=True) * normal
        points = normal + reflected * rng.uniform(0.01, 8, (len(normal), 1))
        middle = (normal.min(0) + normal.max(0)) / 2
        around = np.append(middle, np.linalg.norm(normal - middle, axis=1).max())
        chunks = np.column_stack([points, np.zeros(len(points))])
        assert may_show(around, np.append(axis, cosine), 1.0, np.append(eye, 1), chunks).all()
        off = directions(rng, len(points)) * rng.uniform(0, 0.5, (len(points), 1))
        chunks = np.column_stack([points + off, np.linalg.norm(off, axis=1) * 1.001])
        assert may_show(around, np.append(axis, cosine), 1.0, np.append(eye, 1), chunks).all()


def test_much_is_left_out(rng):
    chunks = np.column_stack([directions(rng, 500) * 5, np.full(500, 0.1)])
    shown = may_show(np.array([0.9, 0, 0, 0.3]), np.array([1.0, 0, 0, np.cos(0.3)]), 1.0, np.array([4.0, 0, 0, 1]), chunks)
    assert 0.05 < shown.mean() < 0.5


def test_pieces_are_narrow_and_hold_all(rng):
    shape = trimesh.creation.torus(1.0, 0.4)
    area = shape.area_faces
    pieces = pieces_of(shape.triangles_center, shape.face_normals, area, 200)
    assert sorted(np.concatenate(pieces).tolist()) == list(range(len(area)))
    assert max(half_angle(shape.face_normals[p], area[p])[1] for p in pieces) <= WIDEST
    assert len(pieces_of(shape.triangles_center, shape.face_normals, area, 6)) == 6
    assert [len(p) for p in pieces_of(shape.triangles_center[:1], shape.face_normals[:1], area[:1], 6)] == [1]


@pytest.mark.parametrize("size", [1e-4, 1.0, 1e5])
def test_map_space_goes_with_the_reflector(size, rng):
    """A point that is fixed to the reflector stays where it is in map space, however both move together."""
    baked = np.eye(4)
    baked[:3, :3], baked[:3, 3] = rotation(rng) * 2, rng.normal(size=3) * size
    now = np.eye(4)
    now[:3, :3], now[:3, 3] = rotation(rng) * 2, rng.normal(size=3) * 10 * size
    local, center = rng.normal(size=(20, 3)) * size, baked[:3, 3] + size
    before, after = (map_space(center, size, baked, place) for place in (baked, now))
    np.testing.assert_allclose(
        before.points(local @ baked[:3, :3].T + baked[:3, 3]), after.points(local @ now[:3, :3].T + now[:3, 3]), atol=1e-9
    )
    assert after.units_per_metre == pytest.approx(1 / size)
    np.testing.assert_allclose(after.from_objects(now[None])[0] @ np.append(local[0], 1), after.points(now[:3, :3] @ local[0] + now[:3, 3]), atol=1e-9)


def test_a_smooth_mirror_bends(found):
    """What counts is the shading: a box that is shaded smooth bends edges too."""
    scene = scene_of(smooth_mirror(trimesh.creation.box((1, 1, 1))))
    assert len(mesh_of(scene).triangles) > 3 * 12
