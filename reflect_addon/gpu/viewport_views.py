"""What a 3D view's own shading shows in its planar mirrors: one picture a mirror, drawn by Blender, taken instead of surface radiance.

Problem. Surface radiance is as the bake found it. An artist who changes a material wants to see it in the mirror at once, as the viewport shades it.
Idea. `GPUOffScreen.draw_view3d` draws the scene from any plain camera (core/frontal_view.py), scene-linear. A mirrored view is drawn as ever,
with its places, and the colours of what is no reflector there are looked up in that picture by their places: mirrors in it, lamps, roughness
and look go on as they did, and a picture that was drawn from elsewhere a moment ago is right but for what that eye did not see.
When. Blender draws no view inside of another: the draw manager is not re-entered. So a frame says what it wants (in POST_VIEW), the
pictures are drawn when it is done (in POST_PIXEL), and the next frame shows them. What did not change is not drawn again, so all comes to rest.
Limits. One frame late. The strongest VIEWS views only. All pictures are drawn in one offscreen, since an engine keeps hundreds of MB for each.
What Blender cannot draw from a camera of ours (scene/viewport_source.py) shows surface radiance.
"""

from contextlib import contextmanager
from dataclasses import dataclass
from time import perf_counter

import numpy as np
from mathutils import Matrix

from ..core.camera import Camera
from ..core.frontal_view import frontal
from ..core.glass_shapes import Pane
from ..core.mirror_planes import MirrorPlane
from ..core.reflection_tree import Tree
from .background import FULLSCREEN
from .counts import Counts
from .device import ensure
from .program import ProgramInfo, program
from .state import drawing_state
from .targets import LevelTarget, RayMapTarget
from .upload import triangle_batch

VIEWS = 4
# s that pictures may take of a frame, after the first of them. Where one takes longer it waits until a frame asks what the last one did.
BUDGET = 0.03

COLOR = ProgramInfo(
    name="reflect_viewport_color",
    fragment="viewport_color.frag.glsl",
    uniforms=(("MAT4", "clip_from_rel"), ("VEC4", "eye")),
    samplers=tuple(("FLOAT_2D", name) for name in ("place_tx", "origin_tx", "viewport_tx")),
    outputs=(("VEC4", "color_out"),),
    **FULLSCREEN,
)
KEPT = ProgramInfo(
    name="reflect_viewport_kept",
    fragment="viewport_kept.frag.glsl",
    samplers=(("FLOAT_2D", "drawn_tx"),),
    outputs=(("VEC4", "color_out"),),
    **FULLSCREEN,
)

_drawing = False


def is_drawing() -> bool:
    """Whether Blender draws one of our pictures now: then nothing of ours draws."""
    return _drawing


@contextmanager
def bare(space):
    """A 3D view without overlays, which are no part of the scene."""
    global _drawing
    shown, _drawing = space.overlay.show_overlays, True
    try:
        if shown:
            space.overlay.show_overlays = False
        yield
    finally:
        _drawing = False
        if shown:
            space.overlay.show_overlays = True


@dataclass(frozen=True)
class Asked:
    """What a picture is of. state: whatever else it depends on."""

    camera: Camera
    state: tuple

    def is_as(self, other: "Asked | None") -> bool:
        return other is not None and self.state == other.state and np.array_equal(self.camera.clip_from_world(), other.camera.clip_from_world())


def _is_flat(mirror) -> bool:
    """Whether a view of it is a mirrored one."""
    return isinstance(mirror, MirrorPlane) and not isinstance(mirror, Pane)


