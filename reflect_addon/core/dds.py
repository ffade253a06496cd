"""BC1 blocks as a .dds file: 128 bytes of header with the code DXT1, then the blocks [Microsoft, "Programming guide for DDS"].

Files have their top row first, arrays their bottom row (core/spaces.py): rows of blocks, and rows within blocks, are turned
on the way, so that every program shows the picture upright.
"""

import struct

import numpy as np

from . import bc1

HEADER_BYTES = 128
_CAPS, _HEIGHT, _WIDTH, _PIXEL_FORMAT, _LINEAR_SIZE = 0x1, 0x2, 0x4, 0x1000, 0x80000
_FOURCC, _TEXTURE = 0x4, 0x1000


def header(shape: tuple[int, ...]) -> bytes:
    """The header of blocks of this shape, (H / 4, W / 4, 8)."""
    rows, columns = shape[:2]
    flags = _CAPS | _HEIGHT | _WIDTH | _PIXEL_FORMAT | _LINEAR_SIZE
    sizes = struct.pack("<7I", 124, flags, rows * bc1.SIDE, columns * bc1.SIDE, rows * columns * bc1.BYTES, 0, 0)
    pixel_format = struct.pack("<2I4s5I", 32, _FOURCC, b"DXT1", 0, 0, 0, 0, 0)
    return b"DDS " + sizes + bytes(44) + pixel_format + struct.pack("<5I", _TEXTURE, 0, 0, 0, 0)


def body(blocks: np.ndarray) -> np.ndarray:
    """The blocks as they lie in the file: a contiguous copy."""
    return _turned(blocks)


def blocks(data: bytes | bytearray, shape: tuple[int, ...]) -> np.ndarray | None:
    """(H / 4, W / 4, 8) uint8, writable, of a whole file; None when its header or length is not that of this shape."""
    if bytes(data[:HEADER_BYTES]) != header(shape) or len(data) != HEADER_BYTES + shape[0] * shape[1] * bc1.BYTES:
        return None
    return _turned(np.frombuffer(data, np.uint8, offset=HEADER_BYTES).reshape(shape))


def _turned(blocks: np.ndarray) -> np.ndarray:
    out = np.empty(blocks.shape, np.uint8)
    out[..., :4] = blocks[::-1, :, :4]
    out[..., 4:] = blocks[::-1, :, :3:-1]
    return out
