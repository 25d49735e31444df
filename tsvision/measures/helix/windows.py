"""Which stretch of a bundle a helix may be fitted to: even ones, without knots."""

from __future__ import annotations

import numba
import numpy as np

from tsvision.images.percentiles import percentile
from tsvision.measures.edges.cut import Cut
from tsvision.measures.edges.edges import Edges
from tsvision.measures.numeric.closing import closed
from tsvision.measures.numeric.line import line_through
from tsvision.measures.numeric.smoothing import bridged

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
    first, last = np.searchsorted(edges.s_px, low_px), np.searchsorted(edges.s_px, high_px, "right")
    inside = slice(first, last)
    knotted = _knotted(
        edges.s_px[inside],
        edges.upper_px[inside],
        edges.lower_px[inside],
        edges.upper_weight[inside],
        edges.lower_weight[inside],
        diameter_px,
    )
    edge = np.diff(np.concatenate([[1], knotted.astype(np.int8), [1]]))
    firsts, lasts = np.flatnonzero(edge == -1), np.flatnonzero(edge == 1) - 1
    grid = edges.s_px[inside]
    return [
        (float(grid[a]), float(grid[b]))
        for a, b in zip(firsts, lasts, strict=True)
        if grid[b] - grid[a] > 3.2 * diameter_px
    ] or [(low_px, high_px)]


@numba.njit(cache=True)
def _knotted(
    s_px, upper, lower, upper_weight, lower_weight, diameter_px
):  # pragma: no cover - compiled
    """Columns (M,) that belong to a knot, or lie beside one; all where too few edges are known."""
    known = np.minimum(upper_weight, lower_weight) > 0.1
    if np.count_nonzero(known) < 4.0 * diameter_px:
        return np.ones(s_px.size, np.bool_)
    constant, slope = line_through(s_px[known], (0.5 * (upper + lower))[known])
    line = constant + slope * s_px
    half = np.maximum(np.abs(upper - line), np.abs(lower - line))
    size = int(min(max(2.5 * diameter_px, 3.0), half.size))
    wide = max(int(0.2 * diameter_px), 1)
    reach = _running_mean(closed(bridged(half, known), size), wide)
    limit = UNEVEN * percentile(reach, 25.0)
    pad = max(int(0.4 * diameter_px), 1)
    beside = np.zeros(reach.size, np.bool_)
    for i in range(reach.size):
        if reach[i] > limit:
            beside[max(i - pad, 0) : i + pad + 1] = True
    return beside


@numba.njit(cache=True)
def _running_mean(values, size):  # pragma: no cover - compiled
    """Mean (M,) of the `size` values about each; the line goes on as its mirror image."""
    count, back = values.size, size // 2
    wide = np.empty(count + size - 1)
    for i in range(wide.size):
        at = (i - back) % (2 * count)
        wide[i] = values[min(at, 2 * count - 1 - at)]
    out, within = np.empty(count), 0.0
    for i in range(size):
        within += wide[i]
    for i in range(count):
        if i:
            within += wide[i + size - 1] - wide[i - 1]
        out[i] = within / size
    return out


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