class ViewportViews:
    """The pictures of one 3D view's mirrors."""

    def __init__(self):
        self._wanted: dict[tuple[int, ...], Asked] = {}  # by the path of mirrors from the eye
        self._before: dict[tuple[int, ...], Asked] = {}  # what the frame before wanted
        self._kept: dict[tuple[int, ...], tuple[Asked, object]] = {}  # with its texture
        self._offscreen, self._batch, self._counts = None, triangle_batch(), Counts()
        self._unseen = False  # whether something was drawn since the last frame
        self.state: tuple = ()  # what pictures depend on besides their cameras: it is told before a frame
        self.seconds = 0.0  # what a picture took last
        self.drawn = 0  # pictures so far

    def want(self, tree: Tree):
        """The frame that is drawn now shows this tree."""
        most = max(tree.root.width, tree.root.height)
        flat = (node for node in tree.nodes if node.facing and _is_flat(tree.mirrors[node.mirror]))
        strongest = sorted(flat, key=lambda node: -node.energy)[:VIEWS]
        cameras = {node.path: frontal(node.camera, tree.mirrors[node.mirror], node.polygon, most) for node in strongest}
        self._before = self._wanted
        self._wanted = {path: Asked(camera, self.state) for path, camera in cameras.items() if camera is not None}
        self._kept = {path: kept for path, kept in self._kept.items() if path in self._wanted}
        self._unseen = False

    def due(self) -> list[tuple[int, ...]]:
        """What the last frame wanted and there is no picture of, as it wanted it."""
        return [path for path, asked in self._wanted.items() if not asked.is_as(self._kept.get(path, (None,))[0])]

    @property
    def settled(self) -> bool:
        """Whether another frame would show what the last one does."""
        return not self._unseen and not self.due()

    def draw(self, scene, view_layer, space, region):
        """Draws pictures that are due, when the view itself has been drawn: not inside of its drawing."""
        due = self.due()
        if not due or (self.seconds > BUDGET and not self._rests()):
            return
        start = perf_counter()
        with drawing_state(), bare(space):
            for path in due:
                self._keep(path, scene, view_layer, space, region)
                if perf_counter() - start > BUDGET:
                    break
        self._unseen = True

    def _rests(self) -> bool:
        return self._wanted.keys() == self._before.keys() and all(asked.is_as(self._before[path]) for path, asked in self._wanted.items())

    def _keep(self, path, scene, view_layer, space, region):
        """Draws one picture and takes it over into a texture of its own."""
        gpu, asked, start = ensure(), self._wanted[path], perf_counter()
        self._make_room()
        camera, size = asked.camera, (self._offscreen.width, self._offscreen.height)
        view = Matrix(np.linalg.inv(camera.world_from_camera).tolist())
        self._offscreen.draw_view3d(
            scene, view_layer, space, region, view, Matrix(camera.clip_from_camera.tolist()), do_color_management=False, draw_background=True
        )
        texture = self._kept.get(path, (None, None))[1]
        if texture is None or (texture.width, texture.height) != size:
            texture = gpu.types.GPUTexture(size, format="RGBA16F")
            texture.filter_mode(True)
        framebuffer = gpu.types.GPUFrameBuffer(color_slots=(texture,))
        with framebuffer.bind():
            framebuffer.viewport_set(0, 0, *size)
            gpu.state.blend_set("NONE")
            gpu.state.depth_test_set("NONE")
            shader = program(KEPT, self._counts)
            shader.bind()
            shader.image("drawn_tx", self._offscreen.texture_color)
            shader.draw(self._batch)
            framebuffer.read_color(0, 0, 1, 1, 4, 0, "FLOAT")  # waits, so that the time is that of the drawing
        self._kept[path] = asked, texture
        self.seconds, self.drawn = perf_counter() - start, self.drawn + 1

    def _make_room(self):
        """An offscreen that holds every picture; it seldom grows and never shrinks."""
        cameras = [asked.camera for asked in self._wanted.values()]
        held = (self._offscreen.width, self._offscreen.height) if self._offscreen else (0, 0)
        size = tuple(max(h, 64 * -(-max(sides) // 64)) for h, sides in zip(held, zip(*((c.width, c.height) for c in cameras), strict=True), strict=True))
        if size != held:
            if self._offscreen:
                self._offscreen.free()
            self._offscreen = ensure().types.GPUOffScreen(*size, format="RGBA16F")

    def has(self, path: tuple[int, ...]) -> bool:
        """Whether there is a picture for a view, be it of a moment ago."""
        return path in self._kept

    def put(self, path: tuple[int, ...], picture: LevelTarget, window, rays: RayMapTarget | None):
        """The colours of a view's picture, of what is seen in window (x, y, width, height). rays: its reflectors, None: it shows none."""
        gpu, (asked, texture), target = ensure(), self._kept[path], picture.lit
        camera = asked.camera
        turn = np.eye(4)
        turn[:3, :3] = camera.world_from_camera[:3, :3].T
        with target.bind():
            target.viewport_set(0, 0, picture.width, picture.height)
            gpu.state.blend_set("NONE")
            gpu.state.depth_test_set("NONE")
            gpu.state.scissor_set(*window)
            gpu.state.scissor_test_set(True)
            shader = program(COLOR, self._counts)
            shader.bind()
            shader.set("clip_from_rel", (camera.clip_from_camera @ turn).T.ravel())
            shader.set("eye", (*camera.world_from_camera[:3, 3], float(rays is not None)))
            shader.image("place_tx", picture.place_tx)
            shader.image("origin_tx", rays.origin_tx if rays is not None else picture.place_tx)
            shader.image("viewport_tx", texture)
            shader.draw(self._batch)
            gpu.state.scissor_test_set(False)

    def free(self):
        """Let go of all pictures."""
        if self._offscreen:
            self._offscreen.free()
        self._offscreen, self._wanted, self._before, self._kept = None, {}, {}, {}
