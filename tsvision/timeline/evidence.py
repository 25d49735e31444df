"""How strongly each frame speaks for or against a phase, as a log-likelihood ratio.

A frame that was not measured says nothing (0). No single frame may say more than `MOST`: a flash,
a passing cable or a slip of the edge finder can make any one frame wrong.
"""

from __future__ import annotations

import numpy as np
import pandas as pd
from scipy.stats import norm

from tsvision.timeline.criteria import RATES, Criteria
from tsvision.timeline.lengths import over
from tsvision.timeline.order import numbers

MOST = 4.0
DEAD_FLAGS = ("UNREADABLE", "WRONG_SIZE", "BLANK", "NO_BUNDLE")
READINGS = ("diameter_mm", "diameter_px", "max_envelope_mm", "max_envelope_px", "unevenness")
ENVELOPE_NOISE = 0.04  # relative error of the largest E read from one view
UNEVEN_NOISE = 0.02  # of the unevenness: which lobes one view shows changes over several frames
DIAMETER_NOISE = 0.04  # relative error of a knot's largest diameter in one view
STRAIGHT = 0.5  # a knot in a bundle that coils nowhere else (A below this share of the criterion,
STRAIGHT_BASELINE = 1.08  # or E₀ hardly above D) …
STRAIGHT_COST = 1.5  # … is doubtful by this log-odds: knots grow out of coiling, as a rule
SURELY_STRAIGHT = -2.0  # log-odds for coiling below which only a loop can stand out, …
LOOP = 1.8  # … where the bundle lies beside itself: about so many D wide. What else is seen
NO_LOOP = -1.0  # there speaks against a knot by so much at least
CONFIDENCE_IF_UNKNOWN = 0.95
NO_FIT = "ENVELOPE_ONLY"  # the strands could not be fitted: D and A are not to be relied upon
CLIPPED = "CLIPPED"  # what stands out may lie beyond the picture
SWING_SHOWN = 0.5  # part of the coil's swing that the middle of the edges shows at least
HIDDEN_MISS = 0.7  # chance of seeing no knot where there is one, in such a frame
UNSIZED = -1.0  # evidence of a knot of unknown size for being larger than the hole


def measured(frames: pd.DataFrame) -> np.ndarray:
    """(n,) True where the picture could be measured at all and its knots were counted. A count
    of none in a frame in which no bundle was read (neither D nor E) is no count."""
    good = np.isfinite(numbers(frames, "knot_count"))
    there = [name for name in READINGS if name in frames]
    if there:
        good &= np.any([np.isfinite(numbers(frames, name)) for name in there], axis=0)
    return np.asarray(good & ~flagged(frames, *DEAD_FLAGS))


def flagged(frames: pd.DataFrame, *names: str) -> np.ndarray:
    """(n,) True where a frame carries any of the flags."""
    if "flags" not in frames:
        return np.zeros(len(frames), dtype=bool)
    # pandas' text methods took half of the time that a live frame is believed in.
    flags = frames["flags"].to_numpy(dtype=object)
    told = [flag if isinstance(flag, str) else "" for flag in flags]
    return np.array([any(name in text for name in names) for text in told], dtype=bool)


def threshold_evidence(values: np.ndarray, threshold: float, floor: float) -> np.ndarray:
    """(n,) evidence that a noisy series lies above `threshold`; its noise is read from itself.

    The noise is the larger of `floor` and the robust spread of the series about its own
    neighbours, taken locally, since it grows with coiling.
    """
    noise = np.maximum(local_noise(values), floor)
    above = norm.cdf((values - threshold) / noise)
    slack = np.exp(-MOST)
    ratio = np.log((above + slack) / (1.0 - above + slack))
    return np.where(np.isfinite(values), ratio, 0.0)


def local_noise(values: np.ndarray, window: int = 15) -> np.ndarray:
    """(n,) standard deviation of single values from second differences, robust and local."""
    good = np.flatnonzero(np.isfinite(values))
    noise = np.zeros(len(values))
    if len(good) < 5:
        return noise
    bend = np.abs(np.diff(values[good], n=2)) / np.sqrt(6.0)
    padded = np.concatenate([bend[:1], bend, bend[-1:]])
    spread = 1.4826 * pd.Series(padded).rolling(window, center=True, min_periods=3).median()
    noise[good] = spread.to_numpy()
    return noise


def ratio_of(frames: pd.DataFrame, name: str) -> np.ndarray:
    """(n,) a length over the frame's own D, in mm, or in px where no scale is known."""
    return over(frames, name, frames, "diameter")


