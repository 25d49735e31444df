"""Dips filled and spikes cut along a line.

As scipy's grey closing, opening and median do, which set themselves up for pictures of any number
of dimensions: for a line of a picture that takes several times as long as the line.
"""

from __future__ import annotations

import numba
import numpy as np


@numba.njit(cache=True)
def closed(values: np.ndarray, size: int) -> np.ndarray:  # pragma: no cover - compiled
    """Values (M,) with dips narrower than `size` filled; the ends go on as they are."""
    # An even window has no middle: what the first pass looks back by, the second looks ahead by.
    return -_highest(-_highest(values, size, (size - 1) // 2), size, size // 2)


@numba.njit(cache=True)
def opened(values: np.ndarray, size: int) -> np.ndarray:  # pragma: no cover - compiled
    """Values (M,) with spikes narrower than `size` cut; the ends go on as they are."""
    return _highest(-_highest(-values, size, size // 2), size, (size - 1) // 2)


@numba.njit(cache=True)
def _highest(values, size, back):  # pragma: no cover - compiled
    """Highest of every window of `size` values that begins `back` before each (M,).

    A window covers the end of one block of `size` values and the beginning of the next: the
    highest so far from either side of every block is all that is to be known."""
    count = values.size
    wide = np.empty(count + size - 1)
    for i in range(wide.size):
        wide[i] = values[min(max(i - back, 0), count - 1)]
    onward, backward = wide.copy(), wide.copy()
    for first in range(0, wide.size, size):
        last = min(first + size, wide.size) - 1
        for i in range(first + 1, last + 1):
            onward[i] = max(onward[i - 1], onward[i])
        for i in range(last - 1, first - 1, -1):
            backward[i] = max(backward[i + 1], backward[i])
    ahead = onward[size - 1 :]
    out = np.empty(count)
    for i in range(count):
        out[i] = max(backward[i], ahead[i])
    return out


@numba.njit(cache=True)
def median_of_three(values: np.ndarray) -> np.ndarray:  # pragma: no cover - compiled
    """Values (M,), each the middle one of itself and its neighbours."""
    out = values.copy()
    for i in range(1, values.size - 1):
        a, b = min(values[i - 1], values[i]), max(values[i - 1], values[i])
        out[i] = max(a, min(b, values[i + 1]))
    return out


@numba.njit(cache=True)
def median_of_five(values: np.ndarray) -> np.ndarray:  # pragma: no cover - compiled
    """Values (M,), each the middle one of itself and two neighbours to either side; the ends go on
    as they are."""
    out, last = values.copy(), values.size - 1
    for i in range(values.size):
        a, b = values[max(i - 2, 0)], values[max(i - 1, 0)]
        c, d = values[min(i + 1, last)], values[min(i + 2, last)]
        low, high = max(min(a, b), min(c, d)), min(max(a, b), max(c, d))
        low, high = min(low, high), max(low, high)
        out[i] = max(low, min(high, values[i]))
    return out
