"""What shows again at the same place in the next frame: a knot does, a chance sighting does not.

Turning the bundle by a fraction of a turn changes every lobe that one view shows, so that chance
sightings fall anywhere along it: over 266 false sightings in rendered recordings one in ten was
followed by another one within reach, no more than their number lets expect, at any frame step; of
635 true ones all but nine were.
"""

from __future__ import annotations

import numpy as np
import pandas as pd

from tsvision.timeline.order import numbers

SEEN_AGAIN = 0.98  # chance that a knot shows in the next frame as well
LEAST_BY_CHANCE = 0.05  # a stain or a wrong edge may stay: no repeat says more than this allows
USUAL_EXTENT_D = 40.0  # the bundle's length where it is not known


def repeat_odds(sightings: int, gate_d: float, extent_d: float) -> float:
    """Log-odds for a knot that a sighting gains by another one in the frame before or after.

    sightings: how many that frame holds; gate_d: how near it must lie, in D; extent_d: the length
    along which chance would strew them, in D.
    """
    by_chance = sightings * 2.0 * gate_d / max(extent_d, 1.0)
    return float(np.log(SEEN_AGAIN / np.clip(by_chance, LEAST_BY_CHANCE, SEEN_AGAIN)))


def extent_in_diameters(frames: pd.DataFrame) -> float:
    """Length of the zone's axis in the picture over D, medians of all frames."""
    names = [f"axis_{name}_px" for name in ("x0", "y0", "x1", "y1")]
    x0, y0, x1, y1 = (numbers(frames, name) for name in names)
    lengths = np.hypot(x1 - x0, y1 - y0) / numbers(frames, "diameter_px")
    lengths = lengths[np.isfinite(lengths)]
    return float(np.median(lengths)) if len(lengths) else USUAL_EXTENT_D
