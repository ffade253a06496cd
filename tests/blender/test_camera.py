"""camera_of against the only authority: where Cycles' own rays through the pixels of that camera go."""

import bpy
import numpy as np
import pytest
from blender_scenes import add_mesh, emission
from mathutils import Euler
from tolerances import CAMERA_PIXELS

from reflect_addon.core.errors import ReflectError
from reflect_addon.scene.camera import camera_of
from reflect_addon.scene.exr import read_exr, stacked

CASES = {
    "plain": {},
    "tele": {"lens": 135},
    "shifted": {"shift_x": 0.3, "shift_y": -0.2},
    "vertical fit": {"sensor_fit": "VERTICAL", "sensor_height": 30},
    "horizontal fit": {"sensor_fit": "HORIZONTAL"},
    "ortho": {"type": "ORTHO", "ortho_scale": 5},
    "ortho shifted": {"type": "ORTHO", "ortho_scale": 5, "shift_x": 0.2, "shift_y": 0.1},
}


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("size", [(64, 40), (40, 64)])
def test_pixels_are_where_cycles_has_them(fresh_file, tmp_path, case, size):
    scene = bpy.context.scene
    data = bpy.data.cameras.new("View")
    for name, value in CASES[case].items():
        setattr(data, name, value)
    eye = bpy.data.objects.new("View", data)
    parent = bpy.data.objects.new("Rig", None)
    parent.scale = (2, 2, 2)  # a scaled rig must not scale the picture
    eye.parent = parent
    eye.location, eye.rotation_euler = (0.2, -3, 2), Euler((0.9, 0.2, 0.1))
    for obj in (eye, parent):
        scene.collection.objects.link(obj)
    scene.camera = eye
    add_mesh("Floor", [(-500, -500, 0), (500, -500, 0), (500, 500, 0), (-500, 500, 0)], [(0, 1, 2, 3)],
             material=emission("Glow", (1, 1, 1)))  # fmt: skip
    camera = camera_of(scene, None, *size)

    scene.render.engine, scene.cycles.samples = "CYCLES", 1
    scene.cycles.use_denoising = scene.cycles.use_adaptive_sampling = False
    scene.cycles.pixel_filter_type, scene.cycles.filter_width = "BLACKMAN_HARRIS", 0.01
    scene.render.resolution_x, scene.render.resolution_y = size
    bpy.context.view_layer.use_pass_position = True
    image = scene.render.image_settings
    image.media_type = "MULTI_LAYER_IMAGE"
    image.file_format, image.color_depth, image.use_exr_interleave = "OPEN_EXR_MULTILAYER", "32", True
    scene.render.filepath = str(tmp_path / "position.exr")
    bpy.ops.render.render(write_still=True)
    channels = read_exr(tmp_path / "position.exr")
    position, seen = stacked(channels, "Position", "XYZ").reshape(-1, 3), channels["Combined.R"].ravel() > 0.5
    assert seen.sum() > 1000

    clip = np.column_stack([position[seen], np.ones(seen.sum())]) @ camera.clip_from_world().T
    pixel = (clip[:, :2] / clip[:, 3:] + 1) / 2 * size
    y, x = np.divmod(np.flatnonzero(seen), size[0])
    error = np.abs(pixel - np.column_stack([x, y]) - 0.5)
    assert error.max() < CAMERA_PIXELS
    # And our own rays through the pixels meet the floor there.
    rays = camera.primary_rays()
    along = -rays.origin[seen, 2] / rays.direction[seen, 2]
    ours = rays.origin[seen] + along[:, None] * rays.direction[seen]
    far = np.linalg.norm(position[seen] - rays.origin[seen], axis=1)
    assert (np.linalg.norm(ours - position[seen], axis=1) < 2e-3 * far / np.abs(rays.direction[seen, 2])).all()


def test_what_is_no_camera_says_so(fresh_file):
    scene = bpy.context.scene
    with pytest.raises(ReflectError, match="no camera"):
        camera_of(scene, None, 8, 8)
    empty = bpy.data.objects.new("Rig", None)
    with pytest.raises(ReflectError, match="Rig is not a camera"):
        camera_of(scene, empty, 8, 8)
    data = bpy.data.cameras.new("Fish")
    data.type = "PANO"
    with pytest.raises(ReflectError, match="Fish"):
        camera_of(scene, bpy.data.objects.new("Fish", data), 8, 8)
