"""How the contrast falls off along the axis, towards the picture's sides or away from the lamp.

One level for all columns would lose the strings where it is dark: under a shadow on a bright ground
the mask begins at two thirds of the core's contrast, and a corner may keep only half of that.
"""

from __future__ import annotations

import numba
import numpy as np

from tsvision.images.percentiles import percentile
from tsvision.measures.numeric.smoothing import smoothed

WINDOW_D = 4.0  # over which the contrast is read: longer than a coil, which leaves the axis
ON_STRINGS = 70.0  # percentile of such a window that lies on the strings
EVEN = 0.85  # of the contrast in the brighter parts: less anywhere, and light falls off
DIMMEST = 0.3  # of the contrast in the brighter parts: what is less is ground, or legs apart


def falloff_along(core: np.ndarray, width_px: float) -> np.ndarray:
    """Contrast along the axis (M,), about 1 in the brighter parts; 1 everywhere under even light.

    core (M,): contrast about the axis, NaN outside the picture. Where no strings lie on the axis
    the nearest place that has some tells.
    """
    columns = core.size
    window = WINDOW_D * width_px
    count = max(round(columns / (0.5 * window)), 1)
    places = (np.arange(count) + 0.5) * columns / count
    levels = _levels(np.nan_to_num(core).astype(float), places, window)
    told = levels > DIMMEST
    if told.sum() < 2 or levels[told].min() > EVEN:
        return np.ones(columns)
    known = np.log(np.interp(places, places[told], levels[told]))
    smooth = np.exp(smoothed(known, 0.7, mirrored=False))
    if smooth.min() > EVEN:
        return np.ones(columns)
    return np.clip(np.interp(np.arange(columns), places, smooth), DIMMEST, 1.0 / DIMMEST)


@numba.njit(cache=True)
def _levels(
    middle: np.ndarray, places: np.ndarray, window: float
) -> np.ndarray:  # pragma: no cover - compiled
    """Contrast on the strings in a window about each place, (P,)."""
    out = np.empty(places.size)
    for i in range(places.size):
        first, last = int(max(places[i] - 0.5 * window, 0.0)), int(places[i] + 0.5 * window)
        out[i] = percentile(middle[first : last + 1], ON_STRINGS)
    return out
