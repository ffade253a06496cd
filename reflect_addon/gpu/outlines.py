"""The stand-ins of one reflector as lines in a 3D view (core/outlines.py): bright where they are seen, faint behind things."""

import numpy as np
from gpu_extras.batch import batch_for_shader
from mathutils import Matrix

from ..core import methods
from ..core.asset import Asset
from ..core.camera import Camera
from .device import ensure
from .state import drawing_state

COLOR, FAINT = (0.05, 0.65, 1.0), 0.25  # display-linear, and not what Blender marks a selection with; opacity behind things
LINE, POINT = 1.5, 8.0  # px
NEARER = 1e-4  # of the depth range: a quad lies on what it stands for


class OutlineBatch:
    """Uploaded once, and again where a table of it is another."""

    def __init__(self):
        self._of: tuple = (None, None)  # what it was made of, kept
        self._lines = self._points = None
        self._middle = np.zeros(3)

    def draw(self, asset: Asset, camera: Camera):
        """Inside the view's draw callback. asset: SceneOnGpu.asset_placed's."""
        made_of = asset.uniforms, asset.images.get("billboard_buf")
        if any(a is not b for a, b in zip(made_of, self._of, strict=True)):
            self._of = made_of
            self._upload(asset)
        with drawing_state() as gpu:
            gpu.state.blend_set("ALPHA")
            gpu.state.depth_mask_set(False)
            gpu.state.point_size_set(POINT)
            for test, alpha in (("NONE", FAINT), ("LESS_EQUAL", 1.0)):
                gpu.state.depth_test_set(test)
                self._draw(gpu, camera, alpha)
            gpu.state.point_size_set(1.0)

    def _upload(self, asset: Asset):
        found = methods.get(asset.kind).outlines(asset)
        ends = np.concatenate([found.lines.reshape(-1, 3), found.points])
        # About their own middle: float32 keeps its digits far from the world's origin.
        self._middle = ends.mean(0) if len(ends) else np.zeros(3)
        self._lines = self._batch("POLYLINE_UNIFORM_COLOR", "LINES", found.lines.reshape(-1, 3))
        self._points = self._batch("POINT_UNIFORM_COLOR", "POINTS", found.points)

    def _batch(self, name: str, kind: str, places: np.ndarray):
        shader = ensure().shader.from_builtin(name)
        local = (places - self._middle).astype(np.float32)
        return (shader, batch_for_shader(shader, kind, {"pos": local})) if len(places) else None

    def _draw(self, gpu, camera: Camera, alpha: float):
        view = np.linalg.inv(camera.world_from_camera)
        view[:3, 3] += view[:3, :3] @ self._middle
        clip = camera.clip_from_camera.copy()
        clip[2] -= NEARER * clip[3]
        with gpu.matrix.push_pop(), gpu.matrix.push_pop_projection():
            gpu.matrix.load_matrix(Matrix(view.tolist()))
            gpu.matrix.load_projection_matrix(Matrix(clip.tolist()))
            for found in (self._lines, self._points):
                if found is None:
                    continue
                shader, batch = found
                shader.bind()
                if found is self._lines:
                    shader.uniform_float("viewportSize", (camera.width, camera.height))
                    shader.uniform_float("lineWidth", LINE)
                shader.uniform_float("color", (*COLOR, alpha))
                batch.draw(shader)
