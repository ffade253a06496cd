"""An export's folder appears whole or not at all, and replaces nothing but an earlier export.

Problem. A folder cannot be renamed over a full one, and what stands there may be somebody's own.
Idea. All is written beside the target, under a name that says whose it is. An earlier export is moved aside, the new one takes its place, then the earlier
one is deleted; a failure puts it back, after a kill the next export does. It is deleted only when it holds nothing but what its own manifest and glTF name.
"""

import json
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from urllib.parse import unquote

from ..errors import ReflectError
from ..processes import remove_abandoned, temporary_name
from ..safe_read import read_bytes
from ..safe_write import ELSEWHERE, check_folder
from .checked import MAX_SCENE_BYTES
from .manifest import FILE_NAME, SCENE_NAME
from .reading import read_manifest

ANOTHER = "Choose another folder with --out."
EARLIER = "~earlier"  # after the name of an export that is being replaced: no temporary name, or what a kill left would be deleted as abandoned


@contextmanager
def whole_folder(target: Path) -> Iterator[Path]:
    """Yields an empty folder beside the target, which takes its place when the block ends and is deleted when the block raises. ReflectError: the target is
    something else than an earlier export, or the disk refuses."""
    target = Path(target).absolute()
    temporary, earlier = target.parent / temporary_name(), target.with_name(target.name + EARLIER)
    if not os.path.lexists(target) and _is_export(earlier):  # a kill came between the two renames
        os.rename(earlier, target)
    check_target(target)
    moved = replaced = False
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        remove_abandoned(target.parent)
        temporary.mkdir()
        try:
            yield temporary
            check_target(target)  # someone may have worked there meanwhile
            if os.path.lexists(target):
                if _is_export(earlier):  # a kill came before it was deleted
                    shutil.rmtree(earlier)
                os.rename(target, earlier)
                moved = True
            os.rename(temporary, target)
            replaced = True
        finally:
            shutil.rmtree(temporary, ignore_errors=True)  # already renamed, or what a failure left
            if moved and replaced:
                shutil.rmtree(earlier, ignore_errors=True)
            elif moved:
                os.rename(earlier, target)
    except OSError as error:
        raise ReflectError(f"{target} could not be written ({error.strerror or error}).", ELSEWHERE) from error


def _is_export(folder: Path) -> bool:
    """Whether a folder holds an export of ours and nothing else."""
    try:
        check_target(folder)
    except ReflectError:
        return False
    return (folder / FILE_NAME).is_file()


def check_target(target: Path) -> None:
    """Before minutes of work: may an export be written there? ReflectError where something stands that is no export, or the disk refuses."""
    target = Path(target)
    if not os.path.lexists(target):
        return check_folder(target)
    if target.is_symlink() or not target.is_dir():
        raise ReflectError(f"{target} is no folder; an export is one.", ANOTHER)
    found = {str(path.relative_to(target).as_posix()) for path in target.rglob("*") if path.is_symlink() or not path.is_dir()}
    if not found and not any(target.iterdir()):
        return check_folder(target)
    try:
        known = read_manifest(target).files() | named_by_gltf(target)
    except ReflectError as error:
        raise ReflectError(f"{target} is there already and no export of Reflect's ({error.message.rstrip('.')}).", ANOTHER) from error
    if others := sorted(found - known):
        raise ReflectError(f"{target} holds {others[0]}, which is not part of the export there; it was left as it is.", "Move it away, or choose another folder with --out.")
    return check_folder(target)


def named_by_gltf(folder: Path) -> set[str]:
    """The files that an export's glTF names, beside itself."""
    try:
        document = json.loads(bytes(read_bytes(folder / SCENE_NAME, MAX_SCENE_BYTES, remedy=ANOTHER)))
        entries = [*document.get("buffers", ()), *document.get("images", ())]
        return {unquote(entry["uri"]) for entry in entries if isinstance(entry.get("uri"), str)}
    except (ValueError, AttributeError, TypeError, RecursionError) as error:
        raise ReflectError(f"{folder / SCENE_NAME} cannot be read ({error}).", ANOTHER) from error
