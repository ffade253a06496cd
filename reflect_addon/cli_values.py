"""What may stand after an option of the command line: each a function of its text, which raises argparse's error with what would do."""

import argparse
import json
import re
from pathlib import Path

from .core.parts import Part
from .core.spaces import FAR

LARGEST_SIDE = 16384  # px: what graphics cards take
LARGEST_AREA = 1 << 26  # px: 64 million float4 pixels are 1 GiB
LAST_FRAME = 1048574  # Blender's own limit
EXAMPLE = "for example 240x180"


def size(text: str) -> tuple[int, int]:
    match = re.fullmatch(r"(\d{1,9})x(\d{1,9})", text.strip().lower())
    if not match:
        raise argparse.ArgumentTypeError(f"'{text}' is not a size; write WIDTHxHEIGHT, {EXAMPLE}")
    width, height = int(match[1]), int(match[2])
    if not (1 <= width <= LARGEST_SIDE and 1 <= height <= LARGEST_SIDE and width * height <= LARGEST_AREA):
        raise argparse.ArgumentTypeError(
            f"{width}x{height} is not possible; sides are 1 to {LARGEST_SIDE} and at most {LARGEST_AREA:,} pixels, {EXAMPLE}"
        )
    return width, height


def frame(text: str) -> int:
    if not re.fullmatch(r"-?\d{1,7}", text) or abs(int(text)) > LAST_FRAME:
        raise argparse.ArgumentTypeError(f"'{text}' is not a frame; Blender's go from -{LAST_FRAME} to {LAST_FRAME}")
    return int(text)


def positive(text: str) -> int:
    if not re.fullmatch(r"\d{1,6}", text) or int(text) < 1:
        raise argparse.ArgumentTypeError(f"'{text}' is not a whole number from 1 to 999999")
    return int(text)


def metres(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = -1.0
    if not 0 <= value < FAR:
        raise argparse.ArgumentTypeError(f"'{text}' is not a distance in metres, 0 or more")
    return value


def resolution(text: str) -> int:
    value = positive(text)
    if value & (value - 1) or not 4 <= value <= 8192:
        raise argparse.ArgumentTypeError(f"'{text}' is not a power of two from 4 to 8192")
    return value


def setting(text: str) -> tuple[str, object]:
    name, equals, value = text.partition("=")
    if not (name and equals):
        raise argparse.ArgumentTypeError(f"'{text}' is not NAME=VALUE")
    try:
        given = json.loads(value)
    except ValueError:
        return name, value  # a word
    return name, tuple(given) if isinstance(given, list) else given


def picture(text: str) -> Path:
    path = Path(text)
    if path.suffix.lower() not in {".png", ".exr"}:
        raise argparse.ArgumentTypeError(f"'{text}' must end in .png or .exr")
    return path


def blend(text: str) -> Path:
    if Path(text).suffix.lower() != ".blend":
        raise argparse.ArgumentTypeError(f"'{text}' must end in .blend")
    return Path(text)


def part(text: str) -> Part:
    try:
        return Part.parse(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from error
