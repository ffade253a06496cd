"""Lamps have the shape that Cycles shows in mirrors: rays see light exactly where they meet the lamp's mesh."""

import numpy as np
import pytest

from reflect_addon.core.rays import Rays
from reflect_addon.scene.intersect import intersector
from reflect_addon.scene.raytrace import trace
from reflect_addon.scene.snapshot import take_snapshot

AREA = {"SQUARE": (1.0, 1.0), "RECTANGLE": (1.0, 0.4), "DISK": (0.8, 0.8), "ELLIPSE": (1.2, 0.5)}


def lamp(bpy, kind, **settings):
    data = bpy.data.lights.new("Lamp", kind)
    data.energy = 100
    for name, value in settings.items():
        setattr(data, name, value)
    obj = bpy.data.objects.new("Lamp", data)
    obj.location, obj.rotation_euler = (0.3, -0.2, 2.0), (0.3, 0.2, 0.5)
    bpy.context.scene.collection.objects.link(obj)
    return take_snapshot(bpy.context.evaluated_depsgraph_get())


@pytest.mark.parametrize("shape", AREA)
def test_area_lamps(fresh_file, rng, shape):
    size, size_y = AREA[shape]
    agree(lamp(fresh_file, "AREA", shape=shape, size=size, size_y=size_y), rng)


def test_ball_lamps(fresh_file, rng):
    agree(lamp(fresh_file, "POINT", shadow_soft_size=0.4), rng)


def test_lamps_without_size_have_no_shape(fresh_file):
    assert lamp(fresh_file, "POINT", shadow_soft_size=0.0).lamps == ()
    assert lamp(fresh_file, "SUN").lamps == ()


def test_meshes_after_a_lamp_keep_their_place(fresh_file):
    """Lamps and objects share one list of meshes; the fingerprint must count them alike."""
    lamp(fresh_file, "POINT", shadow_soft_size=0.1)
    fresh_file.ops.mesh.primitive_cube_add()
    snapshot = take_snapshot(fresh_file.context.evaluated_depsgraph_get())
    assert [len(snapshot.meshes[i.mesh].triangles) for i in snapshot.instances] == [12]


def agree(snapshot, rng):
    """4000 rays from all around at a ball about the lamp: light where the mesh is met from its front."""
    (instance,) = snapshot.lamps
    target = np.array([0.3, -0.2, 2.0]) + rng.uniform(-0.8, 0.8, (4000, 3))
    start = np.array([0.3, -0.2, 2.0]) + 3 * _unit(rng.normal(size=(4000, 3)))
    direction = _unit(target - start)
    rays = Rays(start.astype(np.float32), direction.astype(np.float32))
    met = np.isfinite(intersector(snapshot)(instance, rays))
    if len(snapshot.meshes[instance.mesh].triangles) < 100:  # an area lamp shines to one side
        normal = instance.world_from_object[:3, :3] @ snapshot.meshes[instance.mesh].corner_normals[0, 0]
        met &= direction @ normal < 0
    lit = trace(rays).radiance.max(-1) > 0
    assert 0.02 < met.mean() < 0.9
    # The rims of round lamps are polygons here and circles in Cycles.
    assert (met != lit).mean() < 0.01


def _unit(v):
    return v / np.linalg.norm(v, axis=-1, keepdims=True)
