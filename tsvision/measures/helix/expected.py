"""What is expected to lie along a bundle, before it is followed there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Expected:
    """Turns and length of bundle (px) that lie on a px of axis, turning and length (M,), at s_px
    (M,), 1 px apart."""

    s_px: np.ndarray
    turning: np.ndarray
    length: np.ndarray


def turns_before(at_px: np.ndarray, turning: np.ndarray, s_px: np.ndarray) -> np.ndarray:
    """Turns (K,) that lie before each s (K,), by what lies on each px (M,), in its middle told."""
    ends = np.append(at_px - 0.5, at_px[-1] + 0.5)
    return np.asarray(np.interp(s_px, ends, np.append(0.0, np.cumsum(turning))))
