"""From drawn histories to an onset: a turn count, its interval, or why there is none.

The onset is the turn count at which a phase first appears and then persists. `turns` is that of
the first frame that shows it, and the interval holds at least the gap to the frame before, since
the true beginning lies anywhere in between. A recording that ends first gives `not_observed` up
to `last_turns`; pictures that do not tell give `undetermined`, with the reason.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tsvision.records import Onset
from tsvision.timeline.chain import SEED, Histories
from tsvision.timeline.criteria import Criteria
from tsvision.timeline.order import Order

SURE = 0.85  # share of the histories that must agree that there is, or is not, an onset
MOST_UNMEASURED = 0.5
WIDEST = 0.35  # of the turns covered: an interval wider than this tells too little


@dataclass(frozen=True)
class Beginning:
    """Per draw: `index` (DRAWS,) of the first frame of the persisting phase within one run,
    -1 where there is none, -2 where the run begins in the phase."""

    index: np.ndarray
    first: int
    stop: int


def beginnings(
    histories: Histories, order: Order, first: int, stop: int, criteria: Criteria
) -> Beginning:
    """Where the phase begins and persists within the frames [first, stop), for every draw."""
    there = histories.drawn[:, first:]
    ends = _next_absence(there)
    place = np.arange(there.shape[1])
    frames_held = ends - place
    last_held = np.minimum(ends - 1, there.shape[1] - 1)
    turns_held = np.abs(order.wind[first:][last_held] - order.wind[first:][place])
    lasts = (frames_held >= criteria.persist_frames) & (turns_held >= criteria.persist_turns)
    lasts |= ends >= min(stop - first, there.shape[1])
    lasts[:, : stop - first] &= _share_held(there[:, : stop - first], order.wind[first:stop]) >= (
        criteria.persist_share
    )
    enters = there & lasts
    enters[:, 1:] &= ~there[:, :-1]
    enters = enters[:, : stop - first]
    index = np.where(enters.any(axis=1), first + enters.argmax(axis=1), -1)
    return Beginning(np.where(index == first, -2, index), first, stop)


def _share_held(there: np.ndarray, wind: np.ndarray) -> np.ndarray:
    """(draws, n) share of the turns from each frame to the last at which the phase holds."""
    weight = np.maximum(np.abs(np.gradient(wind)) if len(wind) > 1 else np.ones(1), 1e-6)
    weight = weight.astype(np.float32)
    held = np.cumsum((there * weight)[:, ::-1], axis=1)[:, ::-1]
    return held / np.cumsum(weight[::-1])[::-1]


def _next_absence(there: np.ndarray) -> np.ndarray:
    """(draws, n) index of the next frame, from each on, at which the phase is absent; n if none."""
    count = there.shape[1]
    where = np.where(there, np.int32(count), np.arange(count, dtype=np.int32))
    return np.minimum.accumulate(where[:, ::-1], axis=1)[:, ::-1]


def onset_of(
    beginning: Beginning, order: Order, seen: np.ndarray, criteria: Criteria
) -> tuple[Onset, str]:
    """The onset within one run and, where it is not `observed`, the reason in words.

    `seen` (n,) tells which frames were measured, in the order of `order.rows`.
    """
    window = np.arange(beginning.first, beginning.stop)
    good = window[seen[window] & np.isfinite(order.wind[window])]
    if len(good) < 2:
        return _undetermined(order, good, criteria, "fewer than two frames were measured")
    found = beginning.index >= 0
    begun = float(np.mean(beginning.index == -2))
    if begun > 0.5:
        return _begun_before(order, good, criteria)
    share = float(found.mean())
    if share <= 1 - SURE:
        return _not_observed(order, window, good, criteria)
    if share < SURE:
        reason = f"the pictures leave it open (probability {share:.0%})"
        return _undetermined(order, good, criteria, reason)
    return _observed(beginning, order, good, criteria)


def _observed(
    beginning: Beginning, order: Order, good: np.ndarray, criteria: Criteria
) -> tuple[Onset, str]:
    index = np.sort(beginning.index[beginning.index >= 0])
    middle = int(index[len(index) // 2])
    first_seen = int(good[np.searchsorted(good, middle)]) if middle <= good[-1] else int(good[-1])
    before = good[good < first_seen]
    gap_from = order.wind[before[-1]] if len(before) else order.wind[beginning.first]
    share = np.random.default_rng(SEED + 1).random(len(index))
    left = order.wind[np.maximum(index - 1, beginning.first)]
    drawn = left + share * (order.wind[index] - left)
    tail = (1 - criteria.level) / 2
    low = min(float(np.quantile(drawn, tail)), float(gap_from))
    latest = order.wind[index[min(int(np.ceil((1 - tail) * len(index))), len(index) - 1)]]
    high = max(float(latest), float(order.wind[first_seen]))  # the end of its gap: the frame
    last = float(order.wind[good].max())
    if _blind(order, good, low, high):
        reason = f"too many frames between {low:.4g} and {high:.4g} turns could not be measured"
        onset = Onset("undetermined", None, low, high, last, criteria.level)
        return _signed(onset, order), reason
    onset = Onset("observed", float(order.wind[first_seen]), low, high, last, criteria.level)
    return _signed(onset, order), ""


def _blind(order: Order, good: np.ndarray, low: float, high: float) -> bool:
    """The interval is wide, and it is so because most frames in it were not measured."""
    wide = high - low > WIDEST * float(np.ptp(order.wind[good]))
    inside = (order.wind > low) & (order.wind < high)
    measured = np.isin(np.arange(len(order.wind)), good)
    return bool(wide and np.mean(measured[inside]) < 1 - MOST_UNMEASURED) if inside.any() else False


def _not_observed(
    order: Order, window: np.ndarray, good: np.ndarray, criteria: Criteria
) -> tuple[Onset, str]:
    last = float(order.wind[good].max())
    if len(good) < MOST_UNMEASURED * len(window):
        reason = f"only {len(good)} of {len(window)} frames could be measured"
        return _undetermined(order, good, criteria, reason)
    onset = Onset("not_observed", None, None, None, last, criteria.level)
    return _signed(onset, order), f"not up to {last:.4g} turns"


def _begun_before(order: Order, good: np.ndarray, criteria: Criteria) -> tuple[Onset, str]:
    start, last = float(order.wind[good[0]]), float(order.wind[good].max())
    onset = Onset("undetermined", None, None, start, last, criteria.level)
    return _signed(onset, order), f"it is there already in the first frame, at {start:.4g} turns"


def _undetermined(
    order: Order, good: np.ndarray, criteria: Criteria, reason: str
) -> tuple[Onset, str]:
    last = float(order.wind[good].max()) if len(good) else float("nan")
    return _signed(Onset("undetermined", None, None, None, last, criteria.level), order), reason


def _signed(onset: Onset, order: Order) -> Onset:
    """Back to the sense of the given turn counts (a motor may count its winding downward)."""
    if order.sign > 0:
        return onset
    turn = [None if v is None else -v for v in (onset.turns, onset.high, onset.low)]
    return Onset(onset.status, turn[0], turn[1], turn[2], -onset.last_turns, onset.level)
