"""A straight line through points, in closed form: what a general solver takes a hundred times as
long for, and every frame asks for ten times; and the slope of a line that is none."""

from __future__ import annotations

import numba
import numpy as np

from tsvision.measures.numeric.smoothing import bridged, convolved, taps
from tsvision.measures.numeric.sums import summed


@numba.njit(cache=True)
def line_through(x, y, weight=None):  # pragma: no cover - compiled
    """(constant, slope) of the least-squares line through y (M,) at x (M,); `weight` (M,) counts
    squared residuals. The weighted mean and no slope where all x are one."""
    w = np.ones(x.size) if weight is None else weight
    whole = max(summed(w), 1e-300)
    x_mean, y_mean = (w @ x) / whole, (w @ y) / whole
    away = w * (x - x_mean)
    spread = away @ (x - x_mean)
    slope = (away @ (y - y_mean)) / spread if spread > 0.0 else 0.0
    return y_mean - slope * x_mean, slope


def slope_of(edge: np.ndarray, known: np.ndarray, sd_px: float) -> np.ndarray:
    """d edge / d s of a noisy edge (M,), one value a px, smoothed by a Gaussian of sd_px and across
    where it is not known; 0 throughout where too little is."""
    return np.asarray(_slope(edge, known, taps(sd_px)))


@numba.njit(cache=True)
def _slope(edge, known, half):  # pragma: no cover - compiled
    if np.count_nonzero(known) < 4:
        return np.zeros(edge.size)
    line = convolved(bridged(edge, known), half, True)
    out, last = np.empty(line.size), line.size - 1
    for i in range(1, last):
        out[i] = (line[i + 1] - line[i - 1]) / 2.0
    out[0], out[last] = line[1] - line[0], line[last] - line[last - 1]
    return out
