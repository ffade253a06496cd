"""Where an asset lies: `//reflect/<scene>/<kind>-<name>/` beside the .blend, elsewhere while it is unsaved."""

import hashlib
import re
from pathlib import Path

# A name that is its own file name on every system: plain characters, no dot or space at its ends ...
_PLAIN = re.compile(r"[A-Za-z0-9_](?:[A-Za-z0-9_. -]{0,58}[A-Za-z0-9_])?")
# ... and none of the words that Windows keeps for devices.
_DEVICES = re.compile(r"(?i)(con|prn|aux|nul|com\d|lpt\d)(\..*)?")


def file_name(name: str) -> str:
    """A file name for a data-block's name: readable, valid everywhere, never shared by two different names.

    Names in Title Case ("Suzanne", "Mirror Ball.001") stay as they are. All others get a part of their checksum, because
    macOS and Windows take "ball" and "Ball" for one file; "~" occurs in no plain name.
    """
    if name == name.title() and _PLAIN.fullmatch(name) and not _DEVICES.fullmatch(name):
        return name
    readable = re.sub(r"[^A-Za-z0-9_-]+", "_", name)[:40]
    return f"{readable}~{hashlib.sha256(name.encode('utf-8', 'surrogatepass')).hexdigest()[:10]}"


def scene_folder(blend_path: Path | str | None, scene_name: str, user_folder: Path | None = None) -> Path:
    """The folder of a scene's assets. user_folder: where they go while the .blend was never saved (scene/places.py)."""
    if blend_path:
        return Path(blend_path).absolute().parent / "reflect" / file_name(scene_name)
    if user_folder is None:
        raise ValueError("an unsaved file needs the user's folder")
    return Path(user_folder) / "unsaved" / file_name(scene_name)


def asset_name(kind: str, reflector: str) -> str:
    """'<kind>-<name>'; '<kind>-all' for the asset of all reflectors (an object called "all" gets a checksum)."""
    return f"{kind}-{file_name(reflector) if reflector else 'all'}"


def asset_folder(
    blend_path: Path | str | None, scene_name: str, kind: str, reflector: str, user_folder: Path | None = None
) -> Path:
    """The folder of one asset."""
    return scene_folder(blend_path, scene_name, user_folder) / asset_name(kind, reflector)
