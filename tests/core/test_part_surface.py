"""The surface of a part along rays from its centre, against Embree."""

import time

import numpy as np
import pytest
import reflector_shapes as shapes
import trimesh
from analytic import directions, unit
from mesh_scenes import first_hits
from tolerances import PART_RAY, PART_RAYS_ON_EDGES, PART_SECONDS

from reflect_addon.core.part_surface import surface_of_part
from reflect_addon.core.reflector_parts import part_surface, parts_of


@pytest.mark.parametrize("name", ["ellipsoid", "torus", "bowl", "bevelled_cube"])
def test_distances_and_normals_are_embrees(name, rng):
    """Of parts that have one layer; which they do."""
    mesh = positions, triangles, normals = getattr(shapes, name)()
    d = directions(rng, 20000)
    for part in parts_of(*mesh)[:4]:
        mine = trimesh.Trimesh(positions, triangles[part.triangles], process=False)
        which, distance = first_hits(mine, np.broadcast_to(part.center, d.shape), d)
        ours, normal, inside = part_surface(part, *mesh)(d)
        both = inside & (which >= 0)
        assert (inside != (which >= 0)).mean() <= PART_RAYS_ON_EDGES
        same = np.abs(ours[both] - distance[both]) < PART_RAY * part.size
        assert (~same).mean() <= PART_RAYS_ON_EDGES
        point = part.center + ours[both, None] * d[both]
        weight = trimesh.triangles.points_to_barycentric(mine.triangles[which[both]], point, method="cross")
        true = unit(np.einsum("nk,nkx->nx", weight, normals[part.triangles][which[both]]))
        assert np.abs(normal[both] - true)[same].max() < 1e-6
        assert not normal[~inside].any() and not ours[~inside].any()


def test_no_ray_slips_between_two_triangles(rng):
    """Rays at edges and corners exactly, and a hair beside them."""
    positions, triangles, normals = shapes.ellipsoid((1, 0.6, 0.4))
    corners = positions[triangles]
    share = rng.random((len(corners), 1))
    edge = share * corners[:, 0] + (1 - share) * corners[:, 1]
    d = np.concatenate([positions, edge, edge + 1e-12 * rng.normal(size=edge.shape)])
    distance, _, inside = surface_of_part(np.zeros(3), False, corners, normals)(d)
    assert inside.all()
    assert np.allclose(distance[: len(positions)], np.linalg.norm(positions, axis=-1), rtol=1e-9)


def test_the_layer_is_the_one_that_is_seen():
    """The farthest of two shells where they mirror outwards, the nearest where they mirror towards the centre."""
    inner, outer = shapes.ellipsoid(), shapes.ellipsoid((2, 2, 2))
    both = shapes.joined(inner, outer)
    d = unit(outer[0])
    for reverse, radius in ((False, 2.0), (True, 1.0)):
        distance, normal, inside = surface_of_part(np.zeros(3), reverse, both[0][both[1]], both[2])(d)
        assert inside.all() and np.allclose(distance, radius, atol=1e-9)
        assert np.allclose(normal, d * (-1 if reverse else 1), atol=1e-6)


def test_no_triangles_and_a_centre_in_the_plane_meet_nothing(rng):
    d = directions(rng, 100)
    for corners in (np.zeros((0, 3, 3)), np.array([[[1.0, 0, 0], [0, 1, 0], [-1, -1, 0]]])):
        distance, normal, inside = surface_of_part(np.zeros(3), False, corners, np.ones_like(corners))(d)
        assert not inside.any() and not distance.any() and not normal.any()


def test_a_maps_worth_of_directions_takes_little_time(rng):
    mesh = shapes.ellipsoid((1, 0.6, 0.4), 72, 36)
    part = parts_of(*mesh)[0]
    d = rng.normal(size=(400_000, 3))
    start = time.process_time()
    _, _, inside = part_surface(part, *mesh)(d)
    assert inside.all() and time.process_time() - start < PART_SECONDS
