"""The target of nielsen-2002 on glossy reflections: a rough floor under legs and boxes, against Cycles and against the best fixed blur.

The rival is the sharp mirrored picture blurred by one Gaussian over the whole floor, of that width of WIDTHS which comes nearest to Cycles at this
roughness: no better filter is possible that does not know how far things are. Both are judged by FLIP on the floor's pixels, one ray each,
as Cycles traces it through the floor's material. Things glow and reflect nothing, so that nothing but the filter is judged.
"""

from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

import bpy
import numpy as np

from ..core import lobe_rays
from ..core.asset import Asset
from ..core.camera import Camera
from ..core.look import Look
from ..core.methods import recursive
from ..core.rays import Rays
from ..core.reflection_tree import TreeSettings
from ..core.snapshot import SceneSnapshot
from ..core.tree_growth import grow
from ..scene.camera import camera_of
from ..scene.look import read_look
from ..scene.raytrace import trace
from . import eye
from .assets import assets_for
from .bench_mirrors_scene import look, new_file
from .bench_nielsen_scene import block, panel, quad
from .bench_row import row
from .exhibit import Exhibit
from .frame import open_frame

SIZE = (160, 120)
ROUGHNESS = (0.05, 0.1, 0.2, 0.35, 0.5)
SAMPLES = 128  # of Cycles, a pixel
WIDTHS = (0.2, 0.35, 0.5, 0.7, 1.0, 1.4, 2.0, 2.8, 4.0, 5.6, 8.0, 11.0, 16.0, 22.0, 32.0)  # px, of the fixed blur
HALF = 0.5  # of the fixed blur's FLIP
BAKE = {"resolution": 128, "samples": 1}
SHOWN = (0.1, 0.35)  # whose pictures are in the exhibit


def glossy_floor() -> bpy.types.Scene:
    """A table and two boxes before a striped wall, on a floor that mirrors."""
    scene = new_file()
    panel((0, 0, 0), (0, 0, 1), (8, 8), ROUGHNESS[0])
    for x in (-1.5, -0.5):
        for y in (-0.3, 0.5):
            block((x, y, 0.5), (0.08, 0.08, 1.0), 3)
    block((-1.0, 0.1, 1.04), (1.2, 1.0, 0.08), 5)
    block((0.6, 0.3, 0.35), (0.7, 0.7, 0.7), 0)
    block((1.5, 1.2, 0.8), (0.5, 0.5, 1.6), 2)
    for number in range(8):
        quad((number - 3.5, 3.9, 1.5), (0, -1, 0), (1, 3), 1 + number % 3)
    for made in bpy.data.materials:
        shader = made.node_tree.nodes["Principled BSDF"]
        if shader.inputs["Emission Strength"].default_value > 0:
            shader.inputs["Base Color"].default_value, shader.inputs["Specular IOR Level"].default_value = (0, 0, 0, 1), 0.0
    scene.world.node_tree.nodes["Background"].inputs["Color"].default_value = (0.02, 0.03, 0.05, 1)
    look(scene, (0.3, -5.2, 1.7), (0.0, 0.3, 0.35), 34)
    return scene


@dataclass(frozen=True)
class Floor:
    """What is drawn and judged; all but the floor's roughness stays."""

    scene: bpy.types.Scene
    snapshot: SceneSnapshot
    camera: Camera
    assets: dict[str, Asset]
    surfaces: Asset
    look: Look
    mask: np.ndarray  # (H, W) bool: the floor

    def drawn(self, roughness: float, most_rays: int = lobe_rays.MOST) -> np.ndarray:
        """(H, W, 3) scene-linear."""
        from ..gpu.renderer import Renderer

        changed = tuple(replace(m, roughness=roughness) if m.is_reflector else m for m in self.snapshot.materials)
        renderer = Renderer(replace(self.snapshot, materials=changed), self.assets, surfaces=self.surfaces, most_rays=most_rays)
        picture = renderer.picture(self.camera)[..., :3]
        renderer.free()
        return picture

    def fineness(self, roughness: float) -> int:
        """Pixels of the floor's view along one of the picture's, as the schedule has them."""
        changed = tuple(replace(m, roughness=roughness) if m.is_reflector else m for m in self.snapshot.materials)
        planes = recursive.drawn_mirrors(replace(self.snapshot, materials=changed))[0]
        return grow(self.camera, planes, TreeSettings()).nodes[0].finer

    def truth(self, roughness: float) -> np.ndarray:
        """(H, W, 3) scene-linear: Cycles along the camera's rays, through the floor's material."""
        floor = bpy.data.objects["Panel"].data.materials[0].node_tree.nodes["Principled BSDF"]
        floor.inputs["Roughness"].default_value = roughness
        rays, chosen = self.camera.primary_rays(), self.mask.ravel()
        picture = np.zeros((*self.mask.shape, 3), np.float32)
        picture[self.mask] = trace(Rays(rays.origin[chosen], rays.direction[chosen]), samples=SAMPLES, seed=1, scene=self.scene).radiance
        return picture

    def developed(self, picture: np.ndarray) -> np.ndarray:
        """(H, W, 3) display-encoded, black beside the floor."""
        return self.look.apply(np.where(self.mask[..., None], picture, 0).astype(np.float32))

    def flip(self, picture: np.ndarray, truth: np.ndarray) -> float:
        value, note = eye.flip(self.developed(picture), self.developed(truth), self.mask)
        if value is None:
            raise RuntimeError(note)
        return value


