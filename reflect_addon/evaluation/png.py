"""8-bit PNG files from arrays, with the standard library only: no colour management may touch what is written."""

import struct
import zlib
from pathlib import Path

import numpy as np

from ..core.safe_write import write_whole


def write_png(path: Path, picture: np.ndarray) -> None:
    """The picture (see png_bytes) as a file. ReflectError without room."""
    write_whole(path, png_bytes(picture))


def png_bytes(picture: np.ndarray) -> bytes:
    """picture: (H, W, 3) display-encoded 0..1, row 0 at the bottom. Not finite is black."""
    values = np.clip(np.nan_to_num(np.asarray(picture, np.float32), nan=0.0, posinf=1.0, neginf=0.0), 0, 1)
    pixels = np.rint(values[::-1] * 255).astype(np.uint8)
    height, width, _ = pixels.shape
    rows = np.concatenate([np.zeros((height, 1), np.uint8), pixels.reshape(height, width * 3)], 1)  # filter 0
    header = struct.pack(">2I5B", width, height, 8, 2, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
        for kind, data in ((b"IHDR", header), (b"IDAT", zlib.compress(rows.tobytes(), 6)), (b"IEND", b""))
    )
