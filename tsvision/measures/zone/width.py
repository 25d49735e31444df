"""A bundle's width where no helix fits."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import gaussian_filter1d

from tsvision.measures.edges.edges import Edges
from tsvision.measures.helix.bundle import swing_px
from tsvision.measures.helix.untwisted import is_tapered
from tsvision.measures.helix.windows import even_stretches

NAN = float("nan")
WIDTH_SD, COILED_WIDTH_SD = 0.04, 0.08  # of the width: how far it may be from D
COILED = 0.1  # of D: swing of the middle line
LEGS_D = 0.6  # widths beside the apex in which the legs still lie apart


def width_between_knots(edges: Edges, diameter_px: float) -> float:
    """What a caliper reads that is held square to the bundle between its knots, coiling or not: the
    silhouette's largest width across its own middle line; NaN where too little is seen, or legs."""
    known = edges.both_seen
    if known.sum() < 10:
        return NAN
    s, upper, lower = edges.s_px, edges.upper_px, edges.lower_px
    middle = np.interp(s, s[known], 0.5 * (upper + lower)[known])
    slope = np.gradient(gaussian_filter1d(middle, 0.4 * diameter_px), s)
    first = float(s[known][0]) + (LEGS_D * diameter_px if np.ptp(s[known]) > diameter_px else 0)
    even = np.zeros_like(known)
    for low, high in even_stretches(edges, first, float(s[known][-1]), diameter_px):
        even |= (s >= low) & (s <= high)
    kept = known & even
    if kept.sum() < 10 or is_tapered(edges.within(kept)):
        return NAN
    return float(np.percentile(((upper - lower) / np.hypot(1.0, slope))[kept], 95))


def width_sd_px(edges: Edges, width_px: float, diameter_px: float) -> float:
    """How far a width may be from D, `diameter_px` being what was learnt on other frames: knots
    side by side leave nothing between them to measure."""
    if not width_px > 0.0:
        return NAN
    share = WIDTH_SD if swing_px(edges) < COILED * diameter_px else COILED_WIDTH_SD
    return max(share * width_px, 0.5 * abs(width_px - diameter_px))
