"""Assets on disk: a folder with asset.json and one file per image (design.md, "Assets on disk").

Writing. Everything is written and flushed in a temporary folder beside the target. A first asset is that folder,
renamed. A later one cannot be renamed over the earlier (no system replaces a full folder in one step), so image files
carry a part of their checksum in their names: the new ones are moved in beside the old ones, then asset.json is
replaced in one step, then what it no longer names is deleted. A full disk or a kill at any point leaves one whole asset.

Reading trusts nothing: every name, type, shape and size is checked against the file's real size before memory is
taken, and checksums before a value is used. Whatever is wrong is a ReflectError that names the file.
"""

import hashlib
import json
import math
import os
import shutil
from pathlib import Path

import numpy as np

from . import image_files
from .asset import Asset
from .asset_document import BAKE_AGAIN, FILE_NAME, IMAGE_NAME, MAX_SIDE, checked_entry, checked_fields, corrupt, document_of, is_int, plain
from .asset_images import ImageKind, kind_of
from .asset_places import asset_folder  # noqa: F401  where the folders lie: one interface with this module
from .errors import ReflectError
from .processes import remove_abandoned, temporary_name
from .safe_read import read_bytes

FORMAT = 1
JSON_NAME = "asset.json"
MAX_JSON_BYTES = 4 << 20  # an asset.json is a few kilobytes; more is not ours
MAX_BYTES = 4 << 30  # of all images together: past this no GPU of today draws it in real time


def save_asset(asset: Asset, folder: Path) -> Path:
    """Writes the asset to `folder` (made when missing), replacing an earlier one whole or not at all. Returns it.

    ValueError when the asset itself breaks the rules of core/asset.py (a bug in a bake); ReflectError when the disk
    refuses (no permission, full): the earlier asset is then unharmed and nothing half-written is left.
    """
    files, document = _document(asset)
    return _save(files, document, Path(folder), f"{asset.kind} of {asset.reflector or 'all reflectors'}")


def copy_asset(source: Path, folder: Path) -> Path:
    """Writes the asset in `source`, which is loaded and so checked, to `folder`, byte for byte; errors as load_asset's and save_asset's."""
    source, asset = Path(source), load_asset(source)
    document = bytes(read_bytes(source / JSON_NAME, MAX_JSON_BYTES))
    images = {entry["file"]: [(source / entry["file"]).read_bytes()] for entry in json.loads(document)["arrays"].values()}
    return _save(images, document, Path(folder), f"{asset.kind} of {asset.reflector or 'all reflectors'}")


def load_asset(folder: Path) -> Asset:
    """Reads the asset in `folder`. Sequences in settings come back as tuples. Anything wrong is a ReflectError."""
    folder = Path(folder)
    path = folder / JSON_NAME
    document = _read_document(path)
    if not (isinstance(document, dict) and document.get("what") == "reflect asset" and is_int(document.get("format"))):
        raise ReflectError(f"{path} is not a Reflect asset.", "Point at a folder that Reflect baked, or bake again.")
    if document["format"] > FORMAT:
        raise ReflectError(
            f"{path} has format {document['format']}: it was made by a newer Reflect (this one reads {FORMAT}).",
            "Update the add-on or bake again.",
        )
    if document["format"] < 1:
        raise corrupt(path, "it states no valid format")
    fields = checked_fields(path, document)
    table = document.get("arrays")
    if not isinstance(table, dict) or not all(isinstance(k, str) and IMAGE_NAME.fullmatch(k) for k in table):
        raise corrupt(path, "its table of arrays is malformed")
    entries = {name: checked_entry(path, name, entry) for name, entry in table.items()}
    total = sum(_body_bytes(kind, shape) for kind, _, shape, _ in entries.values())
    if total > MAX_BYTES:
        raise corrupt(path, f"it declares {total / 2**30:.1f} GiB of images, more than {MAX_BYTES >> 30}")
    images = {name: _read_image(folder, *entry) for name, entry in entries.items()}
    return Asset(images=images, **fields)


def is_fresh(asset: Asset, inputs_hash: str) -> bool:
    """Was the asset baked from exactly these inputs? An asset or a scene without a hash is never fresh."""
    return bool(inputs_hash) and asset.inputs_hash == inputs_hash


# --- writing


