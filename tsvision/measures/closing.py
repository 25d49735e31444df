"""Dips filled and spikes cut along a line.

As scipy's grey closing, opening and median do, which set themselves up for pictures of any number
of dimensions: for a line of a picture that takes several times as long as the line.
"""

from __future__ import annotations

import numba
import numpy as np
from scipy.ndimage import maximum_filter1d, minimum_filter1d


def closed(values: np.ndarray, size: int) -> np.ndarray:
    """Values (M,) with dips narrower than `size` filled; the ends go on as they are."""
    shift = size % 2 - 1  # an even window has no middle
    highest = maximum_filter1d(values, size, mode="nearest", origin=shift)
    return np.asarray(minimum_filter1d(highest, size, mode="nearest"))


def opened(values: np.ndarray, size: int) -> np.ndarray:
    """Values (M,) with spikes narrower than `size` cut; the ends go on as they are."""
    shift = size % 2 - 1
    lowest = minimum_filter1d(values, size, mode="nearest")
    return np.asarray(maximum_filter1d(lowest, size, mode="nearest", origin=shift))


@numba.njit(cache=True)
def median_of_three(values: np.ndarray) -> np.ndarray:  # pragma: no cover - compiled
    """Values (M,), each the middle one of itself and its neighbours."""
    out = values.copy()
    for i in range(1, values.size - 1):
        a, b = min(values[i - 1], values[i]), max(values[i - 1], values[i])
        out[i] = max(a, min(b, values[i + 1]))
    return out
