"""The only place where px meet mm, turns meet rad, kgf meet N."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

STANDARD_GRAVITY_M_S2 = 9.80665
RAD_PER_TURN = 2.0 * np.pi


def turns_to_rad(turns: ArrayLike) -> np.ndarray:
    """Motor turns to rad, any shape."""
    return np.asarray(turns, dtype=float) * RAD_PER_TURN


def rad_to_turns(angle_rad: ArrayLike) -> np.ndarray:
    """Rad to motor turns, any shape."""
    return np.asarray(angle_rad, dtype=float) / RAD_PER_TURN


def kgf_to_newton(load_kgf: ArrayLike) -> np.ndarray:
    """Kilogram-force (the paper's loads) to N, any shape."""
    return np.asarray(load_kgf, dtype=float) * STANDARD_GRAVITY_M_S2


def newton_to_kgf(load_N: ArrayLike) -> np.ndarray:
    """N to kilogram-force, any shape."""
    return np.asarray(load_N, dtype=float) / STANDARD_GRAVITY_M_S2


def px_to_mm(length_px: ArrayLike, mm_per_px: float) -> np.ndarray:
    """Pixels to mm; NaN where the scale is unknown (a millimetre is never invented)."""
    return np.asarray(length_px, dtype=float) * mm_per_px


def mm_to_px(length_mm: ArrayLike, mm_per_px: float) -> np.ndarray:
    """Millimetres to pixels; NaN where the scale is unknown."""
    return np.asarray(length_mm, dtype=float) / mm_per_px


def rpm_to_rad_s(speed_rpm: ArrayLike) -> np.ndarray:
    """Revolutions per minute to rad/s, any shape."""
    return np.asarray(speed_rpm, dtype=float) * RAD_PER_TURN / 60.0
