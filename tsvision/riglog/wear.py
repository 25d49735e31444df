"""One row a cycle, and what changes over the cycles."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
import pandas as pd
from scipy import stats

from tsvision.riglog.cycles import Cycles, Levels, supply_on
from tsvision.riglog.read import RigLog

LEAST_CYCLES = 10
MEASURES = ("load_mA", "peak_time_s", "duration_s", "supply_low_mV")


@dataclass(frozen=True)
class Trend:
    """Robust slope of a measure over the cycles (Theil-Sen, 95 %), per 100 cycles.

    `p_value` is Kendall's, for no trend at all; `share` the change over the whole log relative to
    the median.
    """

    measure: str
    slope: float
    low: float
    high: float
    share: float
    p_value: float


def cycle_table(log: RigLog, cycles: Cycles, known: Levels) -> pd.DataFrame:
    """One row a cycle: cycle, counter, line, start_s, duration_s, rows and the `MEASURES`.

    load_mA is the trimmed mean current while pulling, overloads left out; peak_time_s the time
    in overload. NaN where a cycle has no such rows.
    """
    on = supply_on(log)
    bounds = np.append(cycles.start, log.time_s.size).astype(int)
    rows = [
        {
            "cycle": number,
            "counter": log.cycle[a],
            "line": int(log.line[a]),
            **_cycle(log, slice(a, b), known, on[a:b]),
        }
        for number, (a, b) in enumerate(itertools.pairwise(bounds), start=1)
    ]
    columns = ["cycle", "counter", "line", "start_s", "duration_s", "rows", *MEASURES]
    return pd.DataFrame(rows, columns=list(dict.fromkeys(columns)))


def _cycle(log: RigLog, rows: slice, known: Levels, on: np.ndarray) -> dict[str, float]:
    time, current = log.time_s[rows], log.current_mA[rows]
    peak = current >= known.overload_mA
    pulling = (current >= known.running_mA) & ~peak & on
    step = np.diff(time, append=time[-1])
    active = np.flatnonzero((current >= known.running_mA) & on)
    supply = log.supply_mV[rows][on]
    return {
        "start_s": float(time[0]),
        "duration_s": float(time[active[-1]] - time[active[0]]) if active.size else np.nan,
        "rows": int(time.size),
        # Not the median: winding and unwinding pull differently, and it would jump between them.
        "load_mA": float(stats.trim_mean(current[pulling], 0.1)) if pulling.any() else np.nan,
        "peak_time_s": float(np.clip(step[peak], 0, None).sum()),
        "supply_low_mV": float(supply.min()) if np.isfinite(supply).any() else np.nan,
    }


def trends(table: pd.DataFrame) -> list[Trend]:
    """Trends of every measure that at least `LEAST_CYCLES` cycles have; the last cycle, in which
    most rigs are stopped by hand, is left out."""
    found = []
    for measure in MEASURES:
        data = table.iloc[:-1][["cycle", measure]].dropna()
        if len(data) < LEAST_CYCLES or data[measure].nunique() < 2:
            continue
        x, y = data["cycle"].to_numpy(float), data[measure].to_numpy(float)
        slope, _, low, high = (float(v) for v in stats.theilslopes(y, x, 0.95))
        p_value = float(stats.kendalltau(x, y).pvalue)
        middle = float(np.median(y))
        share = slope * (x[-1] - x[0]) / abs(middle) if middle else float("nan")
        found.append(Trend(measure, 100 * slope, 100 * low, 100 * high, float(share), p_value))
    return found
