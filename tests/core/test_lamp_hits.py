"""core/lamp_hits.py: a lamp in front of a wall, seen from its shining side and from behind."""

from dataclasses import replace

import numpy as np
import trimesh
from mesh_scenes import intersect, snapshot, tracer

from reflect_addon.core.lamp_hits import with_lamps
from reflect_addon.core.rays import Rays


def test_lamps_end_rays_on_their_shining_side():
    ball = trimesh.creation.icosphere(2, 0.1).apply_translation([9, 9, 9])
    wall = trimesh.creation.box((0.1, 9, 9)).apply_translation([3, 0, 0])
    area = trimesh.Trimesh([[2, -1, -1], [2, 1, -1], [2, 1, 1], [2, -1, 1]], [[0, 2, 1], [0, 3, 2]], process=False)
    assert area.face_normals[0, 0] < 0
    bulb = trimesh.creation.icosphere(2, 0.2).apply_translation([2, 2, 0])
    scene = snapshot(ball, Wall=wall, Area=area, Bulb=bulb)
    scene = replace(scene, instances=scene.instances[:2], lamps=scene.instances[2:])
    rays = Rays(
        np.float32([[0, 0, 0], [2.5, 0, 0], [0, 2, 0], [0, 0, 3], [2.5, 0, 0]]),
        np.float32([[1, 0, 0], [-1, 0, 0], [1, 0, 0], [1, 0, 0], [0, 0, 1]]),
    )
    traced = tracer(replace(scene, lamps=()))(rays)
    found = with_lamps(traced, rays, scene, intersect(scene))
    assert np.allclose(found.position[0], [2, 0, 0], atol=1e-6) and np.allclose(found.normal[0], [-1, 0, 0])
    assert not found.hit[1], "from behind a lamp is not there"
    assert np.allclose(found.position[2], [1.8, 2, 0], atol=1e-2)
    assert found.position[3][0] == traced.position[3][0] and not found.hit[4]
    assert [found.object_names[i] for i in found.object[:4:2]] == ["Area", "Bulb"]
    assert np.array_equal(found.radiance, traced.radiance)
