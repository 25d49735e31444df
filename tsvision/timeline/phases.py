"""The phase of every frame, as a smooth account: what most drawn histories say, no flicker."""

from __future__ import annotations

import numpy as np

from tsvision.timeline.chain import Histories
from tsvision.timeline.criteria import PHASES, Criteria
from tsvision.timeline.order import Order

FILL = 0.8  # an unmeasured frame is given a phase only if the histories agree this well


def levels(histories: dict[int, Histories], order: Order, criteria: Criteria) -> np.ndarray:
    """(n,) index into PHASES, in the order of `order.rows`: the highest phase that holds."""
    result = np.zeros(len(order.rows), dtype=int)
    for level in sorted(histories):
        there = histories[level].there > 0.5
        result[without_flicker(there, order.run, criteria.persist_frames)] = level
    return result


def without_flicker(there: np.ndarray, run: np.ndarray, frames: int) -> np.ndarray:
    """(n,) bool with spells shorter than `frames` taken back, unless they touch a run's end."""
    result = there.copy()
    for wanted in (False, True):
        for start, stop in spells(result == wanted):
            if start > 0 and stop < len(result) and stop - start < frames:
                turns_back = run[start - 1] != run[min(stop, len(run) - 1)]
                result[start:stop] = result[start:stop] if turns_back else not wanted
    return result


def spells(mask: np.ndarray) -> list[tuple[int, int]]:
    """[first, stop) of every unbroken stretch of True in (n,) bool."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], mask.astype(int), [0]])))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))


def names(level: np.ndarray, histories: dict[int, Histories], seen: np.ndarray) -> list[str]:
    """Phase names (n,); "" where a frame was not measured and its neighbours do not settle it.
    Before the first measured frame (legs that do not touch yet) the turn count may settle it."""
    sure = np.ones(len(level))
    for one in histories.values():
        sure = np.minimum(sure, np.maximum(one.there, 1 - one.there))
    good = np.flatnonzero(seen)
    inside = np.zeros(len(level), dtype=bool)
    if len(good):
        inside[: good[-1] + 1] = True
    told = seen | (inside & (sure >= FILL))
    return [PHASES[k] if ok else "" for k, ok in zip(level, told, strict=True)]
