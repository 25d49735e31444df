"""Linear light as a camera stores it."""

from __future__ import annotations

import numpy as np


def encode(linear: np.ndarray) -> np.ndarray:
    """Linear light 0..1 to 8-bit sRGB."""
    x = np.clip(linear, 0, 1)
    code = np.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** (1 / 2.4) - 0.055)
    return np.rint(255 * code).astype(np.uint8)
