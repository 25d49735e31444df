"""In which order the frames were taken, and which of them wind and which unwind.

Frames come in the order of their names. With `time_s` the true order is known. Without it, turn
counts that jump about can only be sorted, which reads the recording as a single winding: that is
said in the notes. Otherwise the turn counts are cut where they turn back (by more than a few
steps, so that jitter and swapped neighbours make no run of their own).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd

ONLY_FALLING = (
    "the turns only fall: read backward, as if winding; if this is an unwinding, an onset told "
    "here is where the phase ends, and it begins at more turns"
)
SHUFFLED_REVERSALS = 0.45  # a shuffled series turns back at 2/3 of its frames, cycles at < 1/3


@dataclass(frozen=True)
class Order:
    """`rows` (n,) positions in the table in the order taken; `wind` (n,) |turns| there, gaps
    bridged; `known` (n,) whether the turns were given; `run` (n,) 0, 1, …; `direction` (n,) +1
    winding, -1 unwinding; `sign` the sense of winding; `notes` for people."""

    rows: np.ndarray
    wind: np.ndarray
    known: np.ndarray
    run: np.ndarray
    direction: np.ndarray
    sign: float
    notes: tuple[str, ...] = ()


def order_frames(frames: pd.DataFrame) -> Order:
    """Order the frames of one recording; `frames` has the columns `turns` and maybe `time_s`."""
    turns = numbers(frames, "turns")
    rows, notes, shuffled = _taking_order(turns, numbers(frames, "time_s"))
    known = np.isfinite(turns[rows])
    sign = -1.0 if np.nansum(turns) < 0 else 1.0
    wind = _bridge(sign * turns[rows])
    run, direction = _runs(wind) if not shuffled else (_zeros(rows), _zeros(rows) + 1)
    rows, wind, known, run, direction = _sort_within_runs(rows, wind, known, run, direction)
    if len(direction) and np.all(direction < 0):
        rows, wind, known, direction = rows[::-1], wind[::-1], known[::-1], -direction
        notes += (ONLY_FALLING,)
    return Order(rows, wind, known, run, direction, sign, notes)


def numbers(table: pd.DataFrame, column: str) -> np.ndarray:
    """A column as floats (len(table),), NaN where it is missing or no number."""
    if column not in table:
        return np.full(len(table), np.nan)
    values = table[column]
    if values.dtype != float:
        values = pd.to_numeric(values, errors="coerce")
    return values.to_numpy(dtype=float)


def _zeros(like: np.ndarray) -> np.ndarray:
    return np.zeros(len(like), dtype=int)


def _taking_order(
    turns: np.ndarray, time_s: np.ndarray
) -> tuple[np.ndarray, tuple[str, ...], bool]:
    rows = np.arange(len(turns))
    if len(rows) and np.isfinite(time_s).all():
        by_time = np.argsort(time_s, kind="stable")
        moved = not np.array_equal(by_time, rows)
        return by_time, (("frames were put into the order of time_s",) if moved else ()), False
    given = np.flatnonzero(np.isfinite(turns))
    if _reversals(turns[given]) > SHUFFLED_REVERSALS and len(given) >= 6:
        note = "the turn counts jump about: frames were sorted by turns and read as one winding"
        return given[np.argsort(np.abs(turns[given]), kind="stable")], (note,), True
    return rows, (), False


def _reversals(turns: np.ndarray) -> float:
    """Share of the frames at which the turn count turns back by a sizeable step."""
    steps = np.diff(turns)
    steps = steps[np.abs(steps) > 0.02 * np.ptp(turns)] if len(steps) else steps
    if len(steps) < 4:
        return 0.0
    return float(np.mean(np.sign(steps[1:]) != np.sign(steps[:-1])))


def _bridge(turns: np.ndarray) -> np.ndarray:
    """Linear in between where unknown, held at the ends; all NaN stays NaN."""
    good = np.isfinite(turns)
    if not good.any():
        return turns.copy()
    place = np.arange(len(turns))
    return np.interp(place, place[good], turns[good])


def _runs(wind: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Cut where the (median-filtered) series turns back by more than three typical steps."""
    run, direction = _zeros(wind), _zeros(wind) + 1
    if len(wind) < 2 or not np.isfinite(wind).all():
        return run, direction
    smooth = pd.Series(wind).rolling(3, center=True, min_periods=1).median().to_numpy()
    steps = np.abs(np.diff(wind))
    swing = (
        max(3.0 * float(np.median(steps[steps > 0])), 0.04 * np.ptp(wind), 0.5)
        if (steps > 0).any()
        else np.inf
    )
    cuts, signs = _turning_points(smooth, swing)
    for number, (start, stop) in enumerate(zip([0, *cuts], [*cuts, len(wind)], strict=True)):
        run[start:stop], direction[start:stop] = number, signs[number]
    return run, direction


def _turning_points(series: np.ndarray, swing: float) -> tuple[list[int], list[int]]:
    """Zigzag: positions after each extreme that is left again by more than `swing`."""
    cuts: list[int] = []
    signs: list[int] = []
    heading, extreme = 0, 0
    for i, value in enumerate(series):
        if heading == 0:
            if abs(value - series[0]) >= swing:
                heading, extreme = int(np.sign(value - series[0])), i
        elif heading * (value - series[extreme]) >= 0:
            extreme = i
        elif heading * (series[extreme] - value) > swing:
            cuts.append(extreme + 1)
            signs.append(heading)
            heading, extreme = -heading, i
    total = series[-1] - series[0]
    signs.append(heading or (1 if total >= 0 else -1))
    return cuts, signs


def _sort_within_runs(rows, wind, known, run, direction):  # type: ignore[no-untyped-def]
    """Frames of one run in the order of their turns, so that swapped neighbours do no harm."""
    key = np.lexsort((np.arange(len(rows)), direction * wind, run))
    return rows[key], wind[key], known[key], run[key], direction[key]
