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


def write_exr(path: Path, channels: np.ndarray, remedy: str = ELSEWHERE, compression: str = "none") -> None:
    """Writes (H, W, C) as an EXR, float16 as half floats and all else as float32, whole or not at all. compression: OpenEXR's word. ReflectError (disk full)
    names the file, and the remedy."""
    oiio = bundled("OpenImageIO")
    height, width, count = channels.shape
    kind = np.float16 if channels.dtype == np.float16 else np.float32
    spec = oiio.ImageSpec(width, height, count, "half" if kind is np.float16 else "float")
    spec.attribute("compression", compression)
    with whole_file(path, remedy) as temporary:
        out = oiio.ImageOutput.create(str(temporary))
        if out is None or not out.open(str(temporary), spec):
            raise OSError(_reason(oiio.geterror() if out is None else out.geterror()))
        written = out.write_image(np.ascontiguousarray(channels[::-1], kind))
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


def read_whole_exr(path: Path, height: int, width: int, kind: str) -> np.ndarray:
    """(H, W, 4) of a file whose header is known to say RGBA of this kind, "half" or "float" (core/exchange/exr_header.py). ReflectError where it does not decode."""
    oiio = bundled("OpenImageIO")
    source = oiio.ImageInput.open(str(path))
    if source is None:
        raise ReflectError(f"{path} is damaged: {_reason(oiio.geterror())}.", "Export it again.")
    try:
        pixels = source.read_image(0, 0, 0, 4, kind)
        if pixels is None or pixels.shape != (height, width, 4) or source.spec().channelnames != ("R", "G", "B", "A"):
            raise ReflectError(f"{path} is damaged: {_reason(source.geterror())}.", "Export it again.")
    finally:
        source.close()
    return np.ascontiguousarray(pixels[::-1], "<f2" if kind == "half" else "<f4")


def stacked(channels: dict[str, np.ndarray], layer: str, names: str) -> np.ndarray:
    """(H, W, len(names)) of one pass: stacked(channels, "Position", "XYZ"). A missing pass is an error (KeyError)."""
    return np.stack([channels[f"{layer}.{name}"] for name in names], -1)


def _unreadable(path: Path, reason: str) -> ReflectError:
    return ReflectError(f"Cannot read the temporary file {path} ({_reason(reason)}).", NO_ROOM)


def _reason(text: str) -> str:
    return " ".join(text.split()) or "no reason given"
