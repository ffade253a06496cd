"""Parts of a bake that outlast an interruption: what was cancelled, killed or out of power goes on where it was.

A folder beside the asset that is being baked, with one .npy per finished part; each appears whole or not at all. It is
known by a key, a hash of all that the parts depend on: parts of another key are deleted, not used. A bake that ends well
deletes the folder.
"""

import shutil
from pathlib import Path

import numpy as np

from .safe_write import whole_file

KEY_NAME = "key.txt"
PREFIX = ".unfinished-"
MAKE_ROOM = "Make room there: what is finished already is kept, and the next bake goes on from it."


class Unfinished:
    """The parts of one bake. folder None: nothing is kept."""

    def __init__(self, folder: Path | None = None, key: str = ""):
        self._folder = folder if folder is None else Path(folder)
        self._key = key

    def load(self, name: str) -> np.ndarray | None:
        """The finished part of this name; None where there is none, it is damaged or belongs to another bake."""
        if self._folder is None or not self._is_ours():
            return None
        try:
            return np.load(self._folder / f"{name}.npy", allow_pickle=False)
        except (OSError, ValueError, EOFError):
            return None

    def save(self, name: str, part: np.ndarray) -> None:
        """Keeps a finished part. ReflectError when the disk refuses."""
        if self._folder is None:
            return
        if not self._is_ours():
            self.clear()
            with whole_file(self._folder / KEY_NAME, MAKE_ROOM) as path:
                path.write_text(self._key)
        with whole_file(self._folder / f"{name}.npy", MAKE_ROOM) as path:
            np.save(path, part)

    def clear(self) -> None:
        """The bake is done, or what lies there is of another one."""
        if self._folder is not None:
            shutil.rmtree(self._folder, ignore_errors=True)

    def _is_ours(self) -> bool:
        try:
            return (self._folder / KEY_NAME).read_text() == self._key
        except (OSError, UnicodeDecodeError):
            return False
