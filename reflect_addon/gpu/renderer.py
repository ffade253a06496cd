"""Ray map, reflection buffer, resolve: one snapshot with its assets, drawn from any camera.

What is visible is uploaded and compiled when it is first seen; `prepare` does it for everything. Moving the camera
after that uploads and compiles nothing.
"""

from collections.abc import Callable
from contextlib import contextmanager
from dataclasses import replace

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
from .follow import Followed, Followers
from .level_targets import Seen
from .levels import Levels
from .program import Program
from .raymap import RayMapPass
from .resolve import Resolve, ResolvePlan
from .resolve_tables import LookTexture, MaterialTable
from .state import drawing_state, scissored
from .targets import RayMapTarget, ReflectionTarget
from .texture_cache import TextureCache
from .timing import Work
from .upload import MeshBuffer, read_texture, texture_from, triangle_batch
from .view import View

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
        self._resolve_type = resolve
        self.attenuation = attenuation
        self._view = View()
        self._batch = triangle_batch()
        self._meshes: dict[str, MeshBuffer] = {}  # by content
        self._textures = TextureCache(self._counts)
        self._followers = Followers(self._counts, self._textures)
        self.followed = Followed()  # what the last update made again
        self._answers = Answers(self.gpu, self._counts, self._textures, kernel, most_rays, most_along)
        self._rays: RayMapTarget | None = None
        self._targets: dict[str | None, ReflectionTarget] = {}
        self._draws = False  # whether something is drawn into the reflection buffer, which then has depth
        self._look = LookTexture(look or Look(), self._counts)
        self._materials: MaterialTable | None = None
        self.assets = dict(assets)
        self.surfaces = surfaces
        self.update(snapshot)

    # What is drawn.

    def update(
        self, snapshot: SceneSnapshot, assets: dict[str, Asset] | None = None, surfaces: Asset | None = None
    ) -> dict[str, int | bool]:
        """Take another snapshot (and assets, with the surfaces that go with them); upload only what changed, and let stand-ins
        follow. Returns {'meshes': uploaded, 'dropped': meshes let go, 'materials': bool, 'assets': bool}."""
        changed = {"meshes": 0, "dropped": 0, "materials": False, "assets": False}
        if assets is not None and (
            assets.keys() != self.assets.keys() or any(assets[k] is not self.assets[k] for k in assets)
        ):
            self.assets = dict(assets)
            changed["assets"] = True
            self._answers.keep_only(assets.values())
            self._textures.keep_only(assets.values())
        if assets is not None:
            self.surfaces = surfaces
        self.snapshot = snapshot
        in_use: dict[str, MeshBuffer] = {}
        by_index: dict[int, MeshBuffer] = {}
        for index in {i.mesh for i in snapshot.instances}:
            key = snapshot.meshes[index].key
            buffer = in_use.get(key) or self._meshes.get(key)
            if buffer is None:
                buffer = MeshBuffer(snapshot.meshes[index], self._counts)
                changed["meshes"] += 1
            in_use[key] = by_index[index] = buffer
        changed["dropped"] = len(self._meshes.keys() - in_use.keys())
        self._meshes = in_use
        self._raymap = RayMapPass(snapshot, by_index, self._counts)
        materials = MaterialTable.rows_of(snapshot)
        if self._materials is None or not np.array_equal(self._materials.rows, materials):
            self._materials = MaterialTable(materials, self._counts)
            changed["materials"] = True
        self.followed = self._followers.update(snapshot, self.assets.values(), self.surfaces)
        self._answers.update(snapshot, self.assets, self.surfaces, self._raymap, self._materials)
        self._plan_resolve()
        if self._answers.draws != self._draws:
            self._draws, self._targets = self._answers.draws, {}
        return changed

    def set_look(self, look: Look):
        """Another view transform or exposure; only a new table is an upload."""
        self._look.set(look)
        self._plan_resolve()

    def _plan_resolve(self):
        used = {s.material for s in self._raymap.sections}
        plan = ResolvePlan.of(self.snapshot, used, self.attenuation, self._look.look, self._answers.has_glass)
        self._resolve = self._resolve_type(plan, self.attenuation, self._counts)

    def asset_shown(self, asset: Asset) -> Asset:
        """One of this renderer's assets as it stands on the GPU, read back: it may have followed what moved."""
        return self._followers.asset(asset)

    def asset_placed(self, asset: Asset) -> Asset:
        """The same, but for its images: where its stand-ins are."""
        return self._followers.placed(asset)

    def prepare(self, overlay: bool = False):
        """Upload and compile everything now, seen or not, so that moving the camera never does, nor the first thing that
        moves."""
        self._answers.prepare(self._beside(False), self._resolve)
        if self._answers.levels.draws:
            self._resolve.level_program()
        self._followers.prepare(self.surfaces)
        if overlay and self._raymap.sections:
            self._resolve.overlay_program()

    @property
    def reflector_names(self) -> tuple[str, ...]:
        return tuple(i.name for i in self.snapshot.reflectors())

    # The three steps.

    def ray_map(self, camera: Camera) -> RayMap:
        """The rays of the visible reflector pixels, read back."""
        with drawing_state():
            self._draw_rays(camera)
            return self._rays.read(self.reflector_names, self._counts)

    def coarse_ray_map(self, camera: Camera, step: int) -> RayMap:
        """The rays of every step-th pixel along each side, read back; what is kept for whole pictures stays as it is."""
        width, height = -(-camera.width // step), -(-camera.height // step)
        whole = replace(camera.part(0, 0, step * width, step * height), width=width, height=height)
        target = RayMapTarget(width, height, self._counts)
        with drawing_state() as gpu:
            self._view.set(whole)
            self._raymap.draw(self._view, target, gpu)
            return target.read(self.reflector_names, self._counts)

    @contextmanager
    def _footprints(self, wanted: bool):
        """Whether pixels' rays have any."""
        views = self._view, self._answers.levels.view
        try:
            for view in views:
                view.has_footprints = wanted
            yield
        finally:
            for view in views:
                view.has_footprints = True

    def answer(self, camera: Camera, positions: bool = True, background: Asset | None = None, footprints: bool = True) -> Answer:
        """The reflection buffer, (H, W, ...); zeros (STATUS_NONE) where no reflector is seen or none has an asset; where none is
        seen, the answer of the asset `background` to the camera's own rays (core/background.py).

        Without positions, position and status are zeros: they are not computed. Without footprints each pixel's ray is a line, to be
        compared with what rays meet."""
        with drawing_state(), self._footprints(footprints):
            self._draw_rays(camera, background)
            target = self._draw_answers(camera, positions, background)
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
            self._draw_rays(camera, asset)
            answers = self._draw_answers(camera, False, asset)
            return self._resolve.composite(
                self.gpu, self._batch, self._rays, answers, self._materials, self._look, space, background, self._bounds(camera)
            )

    def draw_overlay(self, camera: Camera, depth_bias: float = 1e-5, background: Asset | None = None, window: Window | None = None):
        """Draw the reflectors into the framebuffer that is bound, against its depth; see glsl/overlay.frag.glsl. Behind them
        what the asset `background` answers, over all that is there. window: (x, y, width, height) px, nothing outside it is drawn."""
        with drawing_state() as gpu:
            self._draw_rays(camera, background)
            answers = self._draw_answers(camera, False, background)
            if background is not None:
                with scissored(gpu, window):
                    gpu.state.blend_set("ALPHA_PREMULT")
                    gpu.state.depth_test_set("NONE")
                    self._resolve.draw_background(self._batch, self._rays, answers, self._look)
            self.draw_answers(camera, depth_bias, answers, window)

    def draw_answers(self, camera: Camera, depth_bias: float, answers: ReflectionTarget, window: Window | None = None):
        """draw_overlay's last step: the reflectors with these answers to the rays that were drawn last, which must be this camera's."""
        if self._raymap.sections:
            bind = lambda shader: self._resolve.bind_overlay(shader, self._rays, answers, self._materials, self._look)
            self.draw_surfaces(camera, depth_bias, self._resolve.overlay_program(), bind, window)

    def target_of(self, picture: np.ndarray) -> ReflectionTarget:
        """Answers from elsewhere, (H, W, 4): scene-linear radiance and coverage. They do not fade with distance."""
        target = ReflectionTarget(picture.shape[1], picture.shape[0], self._beside(False), self._counts)
        target.clear()
        target.radiance_tx = texture_from("answers_tx", picture, self._counts)
        return target

    def draw_surfaces(
        self, camera: Camera, depth_bias: float, shader: Program, bind: Callable[[Program], object], window: Window | None = None
    ):
        """The reflectors again, into the framebuffer that is bound and against its depth, by a program of raymap.surface_info's; bind sets
        what it needs besides. window: as draw_overlay's."""
        with drawing_state() as gpu, scissored(gpu, window):
            self._view.set(camera, depth_bias)
            gpu.state.depth_mask_set(False)
            gpu.state.face_culling_set("NONE")
            gpu.state.blend_set("ALPHA_PREMULT")
            gpu.state.depth_test_set("LESS_EQUAL")
            self._raymap.draw_sections(self._view, shader, bind)

    def _draw_rays(self, camera: Camera, background: Asset | None = None):
        if self._rays is None or (self._rays.width, self._rays.height) != (camera.width, camera.height):
            self._rays = RayMapTarget(camera.width, camera.height, self._counts)
            self._targets = {}
        self._view.set(camera)
        self._raymap.draw(self._view, self._rays, self.gpu, self._batch if background is not None else None)

    def _draw_answers(self, camera: Camera, positions: bool, background: Asset | None = None) -> ReflectionTarget:
        beside = self._beside(positions)
        if beside not in self._targets:
            size = camera.width, camera.height
            self._targets[beside] = ReflectionTarget(*size, beside, self._counts, depth=self._draws)
        target = self._targets[beside]
        self._answers.plan(camera, self._resolve, self.attenuation is not None)
        self._answers.draw(Seen(camera, self._rays, target), background)
        return target

    def _bounds(self, camera: Camera) -> tuple[int, int, int, int] | None:
        """What all reflectors together may cover; see RayMapPass.screen_bounds."""
        return self._raymap.screen_bounds(camera, range(len(self.snapshot.reflectors())))

    def _beside(self, positions: bool) -> str | None:
        """What the reflection buffer holds beside radiance: attenuation needs no more than a distance."""
        return "position" if positions else "distance" if self.attenuation is not None else None

    # What it costs.

    def work(self, camera: Camera) -> Work:
        """The reflection passes of one frame, ray map to resolve, for timing.py."""
        target = self.gpu.types.GPUTexture((camera.width, camera.height), format="RGBA32F")
        reader = self.gpu.types.GPUFrameBuffer(color_slots=[target])

        def submit():
            with drawing_state() as gpu:
                self._draw_rays(camera)
                answers = self._draw_answers(camera, False)
                self._resolve.draw_composite(
                    gpu, self._batch, self._rays, answers, self._materials, self._look, "display", None, self._bounds(camera), target
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
        targets = [self._rays, *self._targets.values()]
        return (
            sum(m.bytes for m in self._meshes.values())
            + self._textures.bytes()
            + self._followers.bytes()
            + self._answers.bytes()
            + sum(t.bytes for t in targets if t is not None)
        )

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
                self._answers.plan(camera, self._resolve, self.attenuation is not None)
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
        return self._answers.fill(asset, self._beside(positions)).source

    def free(self):
        """Let go of every texture and buffer. It cannot draw afterwards; shaders stay in the session's cache."""
        self.gpu.shader.unbind()
        self._meshes, self._targets = {}, {}
        self._rays = self._raymap = self._materials = self._look = self._resolve = None
        self._followers.free()
        self._answers.free()
        self._textures.keep_only(())

