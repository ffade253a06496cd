"""Float EXR files in and out: ray images for the OSL camera, multilayer results of Cycles.

Row 0 is the top row in the files and the bottom row in our arrays (core/spaces.py); both functions flip.
"""

import importlib
from pathlib import Path

import bpy
import numpy as np

from ..core.errors import ReflectError
from ..core.processes import NO_ROOM
from ..core.safe_write import ELSEWHERE, whole_file


def bundled(name: str):
    """A Python module that official Blender builds bundle off the path (OpenImageIO, oslquery, PyOpenColorIO)."""
    bpy.utils.expose_bundled_modules()
    try:
        return importlib.import_module(name)
    except ImportError as error:
        raise ReflectError(
            f"This Blender ({bpy.app.version_string}) was built without the Python module {name}, which baking needs.",
            "Use the official build from blender.org, or set 'Bake Worker' in the add-on's preferences to the "
            "project's own Python (.venv/bin/python).",
        ) from error


def write_exr(path: Path, channels: np.ndarray, remedy: str = ELSEWHERE) -> None:
    """Writes (H, W, C) float32 as an uncompressed EXR, whole or not at all. ReflectError (disk full) names the file, and
    the remedy."""
    oiio = bundled("OpenImageIO")
    height, width, count = channels.shape
    spec = oiio.ImageSpec(width, height, count, "float")
    spec.attribute("compression", "none")
    with whole_file(path, remedy) as temporary:
        out = oiio.ImageOutput.create(str(temporary))
        if out is None or not out.open(str(temporary), spec):
            raise OSError(_reason(oiio.geterror() if out is None else out.geterror()))
        written = out.write_image(np.ascontiguousarray(channels[::-1], np.float32))
        if not (out.close() and written):
            raise OSError(_reason(out.geterror()))


def read_exr(path: Path) -> dict[str, np.ndarray]:
    """Channels by name without the view layer's ("Combined.R"), each (H, W) float32, of a single-part EXR."""
    oiio = bundled("OpenImageIO")
    source = oiio.ImageInput.open(str(path))
    if source is None:
        raise _unreadable(path, oiio.geterror())
    try:
        spec = source.spec()
        pixels = source.read_image("float")
        if pixels is None:
            raise _unreadable(path, source.geterror())
    finally:
        source.close()
    pixels = np.asarray(pixels, np.float32).reshape(spec.height, spec.width, spec.nchannels)[::-1]
    return {".".join(name.split(".")[-2:]): pixels[..., i] for i, name in enumerate(spec.channelnames)}


def stacked(channels: dict[str, np.ndarray], layer: str, names: str) -> np.ndarray:
    """(H, W, len(names)) of one pass: stacked(channels, "Position", "XYZ"). A missing pass is an error (KeyError)."""
    return np.stack([channels[f"{layer}.{name}"] for name in names], -1)


def _unreadable(path: Path, reason: str) -> ReflectError:
    return ReflectError(f"Cannot read the temporary file {path} ({_reason(reason)}).", NO_ROOM)


def _reason(text: str) -> str:
    return " ".join(text.split()) or "no reason given"
