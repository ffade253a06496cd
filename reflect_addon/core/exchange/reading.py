"""An export read: the manifest checked, then files, each looked at before memory is taken and before a value is used."""

import hashlib
import json
from dataclasses import dataclass
from pathlib import Path

from ..asset import Asset
from ..asset_document import checked_fields
from ..errors import ReflectError
from ..safe_read import read_bytes
from . import exr_header, ktx2_header
from .checked import EXPORT_AGAIN, MAX_BAKES_BYTES, MAX_SCENE_BYTES, bakes_of, manifest_of
from .manifest import EXTENSION, FILE_NAME, Bakes, Image, Manifest, Shader, Text

MAX_JSON_BYTES = 64 << 20


@dataclass(frozen=True)
class Export:
    """A folder whose manifest, glTF and file sizes have been checked."""

    folder: Path
    manifest: Manifest
    bakes: Bakes

    def content(self, entry: Image | Shader | Text) -> bytearray:
        """The file of an image or of a kernel's text, whose checksum holds and, of an image, whose header says what the manifest says. ReflectError else."""
        data = _content(self.folder, entry.file, entry.bytes, entry.sha256)
        if entry.file.endswith((".exr", ".ktx2")):
            _check_header(self.folder / entry.file, data, entry)
        return data

    def asset(self, key: str) -> Asset:
        """The asset of an id, without its images."""
        entry = {name: value for name, value in self.bakes.assets[key].items() if name != "images"}
        return Asset(images={}, **checked_fields(self.folder / self.manifest.bakes.file, entry))


def read_export(folder: Path) -> Export:
    """The export in a folder. ReflectError names the file and the field that are wrong; no image is read."""
    folder = Path(folder)
    manifest = read_manifest(folder)
    for entry in (manifest.scene, manifest.bakes, *manifest.images.values(), *manifest.texts()):
        _check_size(folder, entry.file, entry.bytes)
    _check_nodes(folder, manifest)
    path, entry = folder / manifest.bakes.file, manifest.bakes
    bakes = bakes_of(_json(path, _content(folder, entry.file, min(entry.bytes, MAX_BAKES_BYTES), entry.sha256)), path, manifest)
    return Export(folder, manifest, bakes)


def read_manifest(folder: Path) -> Manifest:
    """The checked manifest of a folder."""
    path = Path(folder) / FILE_NAME
    return manifest_of(_json(path, read_bytes(path, MAX_JSON_BYTES, remedy=EXPORT_AGAIN)), path)


def _json(path: Path, data: bytearray):
    try:
        return json.loads(bytes(data), parse_constant=_refuse_constant)
    except (ValueError, RecursionError) as error:
        raise ReflectError(f"{path} is damaged: it is not valid JSON.", EXPORT_AGAIN) from error


def _refuse_constant(word: str):
    raise ValueError(f"{word} is no JSON number")


def _check_size(folder: Path, file: str, size: int) -> None:
    path = folder / file
    try:
        found = path.lstat().st_size
    except OSError as error:
        raise ReflectError(f"{path} is missing.", EXPORT_AGAIN) from error
    if found != size:
        raise ReflectError(f"{path} has {found} bytes where {FILE_NAME} says {size}.", EXPORT_AGAIN)


def _content(folder: Path, file: str, size: int, sha256: str) -> bytearray:
    data = read_bytes(folder / file, size, size, EXPORT_AGAIN, inside=folder)
    if hashlib.sha256(data).hexdigest() != sha256:
        raise ReflectError(f"{folder / file} is damaged: its contents do not match their checksum.", EXPORT_AGAIN)
    return data


def _check_nodes(folder: Path, manifest: Manifest) -> None:
    """Each reflector's node points back at it."""
    path = folder / manifest.scene.file
    document = _json(path, _content(folder, manifest.scene.file, min(manifest.scene.bytes, MAX_SCENE_BYTES), manifest.scene.sha256))
    nodes = document.get("nodes") if isinstance(document, dict) else None
    for k, reflector in enumerate(manifest.reflectors):
        node = nodes[reflector.node] if isinstance(nodes, list) and reflector.node < len(nodes) else None
        extensions = node.get("extensions") if isinstance(node, dict) else None
        ours = extensions.get(EXTENSION) if isinstance(extensions, dict) else None
        if not isinstance(ours, dict) or ours.get("reflector") != k:
            raise ReflectError(f"{path} is damaged: node {reflector.node} is not that of {FILE_NAME}'s reflectors[{k}].", EXPORT_AGAIN)
    if any(not isinstance(nodes, list) or picture.node >= len(nodes) for picture in manifest.pictures):
        raise ReflectError(f"{folder / FILE_NAME} is damaged: pictures name a camera's node that is not there.", EXPORT_AGAIN)


def _check_header(path: Path, data: bytearray, image: Image) -> None:
    kind = "float" if image.kind == "buf" else "half"
    if image.file.endswith(".exr"):
        found, wanted = exr_header.header_of(data), exr_header.Header(("A", "B", "G", "R"), kind, "zip", image.width, image.height)
    else:
        found, _ = ktx2_header.header_of(data) or (None, None)
        wanted = ktx2_header.Header(kind, image.width, image.height)
    if found != wanted:
        raise ReflectError(f"{path} is damaged: its header says {found or 'nothing that is read here'}, {FILE_NAME} says {wanted}.", EXPORT_AGAIN)
