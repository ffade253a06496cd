"""One bake at a time per folder of assets. The system's own file lock, which ends with the process that holds it."""

import functools
import os
from pathlib import Path

from .errors import ReflectError
from .processes import signature

LOCK_NAME = ".baking"
_LOCKED_BYTE = 1 << 30  # Windows locks bytes, and nobody else can read a locked one: lock one that no text reaches


class BakeLock:
    """`with BakeLock(folder): ...` around a bake that writes below `folder` (made when missing).

    A second one on the same folder, in this or another process, raises ReflectError at once. What a killed bake left is
    taken over without asking, because its lock died with it. The file holds '<pid>-<host>' for the sentence only.
    """

    def __init__(self, folder: Path):
        self.path = Path(folder) / LOCK_NAME
        self._handle = None
        self._made: list[Path] = []  # folders that were not there before, innermost first

    def __enter__(self) -> "BakeLock":
        try:
            self._made = [p for p in (self.path.parent, *self.path.parent.parents) if not p.exists()]
            self.path.parent.mkdir(parents=True, exist_ok=True)
            while self._handle is None:
                self._handle = self._try()
        except OSError as error:
            raise ReflectError(
                f"Nothing can be baked into {self.path.parent}: {error.strerror or error}.",
                "Save the .blend in a folder you may write to, or make room there.",
            ) from error
        return self

    def __exit__(self, *_exception) -> None:
        handle, self._handle = self._handle, None
        if os.name == "nt":  # an open file cannot be deleted there
            os.close(handle)
            try:
                self.path.unlink(missing_ok=True)
            except PermissionError:  # the next bake has it open already
                pass
        else:
            self.path.unlink(missing_ok=True)
            os.close(handle)
        for folder in self._made:  # a bake that made nothing leaves nothing
            try:
                folder.rmdir()
            except OSError:  # it holds assets by now
                break

    def _try(self) -> int | None:
        """The locked file; None when its name was deleted meanwhile (the earlier holder's last act), to try again."""
        handle = os.open(self.path, os.O_RDWR | os.O_CREAT, 0o666)
        try:
            if not _lock(handle):
                holder = os.read(handle, 100).decode(errors="replace") or "another one"
                raise ReflectError(
                    f"{self.path.parent} is being baked already (process {holder}).",
                    "Wait until that bake is done, or cancel it.",
                )
            if not _same(self.path, handle):
                os.close(handle)
                return None
            os.ftruncate(handle, 0)
            os.write(handle, signature().encode())
        except BaseException:
            os.close(handle)
            raise
        return handle


def one_bake_at_a_time(bake):
    """Decorates a function (scene, methods, folder, ...) that bakes into a folder: it runs under the folder's lock."""

    @functools.wraps(bake)
    def locked(scene, wanted, folder, *arguments, **keywords):
        with BakeLock(folder):
            return bake(scene, wanted, folder, *arguments, **keywords)

    return locked


def _same(path: Path, handle: int) -> bool:
    try:
        return os.path.samestat(os.stat(path), os.fstat(handle))
    except FileNotFoundError:
        return False


def _lock(handle: int) -> bool:
    """Locks the open file until it is closed; False when someone else holds it."""
    try:
        if os.name == "nt":
            import msvcrt

            os.lseek(handle, _LOCKED_BYTE, os.SEEK_SET)
            msvcrt.locking(handle, msvcrt.LK_NBLCK, 1)
            os.lseek(handle, 0, os.SEEK_SET)
        else:
            import fcntl

            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        if os.name == "nt":
            os.lseek(handle, 0, os.SEEK_SET)
        return False
    return True
