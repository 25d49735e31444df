"""Where the strings end: the motor connector's face and the separator's plate.

Over several frames the strings' shading and outline change with every turn while the hardware
stands still, whatever its colour. With one frame alone, only what is much wider than the bundle
counts as hardware.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import uniform_filter1d

from tsvision.images.sight import Sight
from tsvision.measures.cut import Cut


@dataclass(frozen=True)
class Ends:
    """s in px of the connector's face and of the separator plate's visible edge; NaN: not seen."""

    connector_px: float
    plate_px: float


def find_ends(cuts: list[Cut], sight: Sight) -> Ends:
    """Both ends from the cuts of the sampled frames (same strip)."""
    s = cuts[0].s_px
    connector = _connector_by_activity(cuts, sight.width_px) if len(cuts) >= 3 else float("nan")
    if not np.isfinite(connector):
        connector = sight.connector_px - s[0]
    last = int(connector) if np.isfinite(connector) else len(s)
    apex = np.nanmin([c.silhouette.apex_column for c in cuts] + [float(last)])
    plate = _plate(cuts, sight.width_px, int(apex))
    return Ends(float(connector + s[0]), float(plate + s[0]))


def activity(cuts: list[Cut], width_px: float) -> np.ndarray:
    """How much each column changes from frame to frame within the bundle's width, (M,)."""
    half = cuts[0].half_px
    reach = max(int(0.6 * width_px), 2)
    rows = slice(half - reach, half + reach + 1)
    stack = np.stack([c.contrast[rows] for c in cuts])
    spread = np.median(np.abs(stack - np.median(stack, axis=0)), axis=0)
    return uniform_filter1d(spread.mean(axis=0), max(int(0.15 * width_px), 1))


def _connector_by_activity(cuts: list[Cut], width_px: float) -> float:
    moving = activity(cuts, width_px)
    columns = np.flatnonzero(np.mean([c.silhouette.bundle for c in cuts], axis=0) > 0.3)
    if columns.size < 4 * width_px:
        return float("nan")
    middle = moving[columns[0] + int(width_px) : (columns[0] + columns[-1]) // 2]
    if middle.size == 0:
        return float("nan")
    threshold = 0.33 * float(np.median(middle))
    noise = float(np.mean([c.noise for c in cuts]))
    if threshold < 0.7 * noise:
        return float("nan")
    still = moving < threshold
    hold = max(int(0.5 * width_px), 4)
    run = 0
    for c in range(int(columns[0] + 2 * width_px), moving.size):
        run = run + 1 if still[c] else 0
        if run >= hold:
            rest = still[c:]
            if rest.mean() > 0.8:
                return float(c - run + 1)
    return float("nan")


def _plate(cuts: list[Cut], width_px: float, apex: int) -> float:
    """Last strong step of the ground beside the axis before the first apex."""
    half = cuts[0].half_px
    n = np.abs(np.arange(-half, half + 1))
    if apex < 0.4 * width_px:
        return float("nan")
    still = np.median(np.stack([c.contrast[n > 1.1 * width_px] for c in cuts]), axis=0)
    level = uniform_filter1d(np.median(still, axis=0)[: apex + 1], 3)
    if level.size < 8:
        return float("nan")
    lag = max(int(0.1 * width_px), 2)
    step = np.abs(level[lag:] - level[:-lag])
    noise = 1.4826 * float(np.median(np.abs(step - np.median(step)))) + 1e-4
    strong = step > max(0.15, 8.0 * noise)
    if not strong.any():
        return float("nan")
    last = int(np.flatnonzero(strong)[-1])
    first = last
    while first > 0 and strong[first - 1]:
        first -= 1
    return float(first + int(step[first : last + 1].argmax()) + 0.5 * lag)
