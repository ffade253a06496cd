"""Exports of contact.blend, made once: small, with every method that gathers, and pictures of its camera."""

from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np
import pytest
from node_package import chromium, need_packages

from reflect_addon.core import methods as registry
from reflect_addon.core.exchange.reading import read_export
from reflect_addon.evaluation.export_file import Shot, write_export
from tools.exports.compared import reflector_pixels

SIZE, SAMPLES, RESOLUTION = (320, 240), 4, 32
BLEND = Path(__file__).resolve().parents[2] / "sample_blends" / "contact.blend"


@dataclass(frozen=True)
class Exported:
    folder: Path
    mask: np.ndarray  # reflectors' pixels
    methods: tuple[str, ...]


def _exported(folder: Path, methods: tuple[str, ...], size: tuple[int, int], lens: dict | None = None, **settings) -> Exported:
    """lens: properties of the camera that the file does not have."""
    need_packages()  # before minutes of baking
    chromium()
    bpy.ops.wm.open_mainfile(filepath=str(BLEND))
    blend = folder.parent / BLEND.name
    for name, value in (lens or {}).items():
        setattr(bpy.context.scene.camera.data, name, value)
    bpy.ops.wm.save_as_mainfile(filepath=str(blend))
    write_export(bpy.context.scene, methods, folder, shot=Shot(size, samples=SAMPLES), settings={"resolution": RESOLUTION, **settings})
    return Exported(folder, reflector_pixels(blend, read_export(folder)), methods)


@pytest.fixture(scope="session")
def exported(tmp_path_factory, device) -> Exported:
    return _exported(tmp_path_factory.mktemp("web") / "contact", tuple(registry.gathering()), SIZE)


@pytest.fixture(scope="session")
def compressed(tmp_path_factory, device) -> Exported:
    """A light field alone, in blocks."""
    return _exported(tmp_path_factory.mktemp("blocks") / "contact", ("light_field",), SIZE, compressed=True, views=4, view_texels=32)


@pytest.fixture(scope="session")
def upright(tmp_path_factory, device) -> Exported:
    """A picture of another shape than the scene's render settings have, by a lens that is shifted and fitted to its height."""
    lens = {"sensor_fit": "VERTICAL", "shift_x": 0.1, "shift_y": -0.05}
    return _exported(tmp_path_factory.mktemp("upright") / "contact", ("environment",), (SIZE[1], SIZE[0]), lens)
