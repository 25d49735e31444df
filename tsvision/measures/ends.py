"""Where the strings end: the motor connector's face and the separator's plate.

Over several frames the strings' outline changes with every turn while the hardware stands still,
whatever its colour. With one frame alone, only what is much wider than the bundle
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
    connector = _connector_by_stillness(cuts, sight.width_px) if len(cuts) >= 4 else float("nan")
    if not np.isfinite(connector):
        connector = sight.connector_px - s[0]
    last = int(connector) if np.isfinite(connector) else len(s)
    apex = np.nanmin([c.silhouette.apex_column for c in cuts] + [float(last)])
    plate = _plate(cuts, sight.width_px, int(apex))
    return Ends(float(connector + s[0]), float(plate + s[0]))


def _connector_by_stillness(cuts: list[Cut], width_px: float) -> float:
    """First column from which on the outline stands still to the strip's end.

    The outline is looked at, not the brightness: polished metal glitters, a twisting bundle swings
    by a tenth of its width and more.
    """
    low = np.stack([c.silhouette.low for c in cuts])
    high = np.stack([c.silhouette.high for c in cuts])
    seen = np.isfinite(low).sum(axis=0)
    known = np.flatnonzero(seen >= 0.6 * len(cuts))
    if known.size < 4 * width_px:
        return float("nan")
    swing = np.zeros(low.shape[1])
    part = slice(known[0], known[-1] + 1)
    swing[part] = _spread(low[:, part]) + _spread(high[:, part])
    smooth = uniform_filter1d(swing, max(int(0.25 * width_px), 1))
    limit = 0.4 * float(np.median(smooth[known[: known.size // 2]]))
    still = smooth < limit
    run, face = 0, float("nan")
    for c in range(int(known[-1]), int(known[0] + 2 * width_px), -1):
        if still[c]:
            run, face = 0, float(c)
        else:
            run += 1
            if run > 0.5 * width_px:
                break
    # A short stretch may stand still by chance at the very end of a bundle that leaves the view.
    if not known[-1] - face > 0.8 * width_px:
        return float("nan")
    # Of all frames the narrow ones: coils and knots hide the step to a slim spigot.
    narrow = np.nanpercentile(high[:, part] - low[:, part], 30.0, axis=0)
    return _step_of_width(narrow, int(known[0]), face, width_px)


def _step_of_width(width: np.ndarray, offset: int, face: float, typical: float) -> float:
    """The face refined: the strands' last stretch is held by the connector and swings little, so
    stillness begins before it; the outline's step in width is the face itself."""
    first = max(int(face - 0.5 * typical) - offset, 0)
    part = width[first : int(face + 3.0 * typical) - offset]
    lag = 3
    if part.size < 2 * lag:
        return face
    step = part[lag:] - part[:-lag]
    steep = np.flatnonzero(step > 0.22 * typical)
    if steep.size == 0:
        return face
    # The first step is the spigot's, the next the connector's body.
    near = step[steep[0] : steep[0] + 2 * lag]
    return float(first + offset + steep[0] + int(np.argmax(near)) + 0.5 * lag)


def _spread(edge: np.ndarray) -> np.ndarray:
    """Median absolute deviation over the frames, (M,)."""
    middle = np.nanmedian(edge, axis=0)
    return 1.4826 * np.nanmedian(np.abs(edge - middle), axis=0)


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
