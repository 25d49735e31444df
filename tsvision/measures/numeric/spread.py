"""A few of many, spread evenly over all of them."""

from __future__ import annotations

import numpy as np


def pick_samples(count: int, most: int) -> list[int]:
    """Indices spread evenly over a recording of `count` frames, first and last included."""
    if count <= most:
        return list(range(count))
    return sorted({round(i) for i in np.linspace(0, count - 1, most)})
