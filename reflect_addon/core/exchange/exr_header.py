"""The header of an OpenEXR file, as far as it says how much memory the picture takes [OpenEXR, "OpenEXR File Layout"].

It is read before a decoder sees the file: scan lines in one part, all channels alike and whole, a data window that begins at 0.
"""

import struct
from dataclasses import dataclass

MAGIC = b"\x76\x2f\x31\x01"
MOST = 1 << 16  # bytes that a header is looked for in
_TYPES, _COMPRESSIONS = {1: "half", 2: "float"}, {0: "none", 2: "zips", 3: "zip"}


@dataclass(frozen=True)
class Header:
    channels: tuple[str, ...]  # in the file's order, which is the alphabet's
    type: str  # of all of them
    compression: str
    width: int
    height: int

    def __str__(self) -> str:
        return f"{self.width} x {self.height} {''.join(self.channels)} {self.type} {self.compression}"


def header_of(data: bytes | bytearray) -> Header | None:
    """What a whole file's header says; None for what is no EXR of the kind above."""
    head = bytes(data[:MOST])
    if head[:4] != MAGIC or head[4:8] != b"\x02\0\0\0":  # version 2, no tiles, long names, deep data or parts
        return None
    try:
        found = _attributes(head)
        channels, kind = _channels(found["channels"])
        left, bottom, right, top = struct.unpack("<4i", found["dataWindow"])
        compression = _COMPRESSIONS[found["compression"][0]]
    except (KeyError, ValueError, IndexError, struct.error):
        return None
    if (left, bottom) != (0, 0) or right < 0 or top < 0:
        return None
    return Header(channels, kind, compression, right + 1, top + 1)


def _attributes(head: bytes) -> dict[str, bytes]:
    found, at = {}, 8
    while head[at : at + 1] != b"\0":
        name, at = _word(head, at)
        _, at = _word(head, at)
        (size,) = struct.unpack_from("<I", head, at)
        if at + 4 + size > len(head):
            raise ValueError("cut short")
        if name in found:
            raise ValueError("said twice: a decoder may believe the other one")
        found[name] = head[at + 4 : at + 4 + size]
        at += 4 + size
        if at >= len(head):
            raise ValueError("cut short")
    return found


def _channels(value: bytes) -> tuple[tuple[str, ...], str]:
    names, kinds, at = [], set(), 0
    while value[at : at + 1] != b"\0":
        name, at = _word(value, at)
        kind, _, across, down = struct.unpack_from("<iIii", value, at)
        if (across, down) != (1, 1):
            raise ValueError("subsampled")
        names.append(name)
        kinds.add(_TYPES[kind])
        at += 16
    (one,) = kinds
    return tuple(names), one


def _word(data: bytes, at: int) -> tuple[str, int]:
    end = data.index(b"\0", at, at + 256)
    return data[at:end].decode("ascii"), end + 1
