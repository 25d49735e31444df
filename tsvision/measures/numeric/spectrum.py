"""The spectrum of a series along s between two rates, as finely as wanted."""

from __future__ import annotations

import numpy as np
from scipy.signal import czt


def spectrum(values: np.ndarray, first_px: float, rates: np.ndarray) -> np.ndarray:
    """Sum of values (M,) times exp(-i rate z), complex (K,), for z = first_px, first_px + 1, ...
    and evenly spaced rates (K,) in rad/px.

    By the chirp z-transform: M by K exponentials cost more than fitting the frame.
    """
    step = (rates[-1] - rates[0]) / max(rates.size - 1, 1)
    found = czt(values, rates.size, np.exp(-1j * step), np.exp(1j * rates[0]))
    return np.asarray(found * np.exp(-1j * rates * first_px))
