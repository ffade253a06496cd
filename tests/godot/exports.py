"""Exports of the samples with pictures of their cameras, and what Godot draws of them."""

import json
from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np
from godot_program import godot, need_godot

from reflect_addon.core.exchange.reading import read_export
from reflect_addon.evaluation.export_file import Shot, write_export
from reflect_addon.evaluation.png import write_png
from tools.exports.compared import Compared, read_png, reflector_pixels

SIZE, SAMPLES, RESOLUTION, TEXELS, RAYS = (320, 240), 4, 32, 64, 7
SAMPLES_OF = Path(__file__).resolve().parents[2] / "sample_blends"


@dataclass(frozen=True)
class Exported:
    folder: Path
    mask: np.ndarray  # reflectors' pixels
    methods: tuple[str, ...]

    def drawn(self, out: Path, *words) -> dict:
        """What Godot says of the pictures that it draws by each method; they lie in `out`."""
        out.mkdir(parents=True, exist_ok=True)
        godot("--", "--export", self.folder, "--method", ",".join(self.methods), "--rays", RAYS, "--out", out, *words)
        for method in self.methods:
            write_png(out / f"sheet_{method}.png", self.compared(out, method).sheet())
        return json.loads((out / "drawn.json").read_text())

    def compared(self, out: Path, method: str) -> Compared:
        """Of Godot's picture in `out` against Blender's own in the export."""
        blender = read_export(self.folder).manifest.pictures[0].methods[method]
        return Compared(read_png(out / f"{method}.png"), read_png(self.folder / blender), self.mask)


def exported(folder: Path, name: str, methods: tuple[str, ...], size: tuple[int, int] = SIZE, lens: dict | None = None, **settings) -> Exported:
    """lens: properties of the camera that the file does not have."""
    need_godot()  # before minutes of baking
    bpy.ops.wm.open_mainfile(filepath=str(SAMPLES_OF / f"{name}.blend"))
    for word, value in (lens or {}).items():
        setattr(bpy.context.scene.camera.data, word, value)
    blend = folder.parent / f"{name}.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(blend))
    write_export(bpy.context.scene, methods, folder, shot=Shot(size, samples=SAMPLES), settings={"resolution": RESOLUTION, "texels": TEXELS, **settings})
    return Exported(folder, reflector_pixels(blend, read_export(folder)), methods)
