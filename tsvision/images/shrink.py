"""Pictures made small: what is looked for in them first needs no more."""

from __future__ import annotations

import cv2
import numpy as np


def shrunk(picture: np.ndarray, factor: float) -> np.ndarray:
    """A picture (h, w) or (h, w, 3) at `factor` of its size, each pixel the mean of those that it
    covers; as it is where that is no smaller."""
    if factor >= 1.0:
        return picture
    return cv2.resize(picture, None, fx=factor, fy=factor, interpolation=cv2.INTER_AREA)
