"""Cut a log into cycles without its counter, then hold the counter against that.

A rig either stops logging while it rests between cycles (pauses in the stamps) or logs on while
the motor idles. In the first case a cycle starts at a pause after which the motor starts before
the next pause; in the second where the motor starts after a rest. A rest with the supply off is
no rest: the cycle was interrupted and goes on when the supply returns.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import uniform_filter1d

from tsvision.riglog.read import Finding, RigLog, saturated_level

PAUSE = 5.0  # a gap this many times the usual step is a pause in the log
FEW_PAUSES = 3
NEAR_ROWS = 4  # the counter may count this many rows beside the start
RUNNING = 0.10  # of the 95th percentile of current: above it the motor pulls
OFF_MA = 10.0  # a motor that is off shows the sensor's offset only: less than this ...
OFF_SHARE = 0.01  # ... or this share of the 95th percentile
LEAST_RUNNING_MA = 10.0  # no motor of such a rig turns on less
OVERLOAD = 2.0  # times that percentile: above it the motor starts or stalls
COMMON = 0.3  # least share of rests that are of the long kind
SUPPLY_ON = 0.5  # of the median supply


@dataclass(frozen=True)
class Levels:
    """What the currents of a log mean, mA."""

    idle_mA: float  # motor off
    spinning_mA: float  # above it the motor turns, loaded or not
    running_mA: float  # above it the motor pulls
    load_mA: float  # usual current under load, first half of the log
    overload_mA: float  # above it the motor starts or stalls: twice its 95th percentile
    saturated_mA: float  # sensor's ceiling, inf if none


@dataclass(frozen=True)
class Cycles:
    """`start` holds the first row of each cycle; `of_row` (n,) the cycle of each row, 0 before
    the first; `counter` the log's own count at each start; `sound` whether the two agree."""

    start: np.ndarray
    of_row: np.ndarray
    counter: np.ndarray
    sound: bool
    by: str  # pauses | rests
    findings: tuple[Finding, ...]


