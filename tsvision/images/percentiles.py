"""Medians and percentiles of many numbers, by counting.

numpy's partition divides the numbers until the one sought stands in its place, and every second
comparison of a processor that guesses ahead is guessed wrongly. How many numbers begin with which
bits is counted without a comparison: a fifth of the time, and a frame asks for thirty of them.
"""

from __future__ import annotations

import numba
import numpy as np

# Bits that are counted at a time: as many counts as fit into the fastest memory, and fewer where
# they take longer to look through than the numbers.
_DIGITS, _FEW_DIGITS, _FEW = 11, 8, 1000
_SIGN = np.uint64(1 << 63)
_SHORT = 32  # bits of a short number


@numba.njit(cache=True)
def _keys(values):  # pragma: no cover - compiled
    """Whole numbers (M,) in the same order as numbers of any shape: their bits, which rise with
    them but for those of negative ones. Those of short numbers are followed by as many of no
    meaning."""
    keys = np.empty(values.size, np.uint64)
    if values.itemsize == 4:
        short = values.astype(np.float32).ravel().view(np.uint32)
        for i in range(keys.size):
            keys[i] = np.uint64(short[i]) << np.uint64(_SHORT)
    else:
        keys[:] = values.astype(np.float64).ravel().view(np.uint64)
    for i in range(keys.size):
        keys[i] = ~keys[i] if keys[i] & _SIGN else keys[i] | _SIGN
    return keys


@numba.njit(cache=True)
def _number(key, is_short):  # pragma: no cover - compiled
    """The number that a key stands for."""
    bits = np.full(1, key ^ _SIGN if key & _SIGN else ~key)
    if is_short:
        return np.float64((bits >> np.uint64(_SHORT)).astype(np.uint32).view(np.float32)[0])
    return bits.view(np.float64)[0]


@numba.njit(cache=True)
def _at(keys, place, is_short):  # pragma: no cover - compiled
    """The key at a place, from 0 on, in rising order."""
    at_a_time = _DIGITS if keys.size > _FEW else _FEW_DIGITS
    digits = np.uint64((1 << at_a_time) - 1)
    # Bits that all keys begin with tell nothing; nor do those that follow short ones.
    apart, left, last = keys.min() ^ keys.max(), 0, _SHORT if is_short else 0
    while left < 64 and apart >> np.uint64(left):
        left += 1
    counts, some = np.empty(1 << at_a_time, np.int64), keys
    while left > last and some.size > 1:
        left = max(left - at_a_time, 0)
        shift = np.uint64(left)
        counts[:] = 0
        for key in some:
            counts[(key >> shift) & digits] += 1
        digit = 0
        while place >= counts[digit]:
            place -= counts[digit]
            digit += 1
        found = np.empty(counts[digit] + 1, np.uint64)
        kept = 0
        for key in some:  # written where the next one is written over, unless it is kept
            found[kept] = key
            kept += (key >> shift) & digits == np.uint64(digit)
        some = found[:kept]
    return some[0]


@numba.njit(cache=True)
def _neighbours(values, place):  # pragma: no cover - compiled
    """The number at a place, from 0 on, in rising order, and the next one."""
    keys, is_short = _keys(values), values.itemsize == 4
    key = _at(keys, place, is_short)
    none = ~np.uint64(0)
    above, others = none, 0
    for other in keys:
        others += other <= key
        above = min(above, other if other > key else none)
    # The next one: another as large, or the least of what is larger.
    low = _number(key, is_short)
    return low, low if others > place + 1 or above == none else _number(above, is_short)


@numba.njit(cache=True)
def percentile(values, percent):  # pragma: no cover - compiled
    """What `percent` of numbers of any shape, none of them NaN, lie below, between two of them in
    proportion, as precise as they are; NaN of none."""
    if values.size == 0:
        return np.nan
    exact = percent / 100.0 * (values.size - 1)
    place = int(exact)
    low, high = _neighbours(values, place)
    part = exact - place
    between = low + (high - low) * part if part < 0.5 else high - (high - low) * (1.0 - part)
    return float(values.dtype.type(between))


@numba.njit(cache=True)
def median(values):  # pragma: no cover - compiled
    """The middle one of numbers of any shape, none of them NaN, or the mean of the middle two; NaN
    of none."""
    if values.size == 0:
        return np.nan
    low, high = _neighbours(values, (values.size - 1) // 2)
    return low if values.size % 2 else float(values.dtype.type(0.5 * (low + high)))


@numba.njit(cache=True)
def row_medians(values):  # pragma: no cover - compiled
    """`median` of every row (R,) of (R, M)."""
    out = np.empty(values.shape[0])
    for r in range(values.shape[0]):
        out[r] = median(values[r])
    return out
