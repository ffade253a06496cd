"""The scene's view transform as numbers: exposure, then a table from scene-linear to the display.

The table's axes are logarithmic in radiance after exposure, so 64 steps cover 15 stops; between its entries values
are interpolated linearly. `apply` is the reference of glsl/look_lut_lib.glsl.
"""

from dataclasses import dataclass

import numpy as np

TABLE_SIDE = 64
# Axis: u = log2(x / LINEAR + 1) / log2(TOP / LINEAR + 1). TOP: the views clip at 16.3 (AgX, Filmic); views made for
# more keep three more stops. LINEAR: below it steps are even, as display curves are near black.
TOP = 128.0
LINEAR = 2.0**-7


@dataclass(frozen=True, eq=False)
class Look:
    """table: (TABLE_SIDE,)*3 + (3,) float32, [blue, green, red], display-encoded (sRGB curve) in [0, 1]; None: the
    Standard view without look, gamma or curves, which only clips."""

    exposure: float = 0.0  # stops
    table: np.ndarray | None = None
    signature: tuple = ()  # what the table was made from: equal signatures, equal looks

    def gain(self) -> float:
        return float(2.0**self.exposure)

    def apply(self, scene_linear: np.ndarray) -> np.ndarray:
        """(..., 3) scene-linear to display-encoded float32 in [0, 1]."""
        exposed = np.maximum(np.asarray(scene_linear, np.float32) * self.gain(), 0)
        if self.table is None:
            return encode_srgb(np.clip(exposed, 0, 1))
        at = np.clip(axis_from_linear(exposed), 0, 1) * (TABLE_SIDE - 1)
        low = np.minimum(at.astype(int), TABLE_SIDE - 2)
        share = at - low
        out = np.zeros(exposed.shape, np.float32)
        for corner in range(8):
            step = np.array([corner & 1, corner >> 1 & 1, corner >> 2 & 1])
            weight = np.where(step, share, 1 - share).prod(-1, keepdims=True)
            r, g, b = np.moveaxis(low + step, -1, 0)
            out += weight * self.table[b, g, r]
        return out


def axis_from_linear(value: np.ndarray) -> np.ndarray:
    return np.log2(value / LINEAR + 1) / np.log2(TOP / LINEAR + 1)


def linear_from_axis(u: np.ndarray) -> np.ndarray:
    return (np.exp2(u * np.log2(TOP / LINEAR + 1)) - 1) * LINEAR


def table_inputs() -> np.ndarray:
    """(side, side, side, 3) float32 [blue, green, red]: scene-linear colours (exposed) of the table's entries."""
    axis = linear_from_axis(np.linspace(0, 1, TABLE_SIDE))
    blue, green, red = np.meshgrid(axis, axis, axis, indexing="ij")
    return np.stack([red, green, blue], -1).astype(np.float32)


def encode_srgb(linear: np.ndarray) -> np.ndarray:
    """IEC 61966-2-1, [0, 1] to [0, 1]."""
    return np.where(linear <= 0.0031308, linear * 12.92, 1.055 * np.maximum(linear, 0.0031308) ** (1 / 2.4) - 0.055)
