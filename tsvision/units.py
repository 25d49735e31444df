"""The only place where turns meet rad and kgf meet N (px meet mm in a `Scale`)."""

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


def rpm_to_rad_s(speed_rpm: ArrayLike) -> np.ndarray:
    """Revolutions per minute to rad/s, any shape."""
    return np.asarray(speed_rpm, dtype=float) * RAD_PER_TURN / 60.0
