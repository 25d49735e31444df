"""Sums of many numbers in compiled code, to the last bit as numpy adds them.

By halves, and eight side by side: what is rounded away stays small, and where a search goes on from
such a sum it ends where it did, whichever of the two has added.
"""

from __future__ import annotations

import numba
import numpy as np

_BLOCK = 128  # numbers that are no longer halved


@numba.njit(cache=True)
def summed(values):  # pragma: no cover - compiled
    """Sum of values (M,)."""
    count = values.size
    if count <= _BLOCK:
        return _of_block(values)
    half = count // 2
    half -= half % 8
    return summed(values[:half]) + summed(values[half:])


@numba.njit(cache=True)
def _of_block(values):  # pragma: no cover - compiled
    count = values.size
    if count < 8:
        few = 0.0
        for value in values:
            few += value
        return few
    eight = values[:8].copy()
    whole = count - count % 8
    for first in range(8, whole, 8):
        for i in range(8):
            eight[i] += values[first + i]
    found = (eight[0] + eight[1]) + (eight[2] + eight[3])
    found += (eight[4] + eight[5]) + (eight[6] + eight[7])
    for i in range(whole, count):
        found += values[i]
    return found


@numba.njit(cache=True)
def deviation(values):  # pragma: no cover - compiled
    """Standard deviation of values (M,)."""
    off = values - summed(values) / values.size
    return np.sqrt(summed(off * off) / values.size)
