"""Statistics of texels that stand for different solid angles."""

import numpy as np


def weighted_median(values: np.ndarray, weight: np.ndarray) -> float:
    """The smallest of `values` (M,) at which half of the weight (M,) is reached; M > 0."""
    order = np.argsort(values)
    cumulative = np.cumsum(weight[order])
    return float(values[order][np.searchsorted(cumulative, cumulative[-1] / 2)])
