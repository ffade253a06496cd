"""The ray map: reflectors rasterised once, behind all that hides them (popescu-2006 5.1: shade only what is seen).

Where several surfaces lie in a pixel, the nearest wins, as in any depth-buffered picture; transparency is ignored.
"""

from dataclasses import dataclass

import numpy as np

from ..core.camera import Camera
from ..core.shading import roughness_spread
from ..core.snapshot import Instance, SceneSnapshot
from ..core.view_cull import may_be_seen
from .background import draw_camera_rays
from .counts import Counts
from .program import Program, ProgramInfo, program
from .targets import RAY_MAP_OUTPUTS, RayMapTarget
from .upload import MeshBuffer
from .view import VIEW_BLOCK, View

_SURFACE = {
    "vertex": "surface.vert.glsl",
    "attributes": (("VEC3", "position"), ("VEC3", "normal"), ("VEC3", "face_normal")),
    "varyings": (("smooth", "VEC3", "v_rel_P"), ("smooth", "VEC3", "v_normal"), ("flat", "VEC3", "v_face_normal")),
    "blocks": (VIEW_BLOCK,),
}
OCCLUDER = ProgramInfo(
    name="reflect_occluder", fragment="occluder.frag.glsl", uniforms=(("MAT4", "rel_from_object"),), **_SURFACE
)
RAY_MAP = ProgramInfo(
    name="reflect_raymap",
    fragment="raymap.frag.glsl",
    uniforms=(("MAT4", "rel_from_object"), ("VEC4", "surface")),
    outputs=RAY_MAP_OUTPUTS,
    **_SURFACE,
)

def surface_info(name: str, fragment: str, **more) -> ProgramInfo:
    """A program that draws the snapshot's meshes with another fragment stage (the viewport's last pass)."""
    return ProgramInfo(name=name, fragment=fragment, **_SURFACE, **more)


@dataclass(frozen=True)
class Section:
    """One material's triangles of one reflector: what is drawn with one set of uniforms."""

    instance: Instance
    first: int  # vertex
    count: int  # vertices
    reflector: int  # index into SceneSnapshot.reflectors()
    material: int  # index into SceneSnapshot.materials
    roughness_spread: float


def split_scene(snapshot: SceneSnapshot, meshes: dict[int, MeshBuffer]):
    """(sections that get rays, ranges that only hide): of a reflector, the triangles with a shiny material; all of
    them when it has none and was marked by hand."""
    sections: list[Section] = []
    hiders: list[tuple[Instance, int, int]] = []
    index = -1
    for instance in snapshot.instances:
        mesh = meshes[instance.mesh]
        index += instance.is_reflector
        if not instance.is_reflector:
            if mesh.vertices:
                hiders.append((instance, 0, mesh.vertices))
            continue
        slots = {slot: instance.materials[min(slot, len(instance.materials) - 1)] for slot in mesh.ranges}
        any_shiny = any(snapshot.materials[m].is_reflector for m in slots.values())
        for slot, (first, count) in mesh.ranges.items():
            material = snapshot.materials[slots[slot]]
            if material.is_reflector or not any_shiny:
                spread = roughness_spread(material)
                sections.append(Section(instance, first, count, index, slots[slot], spread))
            else:
                hiders.append((instance, first, count))
    return sections, hiders


