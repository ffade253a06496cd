"""Float images as KTX2, written by Khronos' own program `ktx` [KTX-Software, "ktx create"], read by Zstandard, which Blender brings along.

Texels are what they were, to the bit: Zstandard packs them in place of EXR's deflate, and a graphics card takes them as they come out. Row 0 of our arrays is the
picture's bottom row, and the file's last.
"""

import shutil
import subprocess
from pathlib import Path

import numpy as np

from ..core.errors import ReflectError
from ..core.exchange.ktx2_header import ZSTANDARD, header_of
from .exr import bundled

PROGRAM = "ktx"
LEVEL = "18"  # of Zstandard's 22: those above 20 want much memory of who unpacks
SECONDS = 600  # for one image
REMEDY = "Install KTX-Software (it has a program `ktx`) and put it on PATH, or leave --ktx2 out."


def find_ktx() -> str:
    """The program's path. ReflectError: there is none, or what bears its name is another one (Debian has a game client called `ktx`)."""
    path = shutil.which(PROGRAM)
    if path is None:
        raise ReflectError(f"There is no {PROGRAM} on PATH to write KTX2 with.", REMEDY)
    try:
        said = subprocess.run([path, "--version"], capture_output=True, text=True, timeout=10, stdin=subprocess.DEVNULL).stdout
    except (OSError, subprocess.TimeoutExpired):
        said = ""
    if not said.startswith("ktx version"):
        raise ReflectError(f"{path} is not Khronos' {PROGRAM}.", REMEDY)
    return path


def write_ktx2(program: str, path: Path, array: np.ndarray) -> None:
    """Writes (H, W, 4), halfs or floats, to a new file. ReflectError with what the program said."""
    half = array.dtype == np.float16
    height, width = array.shape[:2]
    raw = path.with_suffix(".raw")
    try:
        np.ascontiguousarray(array[::-1], "<f2" if half else "<f4").tofile(raw)
        format_ = "R16G16B16A16_SFLOAT" if half else "R32G32B32A32_SFLOAT"
        command = [program, "create", "--raw", "--format", format_, "--width", str(width), "--height", str(height), "--zstd", LEVEL, str(raw), str(path)]
        run = subprocess.run(command, capture_output=True, text=True, timeout=SECONDS, stdin=subprocess.DEVNULL)
        found = header_of(path.read_bytes()) if run.returncode == 0 and path.is_file() else None
    except subprocess.TimeoutExpired as error:
        raise ReflectError(f"{program} took more than {SECONDS} s for an image.", REMEDY) from error
    finally:
        raw.unlink(missing_ok=True)
    if found is None or (found[0].width, found[0].height, found[0].type) != (width, height, "half" if half else "float"):
        said = " ".join((run.stderr or run.stdout).split())[-200:]
        raise ReflectError(f"{program} wrote no KTX2 of {width} x {height} texels: {said or 'it gave no reason'}.", REMEDY)


def read_ktx2(path: Path, data: bytes | bytearray) -> np.ndarray:
    """(H, W, 4) of a file whose header has been held against the manifest. ReflectError where it does not unpack."""
    header, texels = header_of(data)
    body = bytes(memoryview(data)[texels.start : texels.start + texels.length])
    if texels.scheme == ZSTANDARD:
        body = _unpacked(path, body, header.bytes())
    kind = "<f2" if header.type == "half" else "<f4"
    return np.ascontiguousarray(np.frombuffer(body, kind).reshape(header.height, header.width, 4)[::-1])


def _unpacked(path: Path, packed: bytes, size: int) -> bytes:
    zstandard = bundled("zstandard")
    damaged = ReflectError(f"{path} is damaged: it does not unpack to the size that its header says.", "Export it again.")
    try:
        # A frame that declares more than the header is refused before memory is taken.
        if zstandard.frame_content_size(packed) not in (size, -1):
            raise damaged
        body = zstandard.ZstdDecompressor().decompress(packed, max_output_size=size, allow_extra_data=False)
    except zstandard.ZstdError as error:
        raise damaged from error
    if len(body) != size:
        raise damaged
    return body
