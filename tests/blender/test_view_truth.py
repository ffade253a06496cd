"""scene/view_truth.py: what another process traces is Cycles' answer to the view's own mirror rays, and nothing of it stays behind."""

import tempfile
from functools import partial
from pathlib import Path

import bpy
import numpy as np
import pytest
from scenes import sphere_in_box_room

from reflect_addon.core.errors import ReflectError
from reflect_addon.core.rays import Rays
from reflect_addon.core.reflected_samples import lifted
from reflect_addon.evaluation.frame import open_frame
from reflect_addon.scene.camera import camera_of
from reflect_addon.scene.raymap_numpy import numpy_ray_map
from reflect_addon.scene.raytrace import trace
from reflect_addon.scene.view_truth import PREFIX, Tracing


@pytest.fixture
def room(fresh_file, tmp_path):
    """(scene, a small camera): a mirror ball in a room that glows, so that there is no noise."""
    sphere_in_box_room()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "room.blend"))
    scene = bpy.context.scene
    return scene, camera_of(scene, None, 48, 36)


def left_behind():
    return list(Path(tempfile.gettempdir()).glob(f"{PREFIX}*"))


def test_another_process_traces_the_views_mirror_rays(room):
    scene, camera = room
    asked = Tracing(scene, camera)
    assert not asked.worker.wait(300).running
    found = asked.result()
    asked.close()
    assert not left_behind() and found.is_of(camera) and not found.is_of(camera.part(0, 0, 24, 36))
    with open_frame(scene, None) as snapshot:
        rays = numpy_ray_map(snapshot, camera)
        mask = rays.covered()
        some = Rays(lifted(rays.origin[mask], rays.normal[mask], snapshot.diagonal()), rays.direction[mask])
        wanted = partial(trace, scene=scene)(some, samples=4).radiance
    assert mask.sum() > 100 and np.array_equal(found.picture[..., 3] > 0.5, mask) and found.picture[~mask].max() == 0
    # A checker's border is one of both colours, by the sample.
    assert np.mean(np.abs(found.picture[mask][:, :3] - wanted).max(-1) < 1e-3) > 0.95


def test_a_worker_that_fails_is_told_and_leaves_nothing(room, tmp_path):
    scene, camera = room
    worker = tmp_path / "python-that-fails"
    worker.write_text("#!/bin/sh\nexit 3\n")
    worker.chmod(0o755)
    asked = Tracing(scene, camera, str(worker))
    asked.worker.wait(60)
    with pytest.raises(ReflectError, match="truth worker .* ended with status 3"):
        asked.result()
    asked.close()
    assert not left_behind()


def test_a_cancelled_one_leaves_nothing(room):
    asked = Tracing(*room)
    asked.close()
    assert not left_behind()
