"""Several lines looked up at the same places."""

from __future__ import annotations

import numba
import numpy as np


@numba.njit(cache=True)
def interpolated(at, grid, lines):  # pragma: no cover - compiled
    """Lines (S, T) on an even grid (T,) at some places (M,), none of them NaN, (M, S): to the last
    bit as numpy's `interp`, which looks for the places anew for each line."""
    step = grid[1] - grid[0]
    last = grid.size - 1
    out = np.empty((at.size, len(lines)))
    for i in range(at.size):
        place = at[i]
        if not place > grid[0]:
            out[i] = lines[:, 0]
        elif place >= grid[last]:
            out[i] = lines[:, last]
        else:
            j = min(int((place - grid[0]) / step), last - 1)
            while grid[j] > place:
                j -= 1
            while grid[j + 1] <= place:
                j += 1
            beyond = place - grid[j]
            apart = grid[j + 1] - grid[j]
            for k in range(len(lines)):
                slope = (lines[k, j + 1] - lines[k, j]) / apart
                out[i, k] = slope * beyond + lines[k, j]
    return out
