"""BC1 blocks to the GPU. Blender's Python can make no texture of them, but its images can: a .dds file of the colour space
Non-Color stays compressed on its way. So one is written, loaded and deleted; the texture outlives the image.

Blender's rules, as 5.2 shows them. Sides are powers of two, else the texture is not compressed: the last row and column are
repeated up to there, which clamped look-ups do not notice. And the first texture of a session must not be the compressed one:
the driver's start leaves an error behind that is taken for its own. A driver without BC1 gets RGBA8: the same picture,
11 times the memory.
"""

import os
import tempfile

import bpy
import numpy as np

from ..core import bc1, dds
from ..core.errors import ReflectError
from .device import ensure

FORMAT = "RGBA8_DXT1"


def size(blocks: np.ndarray) -> tuple[int, int]:
    """(width, height) in texels of the texture for these blocks. Raises ReflectError for what are none."""
    if blocks.ndim != 3 or blocks.shape[2] != bc1.BYTES or blocks.dtype != np.uint8 or 0 in blocks.shape:
        raise ReflectError(f"An image has shape {blocks.shape}, which is no blocks of BC1.", "Bake this asset again.")
    return _power(blocks.shape[1]) * bc1.SIDE, _power(blocks.shape[0]) * bc1.SIDE


def texture_from(name: str, blocks: np.ndarray):
    """A texture with texel (x, y) of the blocks at (x, y), of FORMAT where the driver has it; filtering is off.

    The file's data are as before: neither an image nor a change is left. ReflectError where no temporary file can be written.
    """
    gpu = ensure()
    gpu.types.GPUTexture((1, 1), format="RGBA8")  # takes the start's error on itself
    rows, columns = _power(blocks.shape[0]), _power(blocks.shape[1])
    if blocks.shape[:2] != (rows, columns):
        blocks = bc1.extended(blocks, rows, columns)
    handle, path = -1, ""
    try:
        handle, path = tempfile.mkstemp(prefix="reflect-", suffix=".dds", dir=bpy.app.tempdir or None)
        with open(handle, "wb") as file:
            file.write(dds.header(blocks.shape))
            file.write(dds.body(blocks))
        return _texture_of(gpu, path)
    except (OSError, RuntimeError) as error:
        raise ReflectError(
            f"Image '{name}' could not go to the GPU by way of the temporary file {path}: {getattr(error, 'strerror', None) or error}.",
            "Make room on the disk of temporary files (Preferences, File Paths), or bake without compression.",
        ) from error
    finally:
        if path:
            os.unlink(path)


def _texture_of(gpu, path: str):
    image = bpy.data.images.load(path)
    try:
        image.colorspace_settings.name = "Non-Color"  # sRGB would not stay compressed
        image.alpha_mode = "CHANNEL_PACKED"
        texture = gpu.texture.from_image(image)
    finally:
        bpy.data.images.remove(image)
    texture.filter_mode(False)
    texture.extend_mode("EXTEND")
    return texture


def _power(count: int) -> int:
    """The smallest power of two that is not below count."""
    return 1 << (count - 1).bit_length()
