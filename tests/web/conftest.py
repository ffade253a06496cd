"""Exports of contact.blend, made once: small, with every method that gathers, and pictures of its camera."""

from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np
import pytest
from compared import reflector_pixels
from node_package import chromium, need_packages

from reflect_addon.core import methods as registry
from reflect_addon.core.exchange.reading import read_export
from reflect_addon.evaluation.export_file import Shot, write_export

SIZE, SAMPLES, RESOLUTION = (320, 240), 4, 32
BLEND = Path(__file__).resolve().parents[2] / "sample_blends" / "contact.blend"


@dataclass(frozen=True)
class Exported:
    folder: Path
    mask: np.ndarray  # reflectors' pixels
    methods: tuple[str, ...]


def _exported(folder: Path, methods: tuple[str, ...], size: tuple[int, int], **settings) -> Exported:
    need_packages()  # before minutes of baking
    chromium()
    bpy.ops.wm.open_mainfile(filepath=str(BLEND))
    write_export(bpy.context.scene, methods, folder, shot=Shot(size, samples=SAMPLES), settings={"resolution": RESOLUTION, **settings})
    return Exported(folder, reflector_pixels(BLEND, read_export(folder)), methods)


@pytest.fixture(scope="session")
def exported(tmp_path_factory, device) -> Exported:
    return _exported(tmp_path_factory.mktemp("web") / "contact", tuple(registry.gathering()), SIZE)


@pytest.fixture(scope="session")
def compressed(tmp_path_factory, device) -> Exported:
    """A light field alone, in blocks."""
    return _exported(tmp_path_factory.mktemp("blocks") / "contact", ("light_field",), SIZE, compressed=True, views=4, view_texels=32)


@pytest.fixture(scope="session")
def upright(tmp_path_factory, device) -> Exported:
    """A picture of another shape than the scene's render settings have."""
    return _exported(tmp_path_factory.mktemp("upright") / "contact", ("environment",), (SIZE[1], SIZE[0]))
