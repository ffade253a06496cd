"""A view's picture becomes its mirror's answer: the pixels of the mirror take the view's radiance and places over, in the picture that shows it.

Sharp planar mirrors pixel for pixel, rough ones ray by ray of each pixel's lobe, and curved ones ray by ray (glossy_mirrors.py); of panes of glass
the pixels behind them (glass.py).
"""

import numpy as np

from ..core.asset import Asset
from ..core.curved_views import NEAR, CurvedMirror
from ..core.glass_shapes import Pane
from ..core.mirror_planes import MirrorPlane
from ..core.snapshot import SceneSnapshot
from .counts import Counts
from .device import ensure
from .glass import SEEN, shown_through
from .glossy_mirrors import GlossyMirror
from .level_programs import shown_in
from .level_targets import Seen
from .program import Program, program
from .resolve_tables import MaterialTable
from .targets import LevelTarget
from .texture_cache import TextureCache
from .view import View

# Of the outline of a mirror's plane, and float32 steps of places: how far from the plane a point of the mirror may be.
IN_PLANE, STEPS = 2e-3, 2.0**-20


def near_plane(plane: MirrorPlane, camera) -> float:
    """m from the plane that a point of the mirror may be, as a camera's ray map places it."""
    size = float(np.linalg.norm(np.ptp(plane.outline, axis=0)))
    return IN_PLANE * size + STEPS * float(np.abs(plane.outline).max() + np.abs(camera.world_from_camera[:3, 3]).max())


class ShownMirrors:
    """Of one renderer."""

    def __init__(self, counts: Counts, textures: TextureCache, batch, most_rays: int):
        self._counts, self._textures, self._batch, self._most_rays = counts, textures, batch, most_rays
        self._view = View()
        self.glossy: dict[tuple[int, str | None, bool], GlossyMirror] = {}  # by asset, what stands beside radiance, whether curved

    def update(self, snapshot: SceneSnapshot, assets: dict[int, Asset], materials: MaterialTable):
        """assets: by reflector, those that have mirrors."""
        self._scene, self._assets, self._materials = snapshot, assets, materials
        self.glossy = {key: made for key, made in self.glossy.items() if any(made.asset is asset for asset in assets.values())}

    def prepare(self, mirrors: tuple[MirrorPlane | CurvedMirror, ...], beside: str | None):
        """Compile now."""
        program(shown_in(beside), self._counts)
        for mirror in mirrors:
            if isinstance(mirror, Pane):
                program(shown_through(), self._counts)
            elif isinstance(mirror, CurvedMirror) or mirror.roughness[1] > 0:
                self._glossy_mirror(mirror, beside).prepare()

    def draw(self, mirror: MirrorPlane | CurvedMirror, camera, picture: LevelTarget, node, seen: Seen, per_metre: float):
        """The view's radiance and places, as answers to the rays of the mirror's pixels in the picture that shows it. camera: of the view's picture;
        per_metre: unit of depth in reflection buffers."""
        gpu, target, (x, y, width, height) = ensure(), seen.target, node.window
        is_pane = isinstance(mirror, Pane)
        framebuffer = target.through.framebuffer if is_pane else target.framebuffer
        with framebuffer.bind():
            framebuffer.viewport_set(0, 0, target.width, target.height)
            gpu.state.blend_set("NONE")
            gpu.state.depth_test_set("NONE" if is_pane else "LESS")
            gpu.state.depth_mask_set(not is_pane)
            gpu.state.scissor_set(x - seen.corner[0], y - seen.corner[1], width, height)
            gpu.state.scissor_test_set(True)
            if isinstance(mirror, CurvedMirror):
                shader = self._by_rays(mirror, camera, node, seen, picture)
                shader.set("nearest", NEAR * mirror.radius)
                shader.set("plane_origin", (0.0,) * 4)
                shader.set("plane_normal", (0.0, 0.0, 0.0, mirror.reflector))
            else:
                if is_pane:
                    shader = self._through(seen, picture)
                else:
                    shader = self._by_rays(mirror, camera, node, seen, picture) if mirror.roughness[1] > 0 else self._sharp(seen, picture)
                shader.set("plane_origin", (*mirror.origin, near_plane(mirror, seen.camera)))
                shader.set("plane_normal", (*mirror.normal, mirror.reflector))
            shader.set("sizes_per_metre", per_metre)
            shader.set("offset", tuple(node.finer * seen.corner[axis] - node.drawn[axis] for axis in (0, 1)))
            shader.draw(self._batch)
            gpu.state.scissor_test_set(False)
            gpu.state.depth_mask_set(False)
            gpu.state.depth_test_set("NONE")
        self._counts.passes += 1

    def _sharp(self, seen: Seen, picture: LevelTarget) -> Program:
        """Pixel for pixel."""
        shader = program(shown_in(seen.target.beside), self._counts)
        shader.bind()
        for name, texture in zip(("origin_tx", "direction_tx", "normal_tx"), seen.rays.textures, strict=False):
            shader.image(name, texture)
        shader.image("picture_tx", picture.color_tx)
        shader.image("place_tx", picture.place_tx)
        return shader

    def _through(self, seen: Seen, picture: LevelTarget) -> Program:
        """A pane's pixels show those of the view through it."""
        shader = program(shown_through(), self._counts)
        shader.bind()
        for name, texture in zip(SEEN, (*seen.rays.textures, self._materials.texture), strict=True):
            shader.image(name, texture)
        shader.image("picture_tx", picture.color_tx)
        return shader

    def _by_rays(self, mirror: MirrorPlane | CurvedMirror, camera, node, seen: Seen, picture: LevelTarget) -> Program:
        """Ray by ray of each pixel's lobe."""
        self._view.set(camera)
        made = self._glossy_mirror(mirror, seen.target.beside)
        far = 4.0 * (self._scene.diagonal() + np.linalg.norm(node.camera.world_from_camera[:3, 3]))
        window = (0, 0, *node.drawn[2:])
        return made.bind(self._view, seen.rays, picture, self._materials, window, self._most_rays, self._view.footprint, far, node.finer)

    def _glossy_mirror(self, mirror: MirrorPlane | CurvedMirror, beside: str | None) -> GlossyMirror:
        asset = self._assets[mirror.reflector]
        key = id(asset), beside, isinstance(mirror, CurvedMirror)
        if key not in self.glossy:
            self.glossy[key] = GlossyMirror(asset, beside, self._textures, curved=key[2])
        return self.glossy[key]

    def free(self):
        self.glossy = {}
