"""Lines of numbers smoothed by a Gaussian, and bridged where they are not known.

`smoothed` and `bridged` are to the last bit as scipy's `gaussian_filter1d` and numpy's `interp`,
which set themselves up for pictures of any number of dimensions and places in any order: a frame
asks for dozens of lines.
"""

from __future__ import annotations

from functools import lru_cache

import numba
import numpy as np
from scipy.fft import irfft, next_fast_len, rfft


def smoothed(
    values: np.ndarray, sd: float, truncate: float = 4.0, mirrored: bool = True
) -> np.ndarray:
    """Values (M,) smoothed by a Gaussian of `sd` samples, cut off at `truncate` of them. Beyond its
    ends the line goes on as its mirror image, or as its last value."""
    return np.asarray(convolved(values, taps(sd, truncate), mirrored))


@lru_cache(maxsize=64)
def taps(sd: float, truncate: float = 4.0) -> np.ndarray:
    """One half of the Gaussian (R + 1,), its middle first, to be read only."""
    at = np.arange(-int(truncate * sd + 0.5), int(truncate * sd + 0.5) + 1)
    weights = np.exp(-0.5 / (sd * sd) * at**2)
    half: np.ndarray = (weights / weights.sum())[at.size // 2 :]
    return half


@numba.njit(cache=True)
def convolved(values, half, mirrored):  # pragma: no cover - compiled
    """Values (M,) summed with `half` (R + 1,) of symmetric weights, as `smoothed` does."""
    count, reach = values.size, half.size - 1
    wide = np.empty(count + 2 * reach)
    for i in range(wide.size):
        at = i - reach
        if mirrored:
            at = at % (2 * count)
            at = min(at, 2 * count - 1 - at)
        wide[i] = values[min(max(at, 0), count - 1)]
    out = wide[reach : reach + count] * half[0]
    for far in range(reach, 0, -1):
        # As views, whose places count up from 0: several are added at a time.
        before, after = wide[reach - far :][:count], wide[reach + far :][:count]
        weight = half[far]
        for i in range(count):
            out[i] += (before[i] + after[i]) * weight
    return out


def blurred(lines: np.ndarray, sd: float, truncate: float = 4.0) -> np.ndarray:
    """Lines (K, M) smoothed by a Gaussian of many samples, which go on as their last values: by
    Fourier transform, whose cost hardly grows with `sd`."""
    count, reach = lines.shape[1], taps(sd, truncate).size - 1
    size = next_fast_len(count + 2 * reach, real=True)
    wide = np.empty((len(lines), size))
    wide[:, :reach] = lines[:, :1]
    wide[:, reach : reach + count] = lines
    wide[:, reach + count :] = lines[:, -1:]
    found = irfft(rfft(wide, axis=1) * _spectrum(sd, truncate, size), size, axis=1)
    return np.asarray(found[:, reach : reach + count])


@lru_cache(maxsize=64)
def _spectrum(sd: float, truncate: float, size: int) -> np.ndarray:
    """What a Gaussian leaves of each frequency (size // 2 + 1,), to be read only."""
    half = taps(sd, truncate)
    weights = np.zeros(size)
    weights[: half.size] = half
    weights[size - half.size + 1 :] = half[:0:-1]
    return np.asarray(rfft(weights).real)


@numba.njit(cache=True)
def bridged(values, known):  # pragma: no cover - compiled
    """Values (M,), straight lines across where they are not `known` (M,), and level before the
    first and after the last that is; NaN throughout where none is."""
    out = np.full(values.size, np.nan)
    last = -1
    for i in range(values.size):
        if not known[i]:
            continue
        out[i] = values[i]
        if last < 0:
            out[:i] = values[i]
        elif i > last + 1:
            rise = (values[i] - values[last]) / (i - last)
            for between in range(last + 1, i):
                out[between] = rise * (between - last) + values[last]
        last = i
    if last >= 0:
        out[last + 1 :] = values[last]
    return out
