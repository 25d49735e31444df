"""Millimetres along the axis: by L between the two ends where both are seen, else by the scale.

The scale holds where it was given for, across the bundle and in one place. Along the axis a tilted
one is foreshortened, and the camera's distance changes it by per cents from end to end, which is
more than a diameter at the far end. Both ends seen, the zone is as long as the rig says.
"""

from __future__ import annotations

import numpy as np

from tsvision.measures.ends import NEAR_SHARE
from tsvision.measures.looks import Looks


def mm_along(looks: Looks, s_px: np.ndarray | float) -> np.ndarray:
    """mm from the separator's exit face of places s_px on the axis; NaN without a scale."""
    away: np.ndarray = np.asarray(s_px, dtype=float) - looks.zero_px
    return away * scale_along(looks)


def scale_along(looks: Looks) -> float:
    """mm per px of the axis, its mean over the zone."""
    seen_px = looks.ends.connector_px - looks.zero_px
    both = looks.zero_known and looks.ends.connector_seen
    if both and abs(seen_px - looks.zone_px) < NEAR_SHARE * looks.zone_px:
        return looks.scale.mm_per_px * looks.zone_px / seen_px
    return looks.scale.mm_per_px
