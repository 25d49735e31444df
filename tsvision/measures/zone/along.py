"""Millimetres along the axis: by L between the two ends where both are seen, else by the scale.

The scale holds where it was given for, across the bundle and in one place. Along the axis a tilted
one is foreshortened, and the camera's distance changes it by per cents from end to end, which is
more than a diameter at the far end. Both ends seen, the zone is as long as the rig says.
"""

from __future__ import annotations

import numpy as np

from tsvision.measures.ends.ends import NEAR_SHARE
from tsvision.measures.looks import Looks

LOCAL = 0.005  # of the scale: smaller differences along the axis do not matter


def mm_along(looks: Looks, s_px: np.ndarray | float) -> np.ndarray:
    """mm from the separator's exit face of places s_px on the axis; NaN without a scale."""
    away: np.ndarray = np.asarray(s_px, dtype=float) - looks.zero_px
    return away * mm_per_px_along(looks)


def scale_is_local(looks: Looks) -> bool:
    """Whether the scale along the axis differs from the one given by more than that is unsure of:
    tilt or perspective."""
    off = abs(mm_per_px_along(looks) / looks.scale.mm_per_px - 1.0)
    return bool(off > max(LOCAL, 2.0 * looks.scale.mm_per_px_sd / looks.scale.mm_per_px))


def along_sd_share(looks: Looks) -> float:
    """Standard uncertainty of the scale along the axis, as a share of it."""
    scale = looks.scale
    # Somewhere between the scale given and the mean along the axis: a rectangular distribution.
    local = (mm_per_px_along(looks) / scale.mm_per_px - 1.0) / np.sqrt(3.0)
    return float(np.hypot(scale.mm_per_px_sd / scale.mm_per_px, local))


def mm_per_px_along(looks: Looks) -> float:
    """mm per px of the axis, its mean over the zone."""
    seen_px = looks.ends.connector_px - looks.zero_px
    both = looks.zero_known and looks.ends.connector_seen
    if both and abs(seen_px - looks.zone_px) < NEAR_SHARE * looks.zone_px:
        return looks.scale.mm_per_px * looks.zone_px / seen_px
    return looks.scale.mm_per_px
