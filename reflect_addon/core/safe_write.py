"""Files appear whole or not at all: written beside their place, then renamed."""

import os
import tempfile
from pathlib import Path

from .errors import ReflectError


def write_whole(path: Path, content: bytes) -> None:
    """Writes the file, replacing an older one; makes its folder. ReflectError (no room, no permission) leaves the old."""
    path = Path(path)
    temporary = None
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, temporary = tempfile.mkstemp(prefix=f".{path.name}.", dir=path.parent)
        with os.fdopen(handle, "wb") as file:
            file.write(content)
        os.chmod(temporary, 0o644)  # mkstemp's 0600 would hide a report from a web server
        os.replace(temporary, path)
    except OSError as error:
        raise ReflectError(
            f"{path} could not be written ({error.strerror or error}).",
            "Free some disk space, or choose a folder that you may write to with --out.",
        ) from error
    finally:
        if temporary is not None and os.path.exists(temporary):
            os.unlink(temporary)
