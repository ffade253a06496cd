"""Ray map, reflection buffer, resolve: one snapshot with its assets (scene_on_gpu.py), drawn from any camera.

Moving the camera uploads and compiles nothing but what is then seen for the first time.
"""

from collections.abc import Callable

import numpy as np

from ..core import lobe_rays, pixel_rays
from ..core.asset import Asset
from ..core.camera import Camera
from ..core.look import Look
from ..core.rays import Answer, RayMap
from ..core.reflection_tree import Tree
from ..core.snapshot import SceneSnapshot
from .answers import Answers
from .counts import Counts
from .device import ensure
from .levels import Levels
from .program import Program
from .reflection_passes import ReflectionPasses
from .resolve import Resolve
from .scene_on_gpu import SceneOnGpu
from .state import drawing_state, scissored
from .targets import ReflectionTarget
from .texture_cache import TextureCache
from .timing import Work
from .upload import read_texture, texture_from

Window = tuple[int, int, int, int]


def registered_kernel(kind: str) -> Callable:
    """The trace function of a registered method."""
    from ..core import methods

    return methods.get(kind).trace


class Renderer:
    """assets: by reflector (core.asset.asset_of), already joined with what they require.
    look: None leaves exposure 0 and the Standard view. attenuation: half distance in metres, None = off.
    surfaces: the scene's surface radiance (core/surface_asset.py), from which stand-ins follow what moves.
    most_rays: of a pixel of a rough reflector (core/lobe_rays.py); most_along: of a curved one (core/pixel_rays.py)."""

    def __init__(
        self,
        snapshot: SceneSnapshot,
        assets: dict[str, Asset],
        look: Look | None = None,
        attenuation: float | None = None,
        kernel: Callable[[str], Callable] = registered_kernel,
        surfaces: Asset | None = None,
        most_rays: int = lobe_rays.LIVE,
        most_along: int = pixel_rays.LIVE,
        resolve: type[Resolve] = Resolve,
    ):
        self.gpu = ensure()
        self._counts = Counts()
        textures = TextureCache(self._counts)
        self._answers = Answers(self.gpu, self._counts, textures, kernel, most_rays, most_along)
        self.scene = SceneOnGpu(assets, surfaces, look or Look(), attenuation, textures, self._answers, resolve, self._counts)
        self.scene.update(snapshot)
        self._passes = ReflectionPasses(self.gpu, self.scene, self._answers, self._counts)

    def prepare(self, overlay: bool = False):
        """SceneOnGpu's."""
        self.scene.prepare(self._passes.beside(False), overlay)

    @property
    def reflector_names(self) -> tuple[str, ...]:
        return tuple(i.name for i in self.scene.snapshot.reflectors())

    # The three steps.

    def ray_map(self, camera: Camera) -> RayMap:
        """The rays of the visible reflector pixels, read back."""
        with drawing_state():
            return self._passes.draw_rays(camera).read(self.reflector_names, self._counts)

    def coarse_ray_map(self, camera: Camera, step: int) -> RayMap:
        """The rays of every step-th pixel along each side, read back; what is kept for whole pictures stays as it is."""
        with drawing_state():
            return self._passes.draw_coarse_rays(camera, step).read(self.reflector_names, self._counts)

    def answer(self, camera: Camera, positions: bool = True, background: Asset | None = None, footprints: bool = True) -> Answer:
        """The reflection buffer, (H, W, ...); zeros (STATUS_NONE) where no reflector is seen or none has an asset; where none is
        seen, the answer of the asset `background` to the camera's own rays (core/background.py).

        Without positions, position and status are zeros: they are not computed. Without footprints each pixel's ray is a line, to be
        compared with what rays meet."""
        with drawing_state(), self._passes.footprints(footprints):
            self._passes.draw_rays(camera, background)
            target = self._passes.draw_answers(camera, positions, background)
            radiance = read_texture(target.radiance_tx, self._counts)
            if positions:
                position = read_texture(target.position_tx, self._counts)
            else:
                position = np.zeros_like(radiance)
        return Answer(
            radiance[..., :3].copy(), radiance[..., 3].copy(), position[..., :3].copy(), position[..., 3].copy()
        )

    def picture(self, camera: Camera, background: np.ndarray | Asset | None = None, space: str = "linear") -> np.ndarray:
        """(H, W, 4) float32, row 0 at the bottom: background ((H, W, 3) scene-linear: all but the mirror-like part of
        the reflectors) plus reflections; space 'linear', or 'display' (developed and encoded, for a PNG).

        background: an asset answers the camera's own rays where no reflector is seen; reflections then lie over black.
        Without one alpha is 1 on reflectors and 0 elsewhere."""
        asset = background if isinstance(background, Asset) else None
        with drawing_state():
            self._passes.draw_rays(camera, asset)
            answers = self._passes.draw_answers(camera, False, asset)
            return self.scene.resolve.composite(
                self.gpu, self._passes.batch, self._passes.rays, answers, self.scene.materials, self.scene.look, space, background, self._bounds(camera)
            )

    def draw_overlay(self, camera: Camera, depth_bias: float = 1e-5, background: Asset | None = None, window: Window | None = None):
        """Draw the reflectors into the framebuffer that is bound, against its depth; see glsl/overlay.frag.glsl. Behind them
        what the asset `background` answers, over all that is there. window: (x, y, width, height) px, nothing outside it is drawn."""
        with drawing_state() as gpu:
            self._passes.draw_rays(camera, background)
            answers = self._passes.draw_answers(camera, False, background)
            if background is not None:
                with scissored(gpu, window):
                    gpu.state.blend_set("ALPHA_PREMULT")
                    gpu.state.depth_test_set("NONE")
                    self.scene.resolve.draw_background(self._passes.batch, self._passes.rays, answers, self.scene.look)
            self.draw_answers(camera, depth_bias, answers, window)

    def draw_answers(self, camera: Camera, depth_bias: float, answers: ReflectionTarget, window: Window | None = None):
        """draw_overlay's last step: the reflectors with these answers to the rays that were drawn last, which must be this camera's."""
        if self.scene.raymap.sections:
            bind = lambda shader: self.scene.resolve.bind_overlay(shader, self._passes.rays, answers, self.scene.materials, self.scene.look)
            self.draw_surfaces(camera, depth_bias, self.scene.resolve.overlay_program(), bind, window)

    def target_of(self, picture: np.ndarray) -> ReflectionTarget:
        """Answers from elsewhere, (H, W, 4): scene-linear radiance and coverage. They do not fade with distance."""
        target = ReflectionTarget(picture.shape[1], picture.shape[0], self._passes.beside(False), self._counts)
        target.clear()
        target.radiance_tx = texture_from("answers_tx", picture, self._counts)
        return target

    def draw_surfaces(
        self, camera: Camera, depth_bias: float, shader: Program, bind: Callable[[Program], object], window: Window | None = None
    ):
        """The reflectors again, into the framebuffer that is bound and against its depth, by a program of raymap.surface_info's; bind sets
        what it needs besides. window: as draw_overlay's."""
        with drawing_state() as gpu, scissored(gpu, window):
            self._passes.view.set(camera, depth_bias)
            gpu.state.depth_mask_set(False)
            gpu.state.face_culling_set("NONE")
            gpu.state.blend_set("ALPHA_PREMULT")
            gpu.state.depth_test_set("LESS_EQUAL")
            self.scene.raymap.draw_sections(self._passes.view, shader, bind)

    def _bounds(self, camera: Camera) -> tuple[int, int, int, int] | None:
        """What all reflectors together may cover; see RayMapPass.screen_bounds."""
        return self.scene.raymap.screen_bounds(camera, range(len(self.scene.snapshot.reflectors())))

    # What it costs.

    def work(self, camera: Camera) -> Work:
        """The reflection passes of one frame, ray map to resolve, for timing.py."""
        target = self.gpu.types.GPUTexture((camera.width, camera.height), format="RGBA32F")
        reader = self.gpu.types.GPUFrameBuffer(color_slots=[target])

        def submit():
            with drawing_state() as gpu:
                self._passes.draw_rays(camera)
                answers = self._passes.draw_answers(camera, False)
                self.scene.resolve.draw_composite(
                    gpu, self._passes.batch, self._passes.rays, answers, self.scene.materials, self.scene.look, "display", None, self._bounds(camera), target
                )

        def finish():
            with reader.bind():
                reader.read_color(0, 0, 1, 1, 4, 0, "FLOAT")

        return Work(submit, finish)

    def counts(self) -> dict[str, int]:
        """Work since this renderer was made, see gpu/counts.py."""
        return self._counts.as_dict()

    def bytes(self) -> int:
        """Memory on the GPU: meshes, assets' images, buffers; without the shaders."""
        return self.scene.bytes() + self._passes.bytes()

    @property
    def mirrored_views(self) -> Tree | None:
        """The schedule of the last picture's mirrors in mirrors; None where none is drawn."""
        return self._answers.levels.tree

    @property
    def mirrors(self) -> Levels:
        """Its mirrored views and cube maps."""
        return self._answers.levels

    @property
    def settled(self) -> bool:
        """Whether the next picture shows what this one does, as nothing moved and every cube map is what it should be."""
        return self._answers.levels.maps.settled

    def settle(self, camera: Camera):
        """Makes all cube maps that are due, however many frames a window would take: for a picture of a scene at rest."""
        due = True
        while due:
            with drawing_state():
                self._passes.plan(camera)
            due = not self.settled

    def virtual_statuses(self, camera: Camera) -> dict[str, int]:
        """Vertices of a frame by what is known of them (core/virtual_status.py), searched or interpolated, of what reflectors may show;
        `counts` has all searches of this frame."""
        self._answers.projector.tally = found = {}
        try:
            self.answer(camera, positions=False)
        finally:
            self._answers.projector.tally = None
        return found

    def shader_source(self, asset: Asset, positions: bool = False) -> str:
        """The emitted kernel of an asset as this renderer compiles it."""
        return self._answers.fill(asset, self._passes.beside(positions)).source

    def free(self):
        """Let go of every texture and buffer. It cannot draw afterwards; shaders stay in the session's cache."""
        self.gpu.shader.unbind()
        self._passes.free()
        self.scene.free()
