"""Repeated cycles: does a phase begin at the same turn count each time?

Mean and spread over the cycles, and a straight line over the cycle number for the drift. Cycles
in which the phase was there from the start (a knot that stayed) or never came are counted and
left out of the mean, which is then the mean of those seen and says so.
"""

from __future__ import annotations

import numpy as np
import pandas as pd
from scipy.stats import t as student

from tsvision.records import Onset
from tsvision.timeline.chain import Histories
from tsvision.timeline.criteria import Criteria
from tsvision.timeline.onset import beginnings, onset_of
from tsvision.timeline.order import Order, numbers
from tsvision.timeline.unwinding import all_runs


def onsets_by_cycle(
    frames: pd.DataFrame,
    histories: Histories,
    order: Order,
    seen: np.ndarray,
    criteria: Criteria,
) -> list[tuple[float, Onset, str]]:
    """(cycle, onset, reason) for every winding run, in the order taken."""
    given = numbers(frames, "cycle")[order.rows]
    answers: list[tuple[float, Onset, str]] = []
    for first, stop, way in all_runs(order):
        if way > 0:
            label = np.nanmedian(given[first:stop]) if np.isfinite(given[first:stop]).any() else 0
            number = float(label) if np.isfinite(given).any() else float(len(answers) + 1)
            found = beginnings(histories, order, first, stop, criteria)
            answers.append((number, *onset_of(found, order, seen, criteria)))
    return answers


def repeatability(by_cycle: list[tuple[float, Onset, str]], level: float) -> dict[str, object]:
    """Mean, spread and drift over cycles; empty with fewer than two winding runs."""
    if len(by_cycle) < 2:
        return {}
    seen = [(number, onset.turns) for number, onset, _ in by_cycle if onset.turns is not None]
    result: dict[str, object] = {
        "cycles": len(by_cycle),
        "observed": len(seen),
        "not_observed": sum(o.status == "not_observed" for _, o, _ in by_cycle),
        "each": [
            {"cycle": n, "status": o.status, "turns": o.turns, "low": o.low, "high": o.high}
            for n, o, _ in by_cycle
        ],
    }
    if len(seen) >= 2:
        cycle, turns = np.array(seen, dtype=float).T
        result |= {
            "mean_turns": float(turns.mean()),
            "spread_turns": float(turns.std(ddof=1)),
            "drift_turns_per_cycle": _drift(cycle, turns, level),
        }
    return result


def _drift(cycle: np.ndarray, turns: np.ndarray, level: float) -> dict[str, float | None]:
    """Slope of onset over cycle number with its interval; no interval from two cycles."""
    centred = cycle - cycle.mean()
    square = float(np.sum(centred**2))
    if square == 0:
        return {"value": None, "low": None, "high": None}
    slope = float(np.sum(centred * turns) / square)
    free = len(turns) - 2
    if free < 1:
        return {"value": slope, "low": None, "high": None}
    left = turns - turns.mean() - slope * centred
    half = float(student.ppf((1 + level) / 2, free) * np.sqrt(np.sum(left**2) / free / square))
    return {"value": slope, "low": slope - half, "high": slope + half}
