"""A straight line through points, in closed form: what a general solver takes a hundred times as
long for, and every frame asks for ten times."""

from __future__ import annotations

import numpy as np


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
