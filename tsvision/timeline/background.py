"""How far knots must stand out in this recording before they are believed.

One view reads the envelope with errors of its own: lobes of strand and coil beat, edges slip. In
a coiled bundle the largest E(s) therefore lies above the baseline by several per cent, knot or no
knot, and by how much depends on strings, light and lens. The frames themselves tell: what the
largest E / E₀ has been so far is the background; a sighting counts by how far it stands above it.
A lobe too short for a knot (a fibre that lies across, two crests that meet) tells nothing of how
far a stretch as long as a knot may seem to stand out: where one sets the largest E, the frame is
left out.
"""

from __future__ import annotations

from collections import deque

import numpy as np
import pandas as pd

from tsvision.measures.zone.definitions import COIL_RATIO
from tsvision.measures.zone.knots import LOBE
from tsvision.timeline.evidence import CONFIDENCE_IF_UNKNOWN, ratio_of
from tsvision.timeline.lengths import UNITS, in_diameters
from tsvision.timeline.order import Order, numbers

PRIOR = (1.02, 1.05, 1.08)  # ratios assumed to have been seen before the first coiled frame
LEAST_SPREAD = 0.02
BELIEVED_AT = 2.0  # spreads at which a sighting is as likely a knot as not
STEEPNESS = 1.5  # log-odds per spread
STEADY_FRAMES = 5
TOPS = tuple(f"max_envelope_{unit}" for unit in UNITS)
ITS_TOP = 0.9  # share of a frame's largest E from which a sighting is what sets it


class Background:
    """The largest E / E₀ of the frames so far, events left out; grows by `push`.

    E₀ itself is steadied: where one frame reads it low, everything in that frame stands out.
    """

    def __init__(self) -> None:
        self._ratios = list(PRIOR)
        self._bases: deque[float] = deque(maxlen=STEADY_FRAMES)

    def steady(self, baseline: float) -> float:
        """This frame's E₀ (in the recording's unit of length, as all that is compared with it), but
        not below the median of the last frames' and its own."""
        if np.isfinite(baseline):
            self._bases.append(baseline)
            return float(max(baseline, np.median(self._bases)))
        return baseline

    def middle_and_spread(self) -> tuple[float, float]:
        """Median and robust standard deviation of the background."""
        ratios = np.array(self._ratios)
        middle = float(np.median(ratios))
        spread = 1.4826 * float(np.median(np.abs(ratios - middle)))
        return middle, max(spread, LEAST_SPREAD)

    def chance(self, ratio: float, confidence: float) -> float:
        """Chance that a sighting of size `ratio` · E₀ is a knot; never above the detector's own
        confidence, and that alone where the ratio is not known."""
        confidence = CONFIDENCE_IF_UNKNOWN if np.isnan(confidence) else confidence
        confidence = float(np.clip(confidence, 0.02, 0.98))
        if not np.isfinite(ratio):
            return confidence
        middle, spread = self.middle_and_spread()
        height = (ratio - middle) / spread
        odds = float(np.clip(STEEPNESS * (height - BELIEVED_AT), -4.0, 4.0))
        return min(confidence, 1.0 / (1.0 + np.exp(-odds)))

    def push(self, ratio: float, coil_ratio: float, sighted: bool) -> None:
        """Take a frame's largest E / E₀ into the background if the bundle coils there and the
        frame is no event: it shows no knot, or what is rather none."""
        if not (np.isfinite(ratio) and coil_ratio >= COIL_RATIO):
            return
        middle, spread = self.middle_and_spread()
        if not sighted or ratio <= middle + BELIEVED_AT * spread:
            self._ratios.append(ratio)


def sets_top(size: float, top: float) -> bool:
    """Whether a sighting so large is what sets a frame's largest E; not where either is unknown."""
    return bool(size >= ITS_TOP * top)


def without_lone_lobes(frames: pd.DataFrame, knots: pd.DataFrame) -> pd.DataFrame:
    """`frames` with the largest E left out (NaN) where a lobe among `knots` sets it."""
    lobes = knots[numbers(knots, "confidence") <= LOBE]
    size = pd.Series(in_diameters(lobes, "max_diameter", frames))
    largest = frames["frame"].map(size.groupby(lobes["frame"].to_numpy()).max())
    top = in_diameters(frames, "max_envelope", frames)
    lone = [sets_top(*both) for both in zip(largest, top, strict=True)]
    tops = {name: numbers(frames, name) for name in TOPS}
    return frames.assign(**{name: np.where(lone, np.nan, one) for name, one in tops.items()})


def chances(frames: pd.DataFrame, knots: pd.DataFrame, order: Order) -> np.ndarray:
    """(rows of knots,) chance of each sighting against the background of the frames before it."""
    return _followed(frames, knots, order)[0]


def least_believed(frames: pd.DataFrame, knots: pd.DataFrame, order: Order) -> float:
    """E / E₀ from which a sighting is rather a knot than not, by the end of the recording."""
    middle, spread = _followed(frames, knots, order)[1].middle_and_spread()
    return middle + BELIEVED_AT * spread


def _followed(
    frames: pd.DataFrame, knots: pd.DataFrame, order: Order
) -> tuple[np.ndarray, Background]:
    result = np.zeros(len(knots))
    base = in_diameters(frames, "baseline_envelope", frames)
    top = in_diameters(frames, "max_envelope", frames)
    coil = ratio_of(frames, "coil_amplitude")
    name = frames["frame"].to_numpy()
    rows_of = {key: np.asarray(rows) for key, rows in knots.groupby("frame").indices.items()}
    size = in_diameters(knots, "max_diameter", frames)
    confidence = numbers(knots, "confidence")
    background = Background()
    for i in order.rows:
        steady = background.steady(base[i])
        rows = rows_of.get(name[i], ())
        for row in rows:
            result[row] = background.chance(size[row] / steady, confidence[row])
        background.push(top[i] / steady, coil[i], sighted=len(rows) > 0)
    return result, background
