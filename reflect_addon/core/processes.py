"""Temporary files and folders that say whose they are: what a killed process left is known as such and removed by the next.

A name is signed with host and process id."""

import os
import platform
import re
import secrets
import shutil
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from .errors import ReflectError

_NAME = re.compile(r"(\d{1,10}-[A-Za-z0-9]*)-[a-z0-9_]+(?:\.\w+)?")  # after the prefix; anything else is not ours
NO_ROOM = "Free some disk space, or set TMPDIR to a folder with room that you may write to."
ABANDONED_AFTER = 24 * 3600  # s: what another machine left on a shared drive cannot be asked; a day is longer than any bake


def signature() -> str:
    """'<pid>-<host>' of this process: letters, digits and one dash."""
    return f"{os.getpid()}-{_host()}"


def temporary_name(prefix: str = ".reflect-") -> str:
    """A name that no one else uses, signed by this process, for remove_abandoned()."""
    return f"{prefix}{signature()}-{secrets.token_hex(4)}"


def remove_abandoned(folder: Path, prefix: str = ".reflect-") -> None:
    """Deletes what dead processes left in the folder under a temporary_name() with this prefix. Never raises."""
    try:
        for path in Path(folder).glob(f"{prefix}*"):
            name = _NAME.fullmatch(path.name.removeprefix(prefix))
            if name is None or path.is_symlink() or not is_abandoned(name[1], path.stat().st_mtime):
                continue
            if path.is_dir():
                shutil.rmtree(path, ignore_errors=True)
            else:
                path.unlink(missing_ok=True)
    except OSError:  # not ours to delete, or gone meanwhile
        pass


@contextmanager
def temporary_folder(prefix: str, where: str | Path | None = None) -> Iterator[Path]:
    """A signed folder in `where` (the system's place when None) for the length of a block; what dead processes left there
    under the same prefix goes too. ReflectError when the disk refuses."""
    try:
        where = Path(where or tempfile.gettempdir())
        remove_abandoned(where, prefix)
        folder = tempfile.TemporaryDirectory(prefix=f"{prefix}{signature()}-", dir=where, ignore_cleanup_errors=True)
    except OSError as error:
        raise ReflectError(
            f"No temporary folder can be made in {where or 'any of the usual places'} ({error.strerror or error}).",
            NO_ROOM,
        ) from error
    with folder:
        yield Path(folder.name)


def is_alive(pid: int) -> bool:
    """Does a process with this id run on this machine? (Ids are reused: True may be a stranger, False is certain.)"""
    if pid <= 0:
        return False
    if os.name == "nt":
        return _is_alive_windows(pid)
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except PermissionError:  # someone else's process: it runs
        return True
    except OverflowError:
        return False
    return True


def is_abandoned(signed: str, modified: float) -> bool:
    """Was the thing with this signature, last changed at `modified` (s since the epoch), left by a dead process?"""
    match = re.fullmatch(r"(\d{1,10})-([A-Za-z0-9]*)", signed)
    if match and match[2] == _host():
        return not is_alive(int(match[1]))
    return time.time() - modified > ABANDONED_AFTER


def _host() -> str:
    return re.sub(r"[^A-Za-z0-9]", "", platform.node())[:32]


def _is_alive_windows(pid: int) -> bool:
    """os.kill(pid, 0) would end the process there; ask for its exit code instead."""
    import ctypes

    query_limited_information, still_active = 0x1000, 259
    kernel32 = ctypes.windll.kernel32
    handle = kernel32.OpenProcess(query_limited_information, False, pid)
    if not handle:
        return False
    code = ctypes.c_ulong()
    known = kernel32.GetExitCodeProcess(handle, ctypes.byref(code))
    kernel32.CloseHandle(handle)
    return bool(known) and code.value == still_active
