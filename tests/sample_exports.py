"""Exports of the samples with pictures of their cameras, small, for the tests of programs that draw them."""

from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np

from reflect_addon.core.exchange.reading import read_export
from reflect_addon.evaluation.export_file import Shot, write_export
from tools.exports.compared import reflector_pixels

SIZE, SAMPLES, RESOLUTION, TEXELS = (320, 240), 4, 32, 64
BLENDS = Path(__file__).resolve().parents[1] / "sample_blends"


@dataclass(frozen=True)
class Exported:
    folder: Path
    mask: np.ndarray  # reflectors' pixels
    methods: tuple[str, ...]


def exported(folder: Path, name: str, methods: tuple[str, ...], size: tuple[int, int] = SIZE, lens: dict | None = None, **settings) -> Exported:
    """A sample by these methods. lens: properties of the camera that the file does not have."""
    bpy.ops.wm.open_mainfile(filepath=str(BLENDS / f"{name}.blend"))
    for word, value in (lens or {}).items():
        setattr(bpy.context.scene.camera.data, word, value)
    blend = folder.parent / f"{name}.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(blend))
    write_export(bpy.context.scene, methods, folder, shot=Shot(size, samples=SAMPLES), settings={"resolution": RESOLUTION, "texels": TEXELS, **settings})
    return Exported(folder, reflector_pixels(blend, read_export(folder)), methods)
