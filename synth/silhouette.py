"""The exact outline of the strands: where the view ray touches the tubes' surface.

Independent of the rasteriser: the fold curves of every tube (surface points whose normal is
square to the ray) are projected, distortion included, and their extremes across the axis taken
column by column.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from synth.camera import View, project, to_camera
from synth.tubes import Tube

FINE_PX = 0.25  # stretches of an outline longer than this are interpolated


def fold_curves(view: View, tube: Tube) -> tuple[np.ndarray, np.ndarray]:
    """The two projected outlines (M, 2) px of one tube."""
    seen = to_camera(view, tube.points_mm)
    tangent = np.gradient(seen, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    outward = tube.outward_mm @ view.rotation.T
    radial = outward - (outward * tangent).sum(axis=1, keepdims=True) * tangent
    size = np.linalg.norm(radial, axis=1, keepdims=True)
    spare = np.cross(tangent, np.array([0.123, 0.456, 0.881]))
    spare /= np.linalg.norm(spare, axis=1, keepdims=True)
    radial = np.where(size > 1e-9, radial / np.maximum(size, 1e-9), spare)
    side = np.cross(tangent, radial)
    b2, c2 = tube.half_out_mm**2, tube.half_side_mm**2
    curves = []
    for sign in (1.0, -1.0):
        point = seen
        for _ in range(1 if view.distance_mm <= 0 else 4):
            ray = _ray(view, point)
            normal = np.cross(tangent, ray)
            normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
            nr = (normal * radial).sum(axis=1, keepdims=True)
            ns = (normal * side).sum(axis=1, keepdims=True)
            support = b2 * nr * radial + c2 * ns * side
            support /= np.sqrt(b2 * nr**2 + c2 * ns**2)
            point = seen + sign * support
        curves.append(project(view, point))
    return curves[0], curves[1]


def _ray(view: View, point: np.ndarray) -> np.ndarray:
    if view.distance_mm <= 0:
        return np.broadcast_to(np.array([0.0, 0.0, 1.0]), point.shape)
    return np.array([0.0, 0.0, view.distance_mm]) - point


def edges_along(
    origin_px: np.ndarray, along: np.ndarray, length_px: int, curves: list[np.ndarray]
) -> tuple[np.ndarray, np.ndarray]:
    """Smallest and largest n = (-u_y, u_x) . offset at s = 0, 1, ... px; NaN where no strand."""
    low = np.full(length_px, np.inf)
    high = np.full(length_px, -np.inf)
    across = np.array([-along[1], along[0]])
    for curve in curves:
        offset = curve - origin_px
        _extremes(offset @ along, offset @ across, low, high)
    none = ~np.isfinite(low)
    low[none] = np.nan
    high[none] = np.nan
    return low, high


@njit(cache=True, error_model="numpy")
def _extremes(s, n, low, high):
    """Largest and smallest n at whole s; long stretches are rounded out (Catmull-Rom)."""
    last = len(s) - 1
    for i in range(last):
        length = np.hypot(s[i + 1] - s[i], n[i + 1] - n[i])
        parts = min(int(length / FINE_PX) + 1, 64)
        before, after = max(i - 1, 0), min(i + 2, last)
        a, value_a = s[i], n[i]
        for part in range(1, parts + 1):
            t = part / parts
            b = _between(s[before], s[i], s[i + 1], s[after], t)
            value_b = _between(n[before], n[i], n[i + 1], n[after], t)
            _mark(a, value_a, b, value_b, low, high)
            a, value_a = b, value_b


@njit(cache=True, inline="always")
def _between(p0, p1, p2, p3, t):
    return p1 + 0.5 * t * (
        p2 - p0 + t * (2.0 * p0 - 5.0 * p1 + 4.0 * p2 - p3 + t * (3.0 * (p1 - p2) + p3 - p0))
    )


@njit(cache=True, inline="always", error_model="numpy")
def _mark(a, value_a, b, value_b, low, high):
    if a == b:
        return
    first = max(int(np.ceil(min(a, b))), 0)
    final = min(int(np.floor(max(a, b))), len(low) - 1)
    for k in range(first, final + 1):
        value = value_a + (value_b - value_a) * (k - a) / (b - a)
        if value < low[k]:
            low[k] = value
        if value > high[k]:
            high[k] = value