def floor_of(out: Path, say) -> Floor:
    """Baked once: nothing of it depends on the floor's roughness."""
    from ..gpu.renderer import Renderer

    scene = glossy_floor()
    with open_frame(scene, None) as snapshot:
        baked = assets_for(scene, snapshot, recursive.NAME, out, BAKE, say)
        camera = camera_of(scene, None, *SIZE)
        renderer = Renderer(snapshot, {})
        mask = renderer.ray_map(camera).covered()
        renderer.free()
        return Floor(scene, snapshot, camera, baked.assets, baked.surfaces, read_look(scene), mask)


def blurred(picture: np.ndarray, mask: np.ndarray, width: float) -> np.ndarray:
    """A Gaussian of this standard deviation, px, over the floor's pixels alone."""
    reach = int(np.ceil(3 * width))
    weights = np.exp(-0.5 * (np.arange(-reach, reach + 1) / width) ** 2)
    layers = np.concatenate([picture * mask[..., None], mask[..., None]], -1).astype(np.float64)
    for axis in (0, 1):
        layers = np.apply_along_axis(lambda line: np.convolve(line, weights)[reach : reach + len(line)], axis, layers)
    return layers[..., :3] / np.maximum(layers[..., 3:], 1e-12)


def measure(progress) -> list:
    """Rows for targets.json, and an Exhibit."""
    progress(0.0, "nielsen: a glossy floor")
    rows, lines, pictures = [], [], []
    with TemporaryDirectory() as folder:
        floor = floor_of(Path(folder), lambda share, text: progress(0.2 * share, f"nielsen: {text}"))
        sharp = floor.drawn(0.0)
        for number, roughness in enumerate(ROUGHNESS):
            progress(0.2 + 0.8 * number / len(ROUGHNESS), f"nielsen: roughness {roughness}")
            truth, ours = floor.truth(roughness), floor.drawn(roughness)
            best, width = min((floor.flip(blurred(sharp, floor.mask, w), truth), w) for w in WIDTHS)
            found, live = floor.flip(ours, truth), floor.flip(floor.drawn(roughness, lobe_rays.LIVE), truth)
            rows.append(
                row(f"N-glossy-{roughness}", found, HALF * best, found <= HALF * best,
                    f"FLIP of a floor of roughness {roughness} against Cycles, asked: half of the best fixed blur's {best:.4f} ({width} px); "
                    f"{lobe_rays.LIVE} rays a pixel: {live:.4f}; the view's pixels: {floor.fineness(roughness)} x as fine as the picture's.")
            )  # fmt: skip
            numbers = (found, live, best, floor.flip(sharp, truth))
            lines.append((f"{roughness}", *(f"{value:.4f}" for value in numbers), f"{width}", f"{found / best:.2f}"))
            if roughness in SHOWN:
                said = ("Cycles", truth), ("ours", ours), ("the best fixed blur", blurred(sharp, floor.mask, width))
                pictures += [(f"roughness {roughness}: {what}", floor.developed(picture)) for what, picture in said]
    heads = ("roughness", "FLIP", f"{lobe_rays.LIVE} rays", "fixed blur", "no blur", "its width, px", "FLIP over fixed blur's")
    lead = f"A floor under a table's legs and boxes, {SIZE[0]}x{SIZE[1]}, against Cycles: the lobe's rays followed through the mirrored view's picture."
    return [*rows, Exhibit("Glossy floors: recursive mirrors, filtered by roughness and hit distance", lead, heads, tuple(lines), tuple(pictures))]
