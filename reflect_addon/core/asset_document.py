"""What asset.json says: every field of an asset and every line of its table of images, checked before it is used.

Nothing here touches a disk; `path` is the file that errors name.
"""

import re
from pathlib import Path

import numpy as np

from .asset import Asset, Part
from .asset_images import KINDS, ImageKind, kind_of
from .errors import ReflectError

MAX_SIDE = 16384  # texels: the largest texture that Blender's OpenGL promises here

MOST_DEEP = 32  # lists and tables in those of a setting: JSON may hold more than Python's own calls can follow

BAKE_AGAIN = "Bake it again."
IMAGE_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,63}_(?:%s)" % "|".join(KINDS))
FILE_NAME = re.compile(IMAGE_NAME.pattern + r"-[0-9a-f]{12}\.(?:npy|dds)")
_WORD = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,63}")
_HEX = re.compile(r"[0-9a-f]{1,64}")


def document_of(asset: Asset) -> dict:
    """Asset's fields except images, for json.dumps(..., default=plain)."""
    return {
        "kind": asset.kind,
        "reflector": asset.reflector,
        "settings": asset.settings,
        "uniforms": asset.uniforms,
        "options": asset.options,
        "requires": asset.requires,
        "inputs_hash": asset.inputs_hash,
        "source": asset.source,
        "bake_seconds": asset.bake_seconds,
        "light_hash": asset.light_hash,
        "items": asset.items,
        "balls": asset.balls,
        "parts": [vars(part) for part in asset.parts],
    }


def plain(value):
    """NumPy scalars and arrays as JSON has them."""
    if isinstance(value, np.generic | np.ndarray):
        return value.tolist()
    raise TypeError(f"{type(value).__name__} is no JSON value")


def checked_fields(path: Path, document: dict) -> dict:
    """Asset's fields except images, each checked; ReflectError names the first that is wrong."""
    strings = {key: document.get(key) for key in ("kind", "reflector", "inputs_hash", "source")}
    for key, value in strings.items():
        if not isinstance(value, str):
            raise corrupt(path, f"its {key} is no text")
    if not _WORD.fullmatch(strings["kind"]):
        raise corrupt(path, "its kind is no method's name")
    uniforms, options, settings = (document.get(key) for key in ("uniforms", "options", "settings"))
    for key, value in (("uniforms", uniforms), ("options", options), ("settings", settings)):
        if not isinstance(value, dict):
            raise corrupt(path, f"its {key} are no table")
    for key, value in uniforms.items():
        items = value if isinstance(value, list) else [value]
        if not _WORD.fullmatch(key) or not all(_is_number(v) for v in items) or (
            isinstance(value, list) and not 2 <= len(value) <= 4
        ):
            raise corrupt(path, f"its uniform {key!r} is not 1 to 4 finite numbers")
    for key, value in options.items():
        if not _WORD.fullmatch(key) or not (isinstance(value, str | bool) or _is_number(value)):
            raise corrupt(path, f"its option {key!r} is neither number, switch nor text")
    requires = document.get("requires")
    if not isinstance(requires, list) or not all(isinstance(r, str) and _WORD.fullmatch(r) for r in requires):
        raise corrupt(path, "what it requires is no list of methods")
    seconds = document.get("bake_seconds")
    if not _is_number(seconds) or seconds < 0:
        raise corrupt(path, "its bake time is no duration")
    light_hash = document.get("light_hash", "")
    if not isinstance(light_hash, str):
        raise corrupt(path, "its light_hash is no text")
    parts = document.get("parts", [])  # assets of format 1 from before there were any have none
    if not isinstance(parts, list) or not all(_is_part(p) for p in parts):
        raise corrupt(path, "its parts do not say what rows stand for")
    items, balls = document.get("items", {}), document.get("balls", {})  # as parts
    if not isinstance(items, dict) or not all(_WORD.fullmatch(aspect) and _is_named(named, _is_hash) for aspect, named in items.items()):
        raise corrupt(path, "its items do not say what it was made from")
    if not _is_named(balls, _is_ball):
        raise corrupt(path, "its balls do not say where things were")
    try:
        settings = {key: _tuples(value) for key, value in settings.items()}
    except RecursionError as error:
        raise corrupt(path, "its settings are nested too deeply") from error
    return {
        **strings,
        "light_hash": light_hash,
        "items": items,
        "balls": {name: tuple(map(float, ball)) for name, ball in balls.items()},
        "parts": tuple(Part(**{**p, "world_from_object": tuple(map(float, p["world_from_object"]))}) for p in parts),
        "uniforms": {k: tuple(map(float, v)) if isinstance(v, list) else float(v) for k, v in uniforms.items()},
        "options": options,
        "settings": settings,
        "requires": tuple(requires),
        "bake_seconds": float(seconds),
    }


