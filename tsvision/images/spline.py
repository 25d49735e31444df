"""Splines that follow a cord's bow and not its strands."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import LSQUnivariateSpline

from tsvision.images.strip import Axis

KNOT_WIDTHS = 4.0  # the axis' knots lie so many widths apart


def arc_of(points: np.ndarray) -> np.ndarray:
    return np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])


def smooth(s: np.ndarray, y: np.ndarray, weight: np.ndarray, spacing: float) -> LSQUnivariateSpline:
    """Cubic spline through y(s) with knots at least `spacing` apart, outliers weighted down."""
    pieces = max(int((s[-1] - s[0]) / spacing), 1)
    knots = np.linspace(s[0], s[-1], pieces + 1)[1:-1]
    held = np.diff(np.searchsorted(s, np.concatenate([[s[0]], knots, [s[-1] + 1.0]]))) > 5
    knots = knots[held[:-1] & held[1:]]  # a gap without points cannot hold a piece of its own
    w = weight.copy()
    spline = LSQUnivariateSpline(s, y, knots, w=w, k=3)
    for _ in range(6):
        r = y - spline(s)
        scale = 2.0 * 1.4826 * float(np.median(np.abs(r))) + 1e-3
        w = weight / (1.0 + (r / scale) ** 2) + 1e-6
        spline = LSQUnivariateSpline(s, y, knots, w=w, k=3)
    return spline


def spline_axis(points: np.ndarray, width: float) -> Axis:
    """Axis in arc length through noisy points (K, 2), left to right or top to bottom."""
    arc = arc_of(points)
    grid = np.linspace(0.0, arc[-1], max(int(arc[-1] / 2.0), 8))
    one = np.ones(arc.size)
    spacing = KNOT_WIDTHS * width
    even = np.stack([smooth(arc, points[:, i], one, spacing)(grid) for i in (0, 1)], axis=1)
    across = even[-1] - even[0]
    if across[0] < 0 if abs(across[0]) > 0.5 * np.linalg.norm(across) else across[1] < 0:
        even = even[::-1]
    return Axis(np.ascontiguousarray(even), arc_of(even))