def _save(files: dict[str, list], document: bytes, folder: Path, what: str) -> Path:
    """files: name -> its pieces; document: the text of asset.json; what: the asset, for a sentence."""
    temporary = folder.parent / temporary_name()
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        remove_abandoned(folder.parent)
        temporary.mkdir()
        try:
            for name, parts in files.items():
                _write(temporary / name, parts)
            _write(temporary / JSON_NAME, [document])
            _sync_folder(temporary)
            _put_in_place(temporary, folder, files)
        finally:
            shutil.rmtree(temporary, ignore_errors=True)  # already renamed, or what a failure left
    except OSError as error:
        raise ReflectError(
            f"The asset {what} could not be written to {folder}: {error.strerror or error}.",
            "Make room there or save the .blend in a folder you may write to; an earlier asset is unharmed.",
        ) from error
    return folder


def _document(asset: Asset) -> tuple[dict[str, list], bytes]:
    """({file name: [header, array]}, the text of asset.json). ValueError for what could not be read back."""
    files, table = {}, {}
    for name, array in asset.images.items():
        kind = kind_of(name) if IMAGE_NAME.fullmatch(name) else None
        if kind is None or array.dtype != np.dtype(kind.dtype):
            raise ValueError(f"image {name!r} of asset {asset.kind} is {array.dtype}; see core/asset_images.py")
        if array.ndim != 3 or array.shape[2] != kind.items or not all(
            1 <= n <= MAX_SIDE // kind.side for n in array.shape[:2]
        ):
            raise ValueError(f"image {name!r} of asset {asset.kind} has shape {array.shape}, not (H, W, {kind.items})")
        header, body = image_files.parts_of(kind, array)
        digest = hashlib.sha256(header)
        digest.update(body)
        file = f"{name}-{digest.hexdigest()[:12]}.{kind.ending}"
        files[file] = [header, body]
        table[name] = {
            "file": file,
            "dtype": np.dtype(kind.dtype).name,
            "shape": list(array.shape),
            "unit": kind.unit,
            "sha256": digest.hexdigest(),
        }
    document = {"what": "reflect asset", "format": FORMAT, **document_of(asset), "arrays": table}
    try:
        text = json.dumps(document, indent=1, allow_nan=False, default=plain)
        checked_fields(Path(JSON_NAME), json.loads(text))
    except (ValueError, TypeError, ReflectError) as error:
        raise ValueError(f"asset {asset.kind} of {asset.reflector!r} cannot be written: {error}") from error
    return files, text.encode()


def _write(path: Path, parts: list) -> None:
    with open(path, "xb") as file:
        for part in parts:
            file.write(part)
        file.flush()
        os.fsync(file.fileno())


def _put_in_place(temporary: Path, folder: Path, files) -> None:
    """Makes the finished temporary folder the asset (see the top of this file)."""
    if not folder.exists():
        os.rename(temporary, folder)
        _sync_folder(folder.parent)
        return
    for name in files:
        os.replace(temporary / name, folder / name)
    _sync_folder(folder)
    os.replace(temporary / JSON_NAME, folder / JSON_NAME)  # from here on the folder is the new asset
    _sync_folder(folder)
    for path in folder.iterdir():
        if path.name not in files and FILE_NAME.fullmatch(path.name):
            path.unlink(missing_ok=True)


def _sync_folder(folder: Path) -> None:
    if os.name != "posix":  # Windows has no such call; its rename is journalled
        return
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


# --- reading


def _read_document(path: Path):
    data = read_bytes(path, MAX_JSON_BYTES, remedy=BAKE_AGAIN)
    try:
        return json.loads(bytes(data), parse_constant=_refuse_constant)
    except (ValueError, RecursionError) as error:
        raise corrupt(path, "it is not valid JSON") from error


def _refuse_constant(word: str):
    raise ValueError(f"{word} is no JSON number")


def _body_bytes(kind: ImageKind, shape: tuple[int, ...]) -> int:
    return math.prod(shape) * np.dtype(kind.dtype).itemsize


def _read_image(folder: Path, kind: ImageKind, file: str, shape: tuple[int, ...], sha256: str) -> np.ndarray:
    """The array, writable, little-endian. Sizes are compared before memory is taken, the checksum before use."""
    path, body = folder / file, _body_bytes(kind, shape)
    at_most, at_least = body + image_files.MOST_HEADER_BYTES, body + image_files.LEAST_HEADER_BYTES
    data = read_bytes(path, at_most, at_least, BAKE_AGAIN)
    if hashlib.sha256(data).hexdigest() != sha256:
        raise corrupt(path, "its contents do not match their checksum")
    image = image_files.image_of(kind, data, shape)
    if image is None:
        raise corrupt(path, f"it does not hold the {'x'.join(map(str, shape))} values that {JSON_NAME} declares")
    return image
