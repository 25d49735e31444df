"""A straight line through points, in closed form: what a general solver takes a hundred times as
long for, and every frame asks for ten times; and the slope of a line that is none."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import gaussian_filter1d


def line_through(
    x: np.ndarray, y: np.ndarray, weight: np.ndarray | None = None
) -> tuple[float, float]:
    """(constant, slope) of the least-squares line through y (M,) at x (M,); `weight` (M,) counts
    squared residuals. The weighted mean and no slope where all x are one."""
    w = np.ones(x.size) if weight is None else weight
    total = max(float(w.sum()), 1e-300)
    x_mean, y_mean = float(w @ x) / total, float(w @ y) / total
    away = w * (x - x_mean)
    spread = float(away @ (x - x_mean))
    slope = float(away @ (y - y_mean)) / spread if spread > 0.0 else 0.0
    return y_mean - slope * x_mean, slope


def slope_of(edge: np.ndarray, known: np.ndarray, sd_px: float) -> np.ndarray:
    """d edge / d s of a noisy edge (M,), one value a px, smoothed by a Gaussian of sd_px and across
    where it is not known; 0 throughout where too little is."""
    if np.count_nonzero(known) < 4:
        return np.zeros(edge.size)
    s = np.arange(edge.size)
    filled = np.interp(s, s[known], edge[known])
    return np.gradient(gaussian_filter1d(filled, sd_px))
