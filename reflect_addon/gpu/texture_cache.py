"""Textures of assets' images, each uploaded once."""

import numpy as np

from .counts import Counts
from .upload import texture_bytes, texture_from


class TextureCache:
    """Textures by the array they were made from, so that reflectors share what their assets share."""

    def __init__(self, counts: Counts):
        self.counts = counts
        self._kept: dict[int, tuple[np.ndarray, object]] = {}  # id -> (array, kept so that its id stays taken; texture)

    def texture(self, name: str, array: np.ndarray):
        if id(array) not in self._kept:
            self._kept[id(array)] = (array, texture_from(name, array, self.counts))
        return self._kept[id(array)][1]

    def replace(self, array: np.ndarray, texture):
        """From now on this texture is drawn where `array` is asked for: what the array shows has moved."""
        self._kept[id(array)] = (array, texture)

    def bytes(self) -> int:
        return sum(texture_bytes(texture) for _, texture in self._kept.values())

    def keep_only(self, assets):
        """Let go of textures that none of these assets has."""
        used = {id(array) for asset in assets for array in asset.images.values()}
        self._kept = {key: value for key, value in self._kept.items() if key in used}