def checked_entry(path: Path, name: str, entry) -> tuple[ImageKind, str, tuple[int, ...], str]:
    """(kind, file name, shape, sha256) of one line of the image table."""
    kind = kind_of(name)
    entry = entry if isinstance(entry, dict) else {}
    file, shape, sha256 = entry.get("file"), entry.get("shape"), entry.get("sha256")
    if not isinstance(file, str) or not re.fullmatch(r"[A-Za-z0-9_-]+\." + kind.ending, file):
        raise corrupt(path, f"image {name} names no file inside the folder")
    dtype, most = np.dtype(kind.dtype), MAX_SIDE // kind.side
    if entry.get("dtype") != dtype.name:
        raise corrupt(path, f"image {name} has type {entry.get('dtype')!r} instead of {dtype.name}")
    if not isinstance(shape, list) or len(shape) != 3 or not all(is_int(n) and 1 <= n <= most for n in shape):
        raise corrupt(path, f"image {name} has the shape {str(shape)[:60]}; sides are 1 to {most}")
    if shape[2] != kind.items:
        raise corrupt(path, f"image {name} has {shape[2]} channels instead of {kind.items}")
    if not isinstance(sha256, str) or not re.fullmatch(r"[0-9a-f]{64}", sha256):
        raise corrupt(path, f"image {name} has no checksum")
    return kind, file, tuple(shape), sha256


def _is_part(value) -> bool:
    """Whether a JSON value is a Part."""
    if not isinstance(value, dict) or value.keys() != Part.__annotations__.keys():
        return False
    place = value["world_from_object"]
    return (
        isinstance(value["instance"], str)
        and isinstance(value["mesh"], str)
        and isinstance(value["kind"], str)
        and bool(_WORD.fullmatch(value["kind"]))
        and is_int(value["row"])
        and -1 <= value["row"] < MAX_SIDE
        and isinstance(place, list)
        and len(place) == 16
        and all(_is_number(n) for n in place)
    )


def _is_named(value, is_right) -> bool:
    """Whether a JSON value is an object of right values."""
    return isinstance(value, dict) and all(map(is_right, value.values()))


def _is_hash(value) -> bool:
    return isinstance(value, str) and bool(_HEX.fullmatch(value))


def _is_ball(value) -> bool:
    return isinstance(value, list) and len(value) == 4 and all(map(_is_number, value)) and value[3] >= 0


def is_int(value) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)


def _is_number(value) -> bool:
    """A finite number that a float32 can hold."""
    return isinstance(value, int | float) and not isinstance(value, bool) and -3.4e38 <= value <= 3.4e38


def _tuples(value, deep: int = 0):
    if deep > MOST_DEEP:
        raise RecursionError
    if isinstance(value, dict):
        return {key: _tuples(item, deep + 1) for key, item in value.items()}
    return tuple(_tuples(item, deep + 1) for item in value) if isinstance(value, list) else value


def corrupt(path: Path, why: str) -> ReflectError:
    return ReflectError(f"{path} is damaged: {why}.", BAKE_AGAIN)
