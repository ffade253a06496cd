"""Files that may come from anywhere: read whole, when they are regular files inside their folder and of a size that was foretold."""

import os
import stat
from pathlib import Path

from .errors import ReflectError


def read_bytes(path: Path, at_most: int, at_least: int = 0, remedy: str = "", inside: Path | None = None) -> bytearray:
    """The whole regular file, when its size is within the bounds and neither it nor a folder on the way from `inside` (its own folder
    where None) leaves that folder by a link. ReflectError, which names the file, else."""
    try:
        resolved, root = path.resolve(strict=True), inside or path.parent
        if resolved.parent != (root.resolve() / path.relative_to(root)).parent:
            raise ReflectError(f"{path} is a link that leaves its folder; it was not read.", remedy)
        if not stat.S_ISREG(resolved.stat().st_mode):
            raise ReflectError(f"{path} is not a file.", remedy)
        with open(resolved, "rb") as file:
            size = os.fstat(file.fileno()).st_size
            if size < at_least:
                raise ReflectError(f"{path} is cut short: {size} bytes of at least {at_least}.", remedy)
            if size > at_most:
                raise ReflectError(f"{path} is too large: {size} bytes where {at_most} are expected.", remedy)
            data = bytearray(size)
            if file.readinto(data) != size:
                raise ReflectError(f"{path} is cut short while it is read.", remedy)
    except FileNotFoundError as error:
        raise ReflectError(f"{path} is missing.", remedy) from error
    except (OSError, RuntimeError) as error:  # RuntimeError: a loop of links
        raise ReflectError(f"{path} cannot be read: {getattr(error, 'strerror', None) or error}.", remedy) from error
    return data
