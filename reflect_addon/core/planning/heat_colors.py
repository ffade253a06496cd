"""Colours of errors: viridis, which is perceptually ordered and tells as much to colour-blind eyes [van der Walt and Smith 2015], on a logarithmic scale."""

import numpy as np

from .errors import WRONG

LEAST, MOST = 0.1, WRONG["degrees"]  # degrees at the scale's ends; less is as good, more there is not
TICKS = (0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 90.0)  # degrees
# Ten equal steps of matplotlib's viridis, sRGB.
_CODES = "440154 482878 3e4a89 31688e 26828e 1f9e89 35b779 6dcd59 b4de2c fde725"
STEPS = np.array([[int(code[i : i + 2], 16) / 255 for i in (0, 2, 4)] for code in _CODES.split()])


def place_of(degrees) -> np.ndarray:
    """Where on the scale, 0..1."""
    return np.log(np.clip(degrees, LEAST, MOST) / LEAST) / np.log(MOST / LEAST)


def color_at(place) -> np.ndarray:
    """(..., 3) sRGB 0..1, of places on the scale."""
    at = np.asarray(place) * (len(STEPS) - 1)
    return np.stack([np.interp(at, np.arange(len(STEPS)), STEPS[:, c]) for c in range(3)], -1)
