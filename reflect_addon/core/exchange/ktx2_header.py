"""The header of a KTX2 file, as far as it says how much memory the picture takes and where its texels lie [Khronos, "KTX File Format Specification 2.0", 3].

One picture without mips, layers or faces, of half or single floats in four channels, as it is or by Zstandard.
"""

import struct
from dataclasses import dataclass

MAGIC = b"\xabKTX 20\xbb\r\n\x1a\n"
FORMATS = {97: "half", 109: "float"}  # VK_FORMAT_R16G16B16A16_SFLOAT, VK_FORMAT_R32G32B32A32_SFLOAT
ZSTANDARD = 2  # supercompressionScheme; 0: none
_HEAD = struct.Struct("<12s9I4I2Q3Q")
TEXEL_BYTES = {"half": 8, "float": 16}


@dataclass(frozen=True)
class Header:
    type: str  # "half" or "float", of all four channels
    width: int
    height: int

    def __str__(self) -> str:
        return f"{self.width} x {self.height} RGBA {self.type}"

    def bytes(self) -> int:
        return self.width * self.height * TEXEL_BYTES[self.type]


@dataclass(frozen=True)
class Texels:
    """Where they lie in the file."""

    start: int
    length: int
    scheme: int


def header_of(data: bytes | bytearray) -> tuple[Header, Texels] | None:
    """What a whole file's header says; None for what is no KTX2 of the kind above, or whose texels lie outside of it."""
    if len(data) < _HEAD.size or data[: len(MAGIC)] != MAGIC:
        return None
    _, vk, _size, width, height, depth, layers, faces, levels, scheme, *_descriptions, start, length, unpacked = _HEAD.unpack_from(data)
    if vk not in FORMATS or (depth, layers, faces, levels) != (0, 0, 1, 1) or scheme not in (0, ZSTANDARD):
        return None
    header = Header(FORMATS[vk], width, height)
    if unpacked != header.bytes() or not _HEAD.size <= start <= start + length <= len(data) or (scheme == 0 and length != unpacked):
        return None
    return header, Texels(start, length, scheme)
