"""Files appear whole or not at all: written beside their place, then renamed."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from .errors import ReflectError
from .processes import remove_abandoned, temporary_name

ELSEWHERE = "Free some disk space, or choose a folder that you may write to with --out."


def write_whole(path: Path, content: bytes) -> None:
    """Writes the file, replacing an older one; makes its folder. ReflectError (no room, no permission) leaves the old."""
    with whole_file(path) as temporary:
        temporary.write_bytes(content)


@contextmanager
def whole_file(path: Path, remedy: str = ELSEWHERE) -> Iterator[Path]:
    """Yields another name in the file's folder (made when missing), with the same ending, to write to. It becomes the file
    when the block ends, and is deleted when the block raises. OSError (no room, no permission) becomes a ReflectError."""
    path = Path(path)
    temporary = path.with_name(temporary_name() + path.suffix)
    made = _missing(path.parent)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        remove_abandoned(path.parent)
        try:
            yield temporary
            os.replace(temporary, path)
        except BaseException:
            temporary.unlink(missing_ok=True)
            _remove_empty(made)
            raise
    except OSError as error:
        raise ReflectError(f"{path} could not be written ({error.strerror or error}).", remedy) from error


def check_writable(path: Path) -> None:
    """Before minutes of work: can the file be written there at all? ReflectError names it; nothing stays behind."""
    path = Path(path)
    if os.path.isdir(path):
        raise ReflectError(f"{path} is a folder; a file is to be written there.", "Choose another name with --out.")
    _probe(path.parent, path)


def check_folder(folder: Path) -> None:
    """The same for a folder that results go to."""
    _probe(Path(folder), folder)


def _probe(folder: Path, named: Path) -> None:
    made = _missing(folder)
    probe = folder / temporary_name()
    try:
        folder.mkdir(parents=True, exist_ok=True)
        probe.write_bytes(b"?")  # a full disk still takes empty files
    except OSError as error:
        raise ReflectError(f"{named} could not be written ({error.strerror or error}).", ELSEWHERE) from error
    finally:
        try:
            probe.unlink(missing_ok=True)
        except OSError:  # it was never made
            pass
        _remove_empty(made)


def _missing(folder: Path) -> list[Path]:
    """The folder and those above it that do not exist, innermost first."""
    return [p for p in (folder, *folder.parents) if not os.path.lexists(p)]


def _remove_empty(folders: list[Path]) -> None:
    for folder in folders:
        try:
            folder.rmdir()
        except OSError:  # never made, or something is in it by now
            break
