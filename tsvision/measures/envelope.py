"""E(s): the outer diameter about the zone's straight axis, coiling included.

One view shows the envelope only where a lobe happens to point sideways; between lobes the edges
dip. Closing the larger of the two half widths over one lobe period fills the dips without widening
what stands out.
"""

from __future__ import annotations

import numpy as np
from scipy.ndimage import gaussian_filter1d, median_filter

from tsvision.images.percentiles import median, percentile
from tsvision.measures.closing import closed, median_of_three, opened

SLOWEST, FASTEST = 5.0, 0.8  # periods of a coil, in D
FIBRE_D = 0.5  # what stands out over a shorter stretch than this, …
BESIDE_D = 0.8  # … its neighbours so far away looked at together, …
STANDS_OUT_D = 0.15  # … by more than this, …
TOO_WIDE = 1.1  # … and where the strings look wider than this, is a fibre or a speck; all in D


def envelope_px(
    upper_px: np.ndarray,
    lower_px: np.ndarray,
    known: np.ndarray,
    period_px: float,
    diameter_px: float = float("nan"),
) -> np.ndarray:
    """E(s) (M,) in px: `reach_px` with its dips closed over a period; NaN outside the columns."""
    return closed_over(reach_px(upper_px, lower_px, known, diameter_px), period_px)


def reach_px(
    upper_px: np.ndarray, lower_px: np.ndarray, known: np.ndarray, diameter_px: float
) -> np.ndarray:
    """How far (M,) the strings are seen to reach from the axis, px, fibres cut off; NaN before the
    first and after the last of the known columns.

    With D given, the middle of the two edges is taken as the coil's own swing: E >= D + 2 |swing|.
    The edges alone beat: a lobe of a strand has to meet a lobe of the coil to reach out to E, and
    where they meet only now and then, a uniform coil looks uneven and full of knots. An edge that
    is exactly 0 counts as not seen.
    """
    out = np.full(upper_px.shape, np.nan)
    index = np.flatnonzero(known)
    if index.size < 3:
        return out
    s = np.arange(upper_px.size)
    half = np.maximum(np.abs(upper_px), np.abs(lower_px))
    if np.isfinite(diameter_px):
        both = (upper_px != 0.0) & (lower_px != 0.0)
        reach = 0.5 * diameter_px + np.abs(0.5 * (upper_px + lower_px))
        half = np.where(both, np.maximum(half, reach), half)
    filled = np.interp(s, index, half[index])[index[0] : index[-1] + 1]
    filled = median_of_three(filled)
    if np.isfinite(diameter_px):
        width = np.where(both, upper_px - lower_px, np.nan)[index[0] : index[-1] + 1]
        filled = _without_fibres(filled, width, diameter_px)
    out[index[0] : index[-1] + 1] = filled
    return out


def closed_over(reach: np.ndarray, period_px: float) -> np.ndarray:
    """E(s) (M,): twice the reach, dips shorter than a period filled."""
    index = np.flatnonzero(np.isfinite(reach))
    out = np.full(reach.shape, np.nan)
    if index.size:
        filled = reach[index[0] : index[-1] + 1]
        size = int(np.clip(round(period_px), 3, filled.size))
        out[index[0] : index[-1] + 1] = 2.0 * closed(filled, size)
    return out


def _without_fibres(half_px: np.ndarray, width_px: np.ndarray, diameter_px: float) -> np.ndarray:
    """Half widths (M,) cut back where something narrower than any limb stands out on one side.

    A limb of a coil that reaches out takes the other edge along: the strings stay as wide as they
    are. A fibre widens them, and for a short stretch only. A knot widens them over at least D.
    width_px (M,): from edge to edge, NaN where not both are seen.
    """
    if not np.isfinite(width_px).any():
        return half_px

    def odd(size: float) -> int:
        return 2 * max(round(0.5 * size * diameter_px), 1) + 1

    def held(values: np.ndarray) -> np.ndarray:
        return opened(closed(values, odd(BESIDE_D)), odd(FIBRE_D))

    index, seen = np.arange(width_px.size), np.isfinite(width_px)
    width = median_of_three(np.interp(index, index[seen], width_px[seen]))
    plain, least = held(half_px), STANDS_OUT_D * diameter_px
    wider = (width > held(width) + least) & (width > TOO_WIDE * diameter_px)
    fibre = (half_px > plain + least) & (wider | ~seen)
    return np.where(fibre, plain, half_px)


def middle_swing(
    upper_px: np.ndarray, lower_px: np.ndarray, diameter_px: float
) -> tuple[float, float]:
    """(amplitude, period) in px of the coil, read from the middle of the two edges alone.

    A two-fold section (any even N) is symmetric about its own centre line, so the middle swings
    with the coil and with nothing else, whether a helix could be fitted or not. Bows slower than
    `SLOWEST` D are taken out; the median makes it indifferent to fibres and knots. The period is
    NaN where nothing swings; both are where too little is seen. An edge that is exactly 0 counts as
    not seen.
    """
    both = np.flatnonzero((upper_px != 0.0) & (lower_px != 0.0))
    if both.size < 3 * diameter_px:
        return float("nan"), float("nan")
    columns = np.arange(both[0], both[-1] + 1)
    middle = np.interp(columns, both, 0.5 * (upper_px + lower_px)[both])
    middle = gaussian_filter1d(median_filter(middle, size=5, mode="nearest"), 0.08 * diameter_px)
    swing = middle - gaussian_filter1d(middle, 0.4 * SLOWEST * diameter_px, mode="nearest")
    amplitude = float(np.sqrt(2.0) * median(np.abs(swing)))
    if amplitude < 0.03 * diameter_px:
        return amplitude, float("nan")
    power = np.abs(np.fft.rfft(swing * np.hanning(swing.size), 4 * swing.size)) ** 2
    rate = np.fft.rfftfreq(4 * swing.size)
    power[(rate * diameter_px < 1.0 / SLOWEST) | (rate * diameter_px > 1.0 / FASTEST)] = 0.0
    return amplitude, float(1.0 / rate[int(np.argmax(power))]) if power.any() else float("nan")


def baseline_px(envelope: np.ndarray) -> float:
    """E0: the 25th percentile of E(s) over the twisted part."""
    return percentile(envelope[np.isfinite(envelope)], 25.0)


def unevenness_of(envelope: np.ndarray) -> float:
    """Coefficient of variation of E(s)."""
    known = envelope[np.isfinite(envelope)]
    return float(np.std(known) / np.mean(known)) if known.size > 2 else float("nan")
