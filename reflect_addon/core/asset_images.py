"""The kinds of image that an asset holds, by the last part of their names: what each stores, and how large it is.

    _tx   float16 (H, W, 4): radiance and what goes with it
    _buf  float32 (H, W, 4): tables
    _bc1  uint8 (H / 4, W / 4, 8): rgb in [0, 1] as BC1 blocks (core/bc1.py), 4 bits a texel; alpha reads as 1

Kernels read all of them alike, texel by texel.
"""

from dataclasses import dataclass

import numpy as np

from . import bc1


@dataclass(frozen=True)
class ImageKind:
    """How the elements of the array's first two axes are stored."""

    dtype: str  # NumPy's, little-endian
    items: int  # values of an element: the last axis
    side: int  # of an element, texels
    bytes: int  # of an element on the GPU
    ending: str  # of its files
    unit: str


KINDS = {
    "tx": ImageKind("<f2", 4, 1, 8, "npy", "radiance, scene-linear Rec.709 / scale"),
    "buf": ImageKind("<f4", 4, 1, 16, "npy", "table, see the method"),
    "bc1": ImageKind("|u1", bc1.BYTES, bc1.SIDE, bc1.BYTES, "dds", "code in [0, 1], BC1 blocks, see the method"),
}


def kind_of(name: str) -> ImageKind:
    """KeyError for a name of no kind."""
    return KINDS[name.rpartition("_")[2]]


def size_of(image: np.ndarray) -> tuple[int, int]:
    """(width, height) in texels."""
    side = bc1.SIDE if image.dtype == np.uint8 else 1
    return image.shape[1] * side, image.shape[0] * side


def texels(image: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """(..., 4) the texels at integers x, y inside the image, in its own type or float32. Blocks are read where they lie: a
    compressed light field would be 24 times as large as floats."""
    if image.dtype == np.uint8:
        rgb = bc1.texels(image, x, y)
        return np.concatenate([rgb, np.ones_like(rgb[..., :1])], -1)
    return image.reshape(-1, 4)[y * image.shape[1] + x]
