"""In place of Khronos' `ktx create`, which no registry here has: as far as its manual says what `--raw` makes, with a data format descriptor as the specification asks.

A file named `ktx` runs this: stand_in makes it.
"""

import argparse
import struct
import sys
from pathlib import Path

import zstandard

FORMATS = {"R16G16B16A16_SFLOAT": (97, 2), "R32G32B32A32_SFLOAT": (109, 4)}


def stand_in(folder: Path) -> Path:
    """The program in a folder, which may be put on PATH."""
    path = folder / "ktx"
    path.write_text(f'#!/bin/sh\nexec "{sys.executable}" "{Path(__file__).resolve()}" "$@"\n')
    path.chmod(0o755)
    return path


def main(words: list[str]) -> int:
    if words == ["--version"]:
        print("ktx version: v4.4.2 (stand-in)")
        return 0
    parser = argparse.ArgumentParser()
    parser.add_argument("create", choices=["create"])
    parser.add_argument("--raw", action="store_true", required=True)
    for name in ("format", "width", "height", "zstd"):
        parser.add_argument(f"--{name}", required=True)
    parser.add_argument("input", type=Path)
    parser.add_argument("output", type=Path)
    given = parser.parse_args(words)
    vk, size = FORMATS[given.format]
    data = given.input.read_bytes()
    assert len(data) == int(given.width) * int(given.height) * 4 * size
    packed = zstandard.ZstdCompressor(level=int(given.zstd)).compress(data)
    described = _descriptor(size)
    start = -(-(104 + len(described)) // 8) * 8
    head = struct.pack("<12s9I", b"\xabKTX 20\xbb\r\n\x1a\n", vk, size, int(given.width), int(given.height), 0, 0, 1, 1, 2)
    head += struct.pack("<4I2Q3Q", 104, len(described), 0, 0, 0, 0, start, len(packed), len(data))
    given.output.write_bytes((head + described).ljust(start, b"\0") + packed)
    return 0


def _descriptor(size: int) -> bytes:
    """A basic descriptor block of four signed float samples [Khronos Data Format 1.3, 5]."""
    samples = b"".join(
        struct.pack("<HBBIii", 8 * size * k, 8 * size - 1, channel | 0xC0, 0, struct.unpack("<i", struct.pack("<f", -1))[0], struct.unpack("<i", struct.pack("<f", 1))[0])
        for k, channel in enumerate((0, 1, 2, 15))
    )
    block = struct.pack("<HHHHBBBB4B8B", 0, 0, 2, 24 + len(samples), 1, 1, 1, 0, 0, 0, 0, 0, *([0] * 8)) + samples
    return struct.pack("<I", 4 + len(block)) + block


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
