"""Which stretch of a bundle a helix may be fitted to: even ones, without knots."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import uniform_filter1d

from tsvision.images.percentiles import percentile
from tsvision.measures.closing import closed
from tsvision.measures.cut import Cut
from tsvision.measures.helix import Edges
from tsvision.measures.line import line_through

LEARNT_FROM = 4  # stretches of a straight bundle, one behind the other
UNEVEN = 1.18  # of the baseline's half width: from here on a column belongs to a knot


def even_stretches(
    edges: Edges, low_px: float, high_px: float, diameter_px: float
) -> list[tuple[float, float]]:
    """Stretches of s in low..high whose outer reach stays near the baseline, in order.

    The reach is the larger half width about the straight line through the middles, closed over 2.5
    widths so that lobes of strands and coils do not count; knots stand out and are cut away with
    0.4 widths on either side. The whole range comes back when nothing stands out.
    """
    inside = (edges.s_px >= low_px) & (edges.s_px <= high_px)
    known = inside & (edges.upper_weight > 0.1) & (edges.lower_weight > 0.1)
    if known.sum() < 4.0 * diameter_px:
        return [(low_px, high_px)]
    s = edges.s_px[known]
    centre = 0.5 * (edges.upper_px + edges.lower_px)[known]
    constant, slope = line_through(s, centre)
    line = constant + slope * s
    half = np.maximum(np.abs(edges.upper_px[known] - line), np.abs(edges.lower_px[known] - line))
    grid = edges.s_px[inside]
    filled = np.interp(grid, s, half)
    size = int(min(max(2.5 * diameter_px, 3), filled.size))
    reach = uniform_filter1d(closed(filled, size), max(int(0.2 * diameter_px), 1))
    base = percentile(reach, 25.0)
    pad = max(int(0.4 * diameter_px), 1)
    knotted = np.convolve(reach > UNEVEN * base, np.ones(2 * pad + 1), mode="same") > 0
    edge = np.diff(np.concatenate([[1], knotted.astype(np.int8), [1]]))
    firsts, lasts = np.flatnonzero(edge == -1), np.flatnonzero(edge == 1) - 1
    return [
        (float(grid[a]), float(grid[b]))
        for a, b in zip(firsts, lasts, strict=True)
        if grid[b] - grid[a] > 3.2 * diameter_px
    ] or [(low_px, high_px)]


def learning_windows(cut: Cut, diameter_px: float) -> list[tuple[float, float]]:
    """`near_window`, and others as long behind it: light falls the same way all along."""
    first = near_window(cut, diameter_px)
    if first is None:
        return []
    length = first[1] - first[0]
    last = _last_px(cut, diameter_px)
    behind = [first[0] + i * length for i in range(1, LEARNT_FROM)]
    return [first, *((low, low + length) for low in behind if low + length <= last)]


def near_window(
    cut: Cut, diameter_px: float, skip: float = 1.2, length: float = 7.0
) -> tuple[float, float] | None:
    """s_low, s_high of a first fit beside the apex, in widths; None if the bundle is too short."""
    columns = np.flatnonzero(cut.silhouette.bundle)
    if columns.size < 2.5 * diameter_px:
        return None
    low = float(cut.s_px[columns[0]]) + skip * diameter_px
    high = min(low + length * diameter_px, _last_px(cut, diameter_px))
    return (low, high) if high - low > 1.5 * diameter_px else None


def _last_px(cut: Cut, diameter_px: float) -> float:
    """s up to where a bundle that is in view may be fitted."""
    return float(cut.s_px[np.flatnonzero(cut.silhouette.bundle)[-1]]) - 0.3 * diameter_px