class RayMapPass:
    """Draws the ray map of one snapshot from any camera."""

    def __init__(self, snapshot: SceneSnapshot, meshes: dict[int, MeshBuffer], counts: Counts):
        self.snapshot = snapshot
        self.meshes = meshes
        self.counts = counts
        self.sections, self.hiders = split_scene(snapshot, meshes)
        self._around: dict[str, np.ndarray | None] | None = None  # by instance, corners of its box; None: not asked for yet
        self._boxes = {
            id(s.instance): _box_corners(snapshot.world_positions(s.instance)) for s in self.sections
        }

    def draw(self, view: View, target: RayMapTarget, gpu, background=None, window=None, in_mirrors: bool = False, hidden: str = "",
             within: Camera | None = None):
        """Occluders into depth, then the reflectors' rays where nothing hides them. background: a full-screen batch: then all
        other pixels hold the camera's own rays. window (x, y, width, height): nothing outside it is touched. in_mirrors: as a mirror
        sees the scene, without what glossy rays do not meet; hidden: nor this instance; within: nor what is not in the window of this
        camera's picture."""
        left_out = self._left_out(in_mirrors, hidden, within, window)
        target.clear(window)
        with target.framebuffer.bind():
            target.framebuffer.viewport_set(0, 0, target.width, target.height)
            gpu.state.blend_set("NONE")
            gpu.state.face_culling_set("NONE")
            if window is not None:
                gpu.state.scissor_set(*window)
                gpu.state.scissor_test_set(True)
            if background is not None:
                draw_camera_rays(gpu, background, view, target, self.counts)
            gpu.state.depth_test_set("LESS_EQUAL")
            gpu.state.depth_mask_set(True)
            if self.hiders:
                gpu.state.color_mask_set(False, False, False, False)
                hide = program(OCCLUDER, self.counts)
                hide.bind()
                hide.block("view", view.buffer)
                for instance, first, count in self.hiders:
                    if instance.name in left_out:
                        continue
                    hide.set("rel_from_object", view.rel_from_object(instance.world_from_object))
                    hide.draw(self.meshes[instance.mesh].batch, first, count)
                    self.counts.draws += 1
                    self.counts.triangles += count // 3
                gpu.state.color_mask_set(True, True, True, True)
            if self.sections:
                self.draw_sections(view, program(RAY_MAP, self.counts), left_out=left_out)
            gpu.state.scissor_test_set(False)
            gpu.state.depth_mask_set(False)
            gpu.state.depth_test_set("NONE")

    def draw_sections(self, view: View, shader: Program, bind=lambda shader: None, left_out: frozenset[str] = frozenset()):
        """All reflectors but those named in left_out, with a program made by surface_info; `bind` sets what else it needs."""
        shader.bind()
        shader.block("view", view.buffer)
        bind(shader)
        for s in self.sections:
            if s.instance.name in left_out:
                continue
            shader.set("rel_from_object", view.rel_from_object(s.instance.world_from_object))
            shader.set("surface", (s.reflector, s.material, s.roughness_spread, 0.0))
            shader.draw(self.meshes[s.instance.mesh].batch, s.first, s.count)
            self.counts.draws += 1
            self.counts.triangles += s.count // 3

    def _left_out(self, in_mirrors: bool, hidden: str, within: Camera | None, window) -> frozenset[str]:
        """Names of the instances that are not drawn; see draw."""
        named = {hidden} | {i.name for i in self.snapshot.instances if in_mirrors and not i.visible_glossy}
        if within is not None:
            if self._around is None:
                self._around = {i.name: _box_corners(self.snapshot.world_positions(i)) for i in self.snapshot.instances}
            named |= {name for name, box in self._around.items() if box is None or not may_be_seen(within, box, window)}
        return frozenset(named)

    def any_seen(self, camera: Camera, window: tuple[int, int, int, int]) -> bool:
        """Whether window (x, y, width, height) of the camera's picture may show a reflector, beyond the near plane."""
        boxes = (self._boxes[id(s.instance)] for s in self.sections if s.instance.visible_glossy)
        return any(box is not None and may_be_seen(camera, box, window) for box in boxes)

    def screen_bounds(self, camera: Camera, reflectors) -> tuple[int, int, int, int] | None:
        """(x, y, width, height) px that holds all of these reflectors (a set of indices); None when off screen."""
        boxes = [self._boxes[id(s.instance)] for s in self.sections if s.reflector in reflectors]
        boxes = [b for b in boxes if b is not None]
        if not boxes:
            return None
        corners = np.concatenate(boxes)
        clip = np.concatenate([corners, np.ones((len(corners), 1))], -1) @ camera.clip_from_world().T
        # A corner behind the eye has no place on the screen; the reflector may then be anywhere.
        if (clip[:, 3] <= 1e-9 * np.abs(clip).max()).any():
            low, high = np.array([-1.0, -1.0]), np.array([1.0, 1.0])
        else:
            ndc = clip[:, :2] / clip[:, 3:]
            # Vertices are float32 relative to the eye: through a telescope from far away their steps are pixels.
            reach = np.abs(corners - camera.world_from_camera[:3, 3]).max()
            slack = 2.0**-22 * reach * np.abs(np.diag(camera.clip_from_camera)[:2]) / clip[:, 3].min()
            low, high = np.clip(ndc.min(0) - slack, -1, 1), np.clip(ndc.max(0) + slack, -1, 1)
        size = np.array([camera.width, camera.height])
        # One pixel more on each side: rounding must not cut an edge pixel.
        start = np.clip(np.floor((low * 0.5 + 0.5) * size).astype(int) - 1, 0, size)
        stop = np.clip(np.ceil((high * 0.5 + 0.5) * size).astype(int) + 1, 0, size)
        if (stop <= start).any():
            return None
        return int(start[0]), int(start[1]), int(stop[0] - start[0]), int(stop[1] - start[1])


def _box_corners(positions: np.ndarray) -> np.ndarray | None:
    positions = positions[np.isfinite(positions).all(-1)]
    if not len(positions):
        return None
    low, high = positions.min(0), positions.max(0)
    pick = np.array([[i & 1, i >> 1 & 1, i >> 2 & 1] for i in range(8)])
    return np.where(pick, high, low)
