"""The way back: at which turns phases end while unwinding, and which knots stay.

Each unwinding run is set against the winding before it; the difference of the two turn counts is
the hysteresis. Both come from the same drawn histories, so that the difference has its interval.
"""

from __future__ import annotations

import numpy as np

from tsvision.timeline.chain import SEED, Histories
from tsvision.timeline.criteria import LEVEL_OF_ONSET, Criteria
from tsvision.timeline.onset import Beginning, beginnings
from tsvision.timeline.order import Order

SURE = 0.85


def all_runs(order: Order) -> list[tuple[int, int, int]]:
    """(first, stop, direction) of every run, in the order taken."""
    result = []
    for number in np.unique(order.run):
        place = np.flatnonzero(order.run == number)
        result.append((int(place[0]), int(place[-1]) + 1, int(order.direction[place[0]])))
    return result


def ways_back(
    histories: dict[int, Histories], order: Order, criteria: Criteria
) -> list[dict[str, object]]:
    """One entry per unwinding run and phase that the run begins with."""
    entries: list[dict[str, object]] = []
    runs = all_runs(order)
    for number, (first, stop, way) in enumerate(runs):
        if way > 0:
            continue
        wound = runs[number - 1] if number > 0 else None
        for name, level in LEVEL_OF_ONSET.items():
            entry = _one_way_back(histories[level], order, (first, stop), wound, criteria)
            if entry:
                phase = name.removesuffix("_onset")
                entries.append({"run": number, "phase": phase, **entry})
    return entries


def _one_way_back(
    histories: Histories,
    order: Order,
    bounds: tuple[int, int],
    wound: tuple[int, int, int] | None,
    criteria: Criteria,
) -> dict[str, object]:
    first, stop = bounds
    there = histories.drawn[:, first:stop]
    begins = there[:, : max(2, criteria.persist_frames)].any(axis=1)
    if begins.mean() < SURE:
        return {}
    last = there.shape[1] - 1 - there[:, ::-1].argmax(axis=1)
    stays = begins & (last == there.shape[1] - 1)
    end_turns = order.sign * float(order.wind[stop - 1])
    if stays.mean() > SURE:
        return {"status": "stays", "turns": None, "low": None, "high": end_turns}
    gone = begins & ~stays
    if gone.mean() < SURE:
        return {"status": "undetermined", "turns": None, "low": None, "high": None}
    share = np.random.default_rng(SEED + 2).random(len(last))
    left = order.wind[first + last]
    right = order.wind[np.minimum(first + last + 1, stop - 1)]
    ended = left + share * (right - left)
    entry: dict[str, object] = {"status": "dissolved"}
    entry |= _interval(order.sign * ended[gone], criteria, "")
    if wound is not None:
        risen = beginnings(histories, order, wound[0], wound[1], criteria)
        entry |= _hysteresis(risen, order, ended, gone, criteria)
    return entry


def _hysteresis(
    risen: Beginning, order: Order, ended: np.ndarray, gone: np.ndarray, criteria: Criteria
) -> dict[str, object]:
    """Onset on winding minus end on unwinding, in turns; positive: it lasts longer going back."""
    both = gone & (risen.index >= 0)
    if both.mean() < SURE:
        return {}
    share = np.random.default_rng(SEED + 3).random(len(ended))
    left = order.wind[np.maximum(risen.index - 1, risen.first)]
    began = left + share * (order.wind[risen.index] - left)
    return _interval((began - ended)[both], criteria, "hysteresis_")


def _interval(values: np.ndarray, criteria: Criteria, prefix: str) -> dict[str, object]:
    tail = (1 - criteria.level) / 2
    low, middle, high = np.quantile(values, [tail, 0.5, 1 - tail])
    turns = "turns" if not prefix else f"{prefix}turns"
    return {turns: float(middle), f"{prefix}low": float(low), f"{prefix}high": float(high)}
