"""Where the scene's camera is over the frames: what a cell that holds the camera is made around."""

import bpy
import numpy as np
import pytest

from reflect_addon.core.errors import ReflectError
from reflect_addon.core.job import BakeJob
from reflect_addon.core.methods import light_field
from reflect_addon.scene.snapshot import take_snapshot
from reflect_addon.scene.ways import camera_way


@pytest.fixture
def scene(fresh_file):
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end = 1, 5
    for name, place in (("First", (1, 2, 3)), ("Second", (-4, 0, 9))):
        camera = bpy.data.objects.new(name, bpy.data.cameras.new(name))
        camera.location = place
        scene.collection.objects.link(camera)
    scene.camera = scene.objects["First"]
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.5, location=(1, 2, 1))
    return scene


def snapshot():
    return take_snapshot(bpy.context.evaluated_depsgraph_get())


def test_a_camera_that_stands_still(scene):
    assert snapshot().camera == (1, 2, 3)
    assert np.array_equal(camera_way(snapshot()), [[1, 2, 3]] * 2)


def test_one_that_moves_with_its_parent(scene):
    parent = bpy.data.objects.new("Dolly", None)
    scene.collection.objects.link(parent)
    scene.camera.parent = parent
    for frame, x in ((1, 0), (5, -3)):
        parent.location.x = x
        parent.keyframe_insert("location", frame=frame)
    scene.frame_set(2)
    before = snapshot().camera
    assert np.allclose(camera_way(snapshot()), [[-2, 2, 3], [1, 2, 3]])
    assert scene.frame_current == 2 and snapshot().camera == before


def test_markers_change_the_camera(scene):
    for frame, name in ((1, "First"), (3, "Second")):
        scene.timeline_markers.new(name, frame=frame).camera = scene.objects[name]
    scene.frame_set(1)
    assert np.allclose(camera_way(snapshot()), [[-4, 0, 3], [1, 2, 9]])
    assert scene.camera.name == "First"


def test_a_scene_without_a_camera(scene):
    scene.camera = None
    assert snapshot().camera is None and camera_way(snapshot()) is None
    seen = snapshot()
    job = BakeJob(seen, seen.instances[0], None, None, {**light_field.DEFAULTS, "cameras": True})
    with pytest.raises(ReflectError, match="no camera"):
        light_field.plan(job)


def test_the_cell_holds_the_whole_way_or_the_place_of_this_frame(scene):
    for frame, z in ((1, 3), (5, 7)):
        scene.camera.location.z = z
        scene.camera.keyframe_insert("location", frame=frame)
    scene.frame_set(1)
    seen = snapshot()
    for whole, top in ((True, 7), (False, 3)):
        settings = {**light_field.DEFAULTS, "cameras": True, "whole_path": whole}
        job = BakeJob(seen, seen.instances[0], None, None, settings, camera_bounds=lambda: camera_way(seen))
        cell = light_field.plan(job)[0]
        assert (cell.center + cell.half)[2] == pytest.approx(top, abs=1e-5)
