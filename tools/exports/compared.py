"""What another program drew of an export against what Blender drew: pictures as arrays, the reflectors' pixels, and FLIP over them."""

from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np

from reflect_addon.core.exchange.reading import Export, read_export
from reflect_addon.evaluation.eye import flip
from reflect_addon.evaluation.frame import open_frame
from reflect_addon.evaluation.judged import named_camera
from reflect_addon.scene.camera import camera_of


@dataclass(frozen=True)
class Compared:
    """Arrays (H, W, 3), display-encoded 0..1, row 0 at the bottom; mask: (H, W), the reflectors' pixels by Blender's ray map."""

    drawn: np.ndarray
    blender: np.ndarray
    mask: np.ndarray

    def flip(self) -> float:
        return flip(self.drawn, self.blender, self.mask)[0]

    def beside(self) -> float:
        """FLIP where no reflector is: the look and the picture behind alone."""
        return flip(self.drawn, self.blender, ~self.mask)[0]

    def sheet(self) -> np.ndarray:
        """The program's, Blender's, and eight times their difference, side by side."""
        return np.concatenate([self.drawn, self.blender, np.clip(8 * np.abs(self.drawn - self.blender), 0, 1)], 1)


def reflector_pixels(blend: Path, export: Export) -> np.ndarray:
    """(H, W) bool: where the reflectors of a .blend are in the export's first picture, by the ray map that `render` uses."""
    from reflect_addon.gpu.renderer import Renderer

    bpy.ops.wm.open_mainfile(filepath=str(blend))
    scene, picture = bpy.context.scene, export.manifest.pictures[0]
    with open_frame(scene, None, lambda share, text: None) as snapshot:
        view = camera_of(scene, named_camera(scene, picture.camera), picture.width, picture.height)
        renderer = Renderer(snapshot, {})
        covered = np.array(renderer.ray_map(view).covered())
        renderer.free()
    return covered


def compared(folder: Path, drawn: Path, method: str, mask: np.ndarray) -> Compared:
    """folder: the export; drawn: where a program's picture lies: the bytes that reflect-three/test/web/draw.js writes, or a PNG."""
    picture, raw = read_export(folder).manifest.pictures[0], drawn / f"{method}.rgba"
    if raw.is_file():
        shown = np.fromfile(raw, np.uint8).reshape(picture.height, picture.width, 4)[..., :3] / np.float32(255)
    else:
        shown = read_png(drawn / f"{method}.png")
    return Compared(shown, read_png(folder / picture.methods[method]), mask)


def read_png(path: Path) -> np.ndarray:
    """(H, W, 3) float32 of an 8-bit PNG as it is, row 0 at the bottom."""
    image = bpy.data.images.load(str(path))
    image.colorspace_settings.name = "Non-Color"
    width, height = image.size
    out = np.empty(width * height * 4, np.float32)
    image.pixels.foreach_get(out)
    bpy.data.images.remove(image)
    return out.reshape(height, width, 4)[..., :3]