def levels(log: RigLog) -> Levels:
    """Idle, spinning, running, load and ceiling currents of a log."""
    top = saturated_level(log.current_mA)
    on = supply_on(log)
    plain = log.current_mA[(log.current_mA < top) & on]
    high = float(np.quantile(plain, 0.95)) if plain.size else 0.0
    running = max(RUNNING * high, LEAST_RUNNING_MA)
    off = plain[np.abs(plain) < max(OFF_MA, OFF_SHARE * high)]
    idle = float(np.median(off)) if off.size else 0.0
    pulling = plain[plain >= running]
    half = pulling[: max(pulling.size // 2, 1)]
    load = float(np.median(half)) if half.size else float("nan")
    noise = float(np.median(np.abs(off - idle))) if off.size else 0.0
    spinning = min(idle + max(OFF_MA / 2, OFF_SHARE * high, 6 * noise), running)
    return Levels(idle, spinning, running, load, min(OVERLOAD * high, top), top)


def supply_on(log: RigLog) -> np.ndarray:
    """Rows with a supply (all, where the log does not record it); (n,) bool."""
    known = np.isfinite(log.supply_mV)
    if not known.any():
        return np.ones(log.time_s.size, dtype=bool)
    # The upper half: in a log that ends long after switching off the plain median would be low.
    usual = np.quantile(log.supply_mV[known], 0.75)
    return ~known | (log.supply_mV > SUPPLY_ON * usual)


def usual_step_s(log: RigLog) -> float:
    """Median time between rows that differ in time, s."""
    step = np.diff(log.time_s)
    return float(np.median(step[step > 0]))


def find_cycles(log: RigLog) -> Cycles:
    """Cycle starts by pauses or by rests, and what the log's own counter says to them."""
    known = levels(log)
    step = np.diff(log.time_s, prepend=log.time_s[0])
    # A clock that goes back is a logger started anew: as good as a pause.
    pause = (step > PAUSE * usual_step_s(log)) | (step < 0)
    pause[0] = True
    by = "pauses" if pause.sum() - 1 >= FEW_PAUSES else "rests"
    running = log.current_mA >= known.running_mA
    by_pauses = by == "pauses"
    spinning = log.current_mA > known.spinning_mA
    start = _after_pauses(pause, step, running) if by_pauses else _after_rests(log, spinning)
    of_row = np.searchsorted(start, np.arange(log.time_s.size), side="right")
    counter = log.cycle[start] if start.size else np.empty(0)
    findings = [*_odd_pauses(log, pause, start, by), *_counter(log, start)]
    sound = not any(f.kind.startswith("counter") for f in findings)
    return Cycles(start, of_row, counter, sound, by, tuple(findings))


def _after_pauses(pause: np.ndarray, step: np.ndarray, running: np.ndarray) -> np.ndarray:
    """Pauses that are followed by a start of the motor before the next pause.

    A short one that begins and ends with the motor running is the logger's own delay; one of
    the usual length counts even when the first row after it already shows the motor running.
    """
    rows = np.flatnonzero(pause)
    ends = np.append(rows[1:], pause.size)
    usual = float(np.median(step[rows[1:]]))
    return np.array(
        [
            row
            for row, end in zip(rows, ends, strict=True)
            if running[row:end].any() and (not running[row] or step[row] > usual / 2)
        ],
        dtype=int,
    )


def _after_rests(log: RigLog, spinning: np.ndarray) -> np.ndarray:
    """Motor starts after the longer kind of rest (a short one lies between winding and back).

    The motor counts as on while it spins, loaded or not: after a break it turns without load.
    """
    # Three of five rows: noise about the level starts and stops no motor.
    turning = uniform_filter1d(spinning.astype(float), 5, mode="nearest") > 0.5
    begin = np.flatnonzero(turning & ~np.roll(turning, 1))
    begin = begin[begin > 0] if turning[0] else begin
    if not begin.size:
        return begin
    on = supply_on(log)
    latest = np.maximum.accumulate(np.where(turning, np.arange(turning.size), 0))
    last = latest[begin - 1]
    rest = np.maximum(log.time_s[begin] - log.time_s[last], 1e-9)
    off_so_far = np.append(0, np.cumsum(~on))
    kept = (off_so_far[begin + 1] == off_so_far[last]) | (last == 0)
    kept &= rest > PAUSE * usual_step_s(log)
    kept[0] = True
    begin, rest = begin[kept], rest[kept]
    long_enough = np.log(rest) > _shortest_long_rest(np.log(rest[1:]))
    long_enough[0] = True
    return begin[long_enough]


def _shortest_long_rest(log_rest: np.ndarray) -> float:
    """Below this (log s) a rest lies inside a cycle; -inf where all rests are of one kind.

    Two kinds are told apart by the widest gap between rests, a factor of 2 at least; the long
    kind has to be common, or a single long stop would swallow all cycles.
    """
    if log_rest.size < 4:
        return -np.inf
    ordered = np.sort(log_rest)
    gap = np.diff(ordered)[: int((1 - COMMON) * ordered.size)]
    cut = int(np.argmax(gap))
    return float(ordered[cut] + gap[cut] / 2) if gap[cut] > np.log(2) else -np.inf


def _odd_pauses(log: RigLog, pause: np.ndarray, start: np.ndarray, by: str) -> list[Finding]:
    if by != "pauses":
        return []
    odd = np.setdiff1d(np.flatnonzero(pause[1:]) + 1, start)
    if not odd.size:
        return []
    longest = float(np.max(np.diff(log.time_s)[odd - 1]))
    text = f"gaps in the time stamps that start no cycle, up to {longest:.1f} s"
    return [Finding("gap_without_start", odd.size, int(log.line[odd[0]]), text)]


def _counter(log: RigLog, start: np.ndarray) -> list[Finding]:
    """Where the log's own counter falls, jumps, counts without motion, or does not count."""
    if not np.isfinite(log.cycle).any() or not start.size:
        return []
    step = np.diff(log.cycle)
    rises = np.flatnonzero(step > 0) + 1
    pieces = (
        ("counter_falls", np.flatnonzero(step < 0) + 1, "the counter falls: rig started anew"),
        ("counter_jumps", np.flatnonzero(step > 1) + 1, "the counter skips cycles"),
        (
            "counter_without_motion",
            np.array([r for r in rises if np.abs(start - r).min() >= NEAR_ROWS], dtype=int),
            "the counter counts a cycle in which the motor did not start",
        ),
        (
            "counter_missed",
            np.array([s for s in start if s > NEAR_ROWS and _flat(log.cycle, s)], dtype=int),
            "a cycle starts and the counter does not count it",
        ),
    )
    return [
        Finding(kind, rows.size, int(log.line[rows[0]]), text)
        for kind, rows, text in pieces
        if rows.size
    ]


def _flat(cycle: np.ndarray, row: int) -> bool:
    around = cycle[max(row - NEAR_ROWS, 0) : row + NEAR_ROWS]
    return bool(np.all(np.diff(around) == 0))