def coil_evidence(frames: pd.DataFrame, criteria: Criteria) -> np.ndarray:
    """(n,) for A ≥ coil_ratio · D; D is steady beside the separator, so its median is used.

    Where no helix could be fitted, the middle of the edges shows between half of the swing and all
    of it; a swing of 0 is none read there."""
    ratio = steady_ratio(frames, "coil_amplitude")
    unfitted = flagged(frames, NO_FIT)
    fitted = threshold_evidence(np.where(unfitted, np.nan, ratio), criteria.coil_ratio, floor=0.004)
    if not unfitted.any():
        return fitted
    least = np.where(unfitted & (ratio != 0.0), ratio, np.nan)
    low = threshold_evidence(least, criteria.coil_ratio, floor=0.008)
    high = threshold_evidence(least / SWING_SHOWN, criteria.coil_ratio, floor=0.008)
    return fitted + np.where(low > 0.0, low, np.minimum(high, 0.0))


def ready_to_knot(frames: pd.DataFrame) -> np.ndarray:
    """(n,) True where the bundle coils so widely that knots may snap out."""
    with np.errstate(invalid="ignore"):
        wide: np.ndarray = steady_ratio(frames, "coil_amplitude") >= RATES.ready_coil_ratio
    return wide


def steady_ratio(frames: pd.DataFrame, name: str, window: int = 9) -> np.ndarray:
    """(n,) as `ratio_of`, with D taken as a running median over the frames around."""
    plain = ratio_of(frames, name)
    for unit in ("mm", "px"):
        length, diameter = numbers(frames, f"{name}_{unit}"), numbers(frames, f"diameter_{unit}")
        if np.isfinite(length).any() and np.isfinite(diameter).any():
            middle = pd.Series(diameter).rolling(window, center=True, min_periods=1).median()
            return length / middle.to_numpy()
    return plain


def uneven_evidence(frames: pd.DataFrame, criteria: Criteria) -> np.ndarray:
    """(n,) for unevenness ≥ its threshold."""
    return threshold_evidence(
        numbers(frames, "unevenness"), criteria.unevenness, floor=UNEVEN_NOISE
    )


def knot_evidence(frames: pd.DataFrame, certainty: np.ndarray, criteria: Criteria) -> np.ndarray:
    """(n,) for at least one knot. `certainty` (n,): that what was seen is a knot; NaN: nothing
    was seen. Seeing nothing is evidence against, the weaker the nearer the largest envelope
    comes to the criterion."""
    seen = np.isfinite(certainty)
    chance = np.clip(np.where(seen, certainty, 0.5), 0.02, 0.98)
    speaks_for = np.log(chance / (1.0 - chance))
    miss = np.clip(norm.cdf(_margin(frames, criteria) / ENVELOPE_NOISE), 0.03, 0.3)
    miss = np.where(flagged(frames, NO_FIT, CLIPPED), HIDDEN_MISS, miss)
    straight = ratio_of(frames, "coil_amplitude") < STRAIGHT * criteria.coil_ratio
    straight |= ratio_of(frames, "baseline_envelope") < STRAIGHT_BASELINE
    straight &= ~flagged(frames, NO_FIT)
    speaks_for = speaks_for - STRAIGHT_COST * straight
    loop = ~(ratio_of(frames, "max_envelope") < LOOP)
    uncoiled = (coil_evidence(frames, criteria) < SURELY_STRAIGHT) & ~loop
    result = np.where(
        seen, np.where(uncoiled, np.minimum(speaks_for, NO_LOOP), speaks_for), np.log(miss)
    )
    return np.where(measured(frames), np.clip(result, -MOST, MOST), 0.0)


def _margin(frames: pd.DataFrame, criteria: Criteria) -> np.ndarray:
    """(n,) by what share the largest envelope exceeds what a knot needs, over D and over the
    baseline; far below where either is unknown."""
    over_diameter = ratio_of(frames, "max_envelope") / criteria.knot_ratio
    over_baseline = over(frames, "max_envelope", frames, "baseline_envelope")
    lesser = np.minimum(over_diameter, over_baseline / criteria.knot_rise) - 1.0
    return np.where(np.isfinite(lesser), lesser, -1.0)


def larger_evidence(
    frames: pd.DataFrame, certainty: np.ndarray, largest_mm: np.ndarray, hole_mm: float
) -> np.ndarray:
    """(n,) for a knot larger than the separator's hole. Without hole or size the phase is never
    told (its onset is `undetermined` by `unknown.py`): nothing then speaks for it."""
    if not np.isfinite(hole_mm):
        return np.full(len(frames), -MOST)
    sighted = np.isfinite(certainty)
    seen = sighted & np.isfinite(largest_mm)
    size = np.where(seen, largest_mm, hole_mm)
    larger = norm.cdf((size - hole_mm) / (DIAMETER_NOISE * size))
    chance = np.clip(np.where(seen, certainty, 0.0), 0.02, 0.98)
    ratio = np.log(chance * larger + (1 - chance) * 0.5 + np.exp(-MOST)) - np.log(
        chance * (1 - larger) + (1 - chance) * 0.5 + np.exp(-MOST)
    )
    result = np.where(seen, ratio, np.where(sighted, UNSIZED, np.log(0.03)))
    return np.where(measured(frames), np.clip(result, -MOST, MOST), 0.0)
