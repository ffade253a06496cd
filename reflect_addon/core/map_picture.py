"""Reflector maps as a picture to look at: the normals of the first parts' maps in the usual colours, dark where a map was closed."""

import numpy as np

from .asset import Asset

# Of what is closed: how much of its colour is shown.
CLOSED = 0.25
# Texels of a picture's side, at most.
WIDEST = 256


def map_picture(asset: Asset) -> np.ndarray:
    """(H, W, 4) float32 in 0..1, row 0 at the bottom, WIDEST a side at most, of an asset with reflector maps."""
    normal, position = (asset.images[f"reflector_{name}_buf"] for name in ("normal", "position"))
    step = max(-(-max(normal.shape[:2]) // WIDEST), 1)
    normal, position = normal[::step, ::step], position[::step, ::step]
    picture = np.ones((*normal.shape[:2], 4), np.float32)
    picture[..., :3] = np.clip(normal[..., :3] * 0.5 + 0.5, 0, 1) * (CLOSED + (1 - CLOSED) * np.clip(position[..., 3:], 0, 1))
    return picture
