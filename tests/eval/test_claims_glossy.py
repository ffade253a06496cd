"""Issue 3, point 7: a glossy ball beside a mirror ball, against Cycles. With shading at the hit its highlight is where
the reflected ray sees it."""

import bpy
import numpy as np
import pytest
import tolerances
import trimesh
from blender_scenes import add_mesh
from claims import Remembered, measure
from mathutils import Vector

from reflect_addon.core import metrics


def _ball(name, at, color, roughness, metallic):
    # Blender's own sphere has its faces in another order each time, and what a bake samples goes by that order.
    sphere = trimesh.creation.uv_sphere(0.6, (32, 64))
    obj = add_mesh(name, sphere.vertices.tolist(), sphere.faces.tolist())
    obj.location = at
    obj.data.polygons.foreach_set("use_smooth", np.ones(len(obj.data.polygons), bool))
    material = bpy.data.materials.new(name)
    shader = material.node_tree.nodes["Principled BSDF"]
    for socket, value in (("Base Color", (*color, 1)), ("Roughness", roughness), ("Metallic", metallic)):
        shader.inputs[socket].default_value = value
    obj.data.materials.append(material)
    return obj


def _look_at(obj, at, target):
    obj.location = at
    obj.rotation_euler = (Vector(target) - obj.location).to_track_quat("-Z", "Y").to_euler()
    bpy.context.scene.collection.objects.link(obj)


def stage(roughness, lamp):
    """A camera that looks at the reflection of a red ball in a mirror ball, under a lamp, on a matte floor."""
    scene = bpy.context.scene
    _ball("Mirror", (0, 0, 0.6), (1, 1, 1), 0.0, 1.0)
    _ball("Red", (1.5, -0.6, 0.6), (0.6, 0.03, 0.02), roughness, 0.0)
    bpy.ops.mesh.primitive_plane_add(size=8)
    light = bpy.data.lights.new("Lamp", lamp)
    light.energy = 3 if lamp == "SUN" else 150
    if lamp == "AREA":
        light.size = 0.7
    _look_at(bpy.data.objects.new("Lamp", light), (1.6, -2.4, 2.6), (0.8, -0.2, 0.3))
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.data.lens = 260
    _look_at(camera, (2.2, -4.5, 2.0), (0.22, -0.15, 0.55))
    scene.camera, scene.world = camera, bpy.data.worlds.new("World")
    scene.world.node_tree.nodes["Background"].inputs["Color"].default_value = (0.12, 0.15, 0.2, 1)


@pytest.mark.parametrize("roughness, lamp", [(0.21, "AREA"), *(pytest.param(*case, marks=pytest.mark.slow) for case in ((0.4, "POINT"), (0.3, "SUN")))])
def test_its_highlight_moves_with_the_eye(roughness, lamp, device, fresh_file, tmp_path, record_property):
    stage(roughness, lamp)
    errors, tracer = [], Remembered()
    for on in (False, True):
        settings = {"resolution": 64, "samples": 4, "texels": 128, "view_dependent": on}
        found = measure(("depth_maps",), tmp_path / str(on), (96, 72), 16, settings, tracer=tracer)
        red = found.truth.object == found.truth.object_names.index("Red")
        assert red.sum() > 300
        errors.append(metrics.rmse(found.answers["depth_maps"].radiance[red], found.truth.radiance[red]))
    record_property("rmse", errors)
    assert errors[1] < tolerances.GLOSSY_RMSE * errors[0]
