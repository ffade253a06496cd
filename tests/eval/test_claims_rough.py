"""Issue 3, point 9: on a rough floor the reflection of a leg is sharp where it stands and soft further up, as in Cycles."""

import bpy
import numpy as np
import pytest
import tolerances
from blender_scenes import emission, set_world

from reflect_addon.evaluation.render import render_picture
from reflect_addon.scene.camera import camera_of
from reflect_addon.scene.raytrace import primary

SIDE = 64
CONTACT, FARTHER = 36, (32, 26, 20)  # rows of the picture: the leg's foot is in row 37


@pytest.fixture
def leg_on_a_rough_floor(fresh_file):
    set_world((0.02, 0.02, 0.02))
    floor = bpy.data.materials.new("Floor")
    shader = floor.node_tree.nodes["Principled BSDF"]
    for name, value in (("Metallic", 1.0), ("Roughness", 0.3), ("Base Color", (1, 1, 1, 1))):
        shader.inputs[name].default_value = value
    bpy.ops.mesh.primitive_plane_add(size=12)
    bpy.context.object.data.materials.append(floor)
    bpy.ops.mesh.primitive_cylinder_add(vertices=48, radius=0.12, depth=2, location=(0, 0, 1))
    bpy.context.object.data.materials.append(emission("Leg", (1, 1, 1)))
    scene = bpy.context.scene
    scene.camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.collection.objects.link(scene.camera)
    scene.camera.location, scene.camera.rotation_euler = (0, -6, 3), (1.05, 0, 0)
    return scene


def width(row):
    """px between which the middle two thirds of a row's light lie, beyond the world's own."""
    light = np.cumsum(row.mean(-1) - 0.02)
    low, high = np.interp([light[-1] / 6, light[-1] * 5 / 6], light, np.arange(len(light)))
    return high - low


def test_sharp_at_the_foot_soft_further_up(leg_on_a_rough_floor, device, tmp_path, record_property):
    scene = leg_on_a_rough_floor
    out = tmp_path / "leg.exr"
    render_picture(scene, "depth_maps", (SIDE, SIDE), out, samples=4, settings={"resolution": 16, "samples": 1})
    image = bpy.data.images.load(str(out))
    ours = np.asarray(image.pixels[:]).reshape(SIDE, SIDE, 4)[..., :3]
    bpy.data.images.remove(image)
    truth = primary(camera_of(scene, None, SIDE, SIDE), samples=256, scene=scene).combined
    assert width(truth[FARTHER[-1]]) > 1.5 * width(truth[CONTACT]), "the scene shows what it is for"
    for row in (CONTACT, *FARTHER):
        assert width(ours[row]) == pytest.approx(width(truth[row]), rel=tolerances.ROUGH_WIDTH), row
        assert ours[row].mean() == pytest.approx(truth[row].mean(), rel=tolerances.ROUGH_LIGHT), row
