"""An asset's image as the bytes of its file and back: .npy of format 1.0 (never pickled), .dds for BC1 blocks."""

import re

import numpy as np

from . import dds
from .asset_images import ImageKind

MOST_HEADER_BYTES = 1024
LEAST_HEADER_BYTES = 64
_NPY_HEADER = re.compile(
    rb"\{'descr': '(<f[24])', 'fortran_order': False, 'shape': \((\d{1,6}), (\d{1,6}), (\d{1,6})\), \} *\n"
)


def parts_of(kind: ImageKind, image: np.ndarray) -> tuple[bytes, np.ndarray]:
    """(header, contiguous body) of its file."""
    if kind.ending == "dds":
        return dds.header(image.shape), dds.body(image)
    return _npy_header(kind.dtype, image.shape), np.ascontiguousarray(image, kind.dtype)


def image_of(kind: ImageKind, data: bytearray, shape: tuple[int, ...]) -> np.ndarray | None:
    """The image, writable, of a whole file; None when the file does not hold exactly this kind and shape."""
    if kind.ending == "dds":
        return dds.blocks(data, shape)
    start = 10 + int.from_bytes(data[8:10], "little")
    header = _NPY_HEADER.fullmatch(bytes(data[10:start])) if data[:8] == b"\x93NUMPY\x01\x00" else None
    found = (header[1].decode(), tuple(map(int, header.groups()[1:]))) if header else None
    if found != (kind.dtype, shape) or len(data) - start != int(np.prod(shape)) * np.dtype(kind.dtype).itemsize:
        return None
    return np.frombuffer(data, kind.dtype, offset=start).reshape(shape)


def _npy_header(dtype: str, shape: tuple[int, ...]) -> bytes:
    """Header of the .npy format 1.0, padded so that the data start at a multiple of 64 bytes."""
    text = f"{{'descr': '{dtype}', 'fortran_order': False, 'shape': {tuple(shape)}, }}".encode()
    text += b" " * (-(10 + len(text) + 1) % 64) + b"\n"
    return b"\x93NUMPY\x01\x00" + len(text).to_bytes(2, "little") + text
