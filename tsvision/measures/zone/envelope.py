"""E(s): the outer diameter about the zone's straight axis, coiling included.

One view shows the envelope only where a lobe happens to point sideways; between lobes the edges
dip. Closing the larger of the two half widths over one lobe period fills the dips without widening
what stands out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np
from scipy.fft import next_fast_len, rfft, rfftfreq

from tsvision.images.percentiles import median, percentile
from tsvision.measures.numeric.closing import closed, median_of_five, median_of_three, opened
from tsvision.measures.numeric.smoothing import bridged, smoothed

SLOWEST, FASTEST = 5.0, 0.8  # periods of a coil, in D
FIBRE_D = 0.5  # what stands out over a shorter stretch than this, …
BESIDE_D = 0.8  # … its neighbours so far away looked at together, …
STANDS_OUT_D = 0.08  # … by more than this, …
TOO_WIDE = 1.1  # … and where the strings look wider than this, is a fibre or a speck; all in D


@dataclass(frozen=True)
class Envelope:
    """E(s): `px` (M,), NaN where nothing is seen, its dips closed over `closed_over_px`."""

    px: np.ndarray
    closed_over_px: float


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
    return np.asarray(_reach(upper_px, lower_px, known, float(diameter_px)))


@numba.njit(cache=True)
def _reach(upper_px, lower_px, known, diameter_px):  # pragma: no cover - compiled
    out = np.full(upper_px.size, np.nan)
    index = np.flatnonzero(known)
    if index.size < 3:
        return out
    inside = slice(index[0], index[-1] + 1)
    upper, lower = upper_px[inside], lower_px[inside]
    half = np.maximum(np.abs(upper), np.abs(lower))
    if np.isnan(diameter_px):
        out[inside] = median_of_three(bridged(half, known[inside]))
        return out
    both = (upper != 0.0) & (lower != 0.0)
    for i in range(half.size):
        if both[i]:
            half[i] = max(half[i], 0.5 * diameter_px + abs(0.5 * (upper[i] + lower[i])))
    filled = median_of_three(bridged(half, known[inside]))
    out[inside] = _without_fibres(filled, upper - lower, both, diameter_px)
    return out


def closed_over(reach: np.ndarray, period_px: float) -> np.ndarray:
    """E(s) (M,): twice the reach, dips shorter than a period filled."""
    return np.asarray(_closed_over(reach, float(period_px)))


@numba.njit(cache=True)
def _closed_over(reach, period_px):  # pragma: no cover - compiled
    index = np.flatnonzero(np.isfinite(reach))
    out = np.full(reach.size, np.nan)
    if index.size:
        inside = slice(index[0], index[-1] + 1)
        size = min(max(round(period_px), 3), index[-1] + 1 - index[0])
        out[inside] = 2.0 * closed(reach[inside], size)
    return out


@numba.njit(cache=True)
def _without_fibres(half_px, width_px, seen, diameter_px):  # pragma: no cover - compiled
    """Half widths (M,) cut back where something narrower than any limb stands out on one side.

    A limb of a coil that reaches out takes the other edge along: the strings stay as wide as they
    are. A fibre widens them, and for a short stretch only. A knot widens them over at least D.
    width_px (M,): from edge to edge, where both are `seen` (M,).
    """
    if not seen.any():
        return half_px
    width = median_of_three(bridged(width_px, seen))
    plain, least = _held(half_px, diameter_px), STANDS_OUT_D * diameter_px
    wider = (width > _held(width, diameter_px) + least) & (width > TOO_WIDE * diameter_px)
    fibre = (half_px > plain + least) & (wider | ~seen)
    return np.where(fibre, plain, half_px)


@numba.njit(cache=True)
def _held(values, diameter_px):  # pragma: no cover - compiled
    """Values (M,) without what stands out over a fibre's width only."""
    return opened(closed(values, _odd(BESIDE_D * diameter_px)), _odd(FIBRE_D * diameter_px))


@numba.njit(cache=True)
def _odd(size_px):  # pragma: no cover - compiled
    return 2 * max(round(0.5 * size_px), 1) + 1


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
    seen = (upper_px != 0.0) & (lower_px != 0.0)
    both = np.flatnonzero(seen)
    if both.size < 3 * diameter_px:
        return float("nan"), float("nan")
    inside = slice(both[0], both[-1] + 1)
    middle = bridged(0.5 * (upper_px + lower_px)[inside], seen[inside])
    middle = smoothed(median_of_five(middle), 0.08 * diameter_px)
    swing = middle - smoothed(middle, 0.4 * SLOWEST * diameter_px, mirrored=False)
    amplitude = float(np.sqrt(2.0) * median(np.abs(swing)))
    if amplitude < 0.03 * diameter_px:
        return amplitude, float("nan")
    size = next_fast_len(4 * swing.size, real=True)
    power = np.abs(rfft(swing * np.hanning(swing.size), size)) ** 2
    rate = rfftfreq(size)
    power[(rate * diameter_px < 1.0 / SLOWEST) | (rate * diameter_px > 1.0 / FASTEST)] = 0.0
    return amplitude, float(1.0 / rate[int(np.argmax(power))]) if power.any() else float("nan")


def baseline_px(envelope: np.ndarray) -> float:
    """E0: the 25th percentile of E(s) over the twisted part."""
    return percentile(envelope[np.isfinite(envelope)], 25.0)


def unevenness_of(envelope: np.ndarray) -> float:
    """Coefficient of variation of E(s)."""
    known = envelope[np.isfinite(envelope)]
    return float(np.std(known) / np.mean(known)) if known.size > 2 else float("nan")
