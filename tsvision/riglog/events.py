"""Stalls, times without supply, and the break: the load that vanishes from the current."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import median_filter

from tsvision.riglog.cycles import Cycles, Levels, supply_on, usual_step_s
from tsvision.riglog.read import Finding, RigLog

STALL_INRUSH = 5.0  # times the usual start-up peak
STALL_LEAST_S = 0.5
UNLOADED = 0.5  # of the usual load
BELOW_ALL = 0.85  # of the first percentile of current in the first half of the log
LEAST_UNLOADED_ROWS = 6
STOP = 2.5  # usual steps without a spinning row part two strokes
LEAST_STROKES = 8  # before the break, to compare with
WINDOW = 7  # rows of the running median: single dips are no break
END_ROWS = 10  # a stall may end so many rows before the supply goes
LONGER = 3.0  # than any stretch without load seen before


@dataclass(frozen=True)
class Stretch:
    """Rows `first` to `last` of the log, with cycle and time."""

    first: int
    last: int
    cycle: int
    start_s: float
    duration_s: float


@dataclass(frozen=True)
class End:
    """How the log ends: broke | stalled | supply_off | running.

    `broke`: the motor spins but the load is gone for good; cycle, time and line where it went.
    `stalled`: the motor pulled far above its usual current until the supply went off.
    """

    kind: str
    cycle: int
    time_s: float
    line: int
    text: str


def stretches(log: RigLog, cycles: Cycles, where: np.ndarray) -> list[Stretch]:
    """Runs of consecutive rows at which `where` (n,) holds; a pause or a new cycle ends one."""
    step = np.diff(log.time_s, prepend=log.time_s[0])
    fresh = (step > 5 * usual_step_s(log)) | (step < 0)
    fresh[cycles.start] = True
    begin = where & (~np.roll(where, 1) | fresh)
    begin[0] = where[0]
    found = []
    for first in np.flatnonzero(begin):
        last = first
        while last + 1 < where.size and where[last + 1] and not fresh[last + 1]:
            last += 1
        length = float(log.time_s[last] - log.time_s[first])
        cycle = int(cycles.of_row[first])
        found.append(Stretch(int(first), int(last), cycle, float(log.time_s[first]), length))
    return found


def stalls(log: RigLog, cycles: Cycles, known: Levels) -> list[Stretch]:
    """Overloads that last far longer than the usual start-up peak."""
    overload = log.current_mA >= known.overload_mA
    found = stretches(log, cycles, overload & supply_on(log))
    if not found:
        return []
    usual = float(np.median([s.duration_s for s in found]))
    limit = max(STALL_INRUSH * usual, STALL_LEAST_S)
    return [s for s in found if s.duration_s > limit]


def supply_losses(log: RigLog, cycles: Cycles) -> list[Stretch]:
    """Times without supply; one that ends before the log does is followed by a restart."""
    return stretches(log, cycles, ~supply_on(log))


def event_findings(log: RigLog, stalled: list[Stretch], lost: list[Stretch]) -> list[Finding]:
    """Stalls and supply losses as findings beside those of the reader."""
    found = []
    if stalled:
        longest = max(s.duration_s for s in stalled)
        many = len({s.cycle for s in stalled})
        text = f"stalls or overloads in {many} cycles, the longest {longest:.1f} s"
        found.append(Finding("stall", len(stalled), int(log.line[stalled[0].first]), text))
    if lost:
        inside = [s for s in lost if s.last + 1 < log.time_s.size]
        total = sum(s.duration_s for s in lost)
        text = f"times without supply, {total:.1f} s in all, {len(inside)} of them with a restart"
        found.append(Finding("supply_off", len(lost), int(log.line[lost[0].first]), text))
    return found


def find_end(log: RigLog, cycles: Cycles, known: Levels, stalled: list[Stretch]) -> End:
    """How the log ends, from the current alone."""
    broke = _break_row(log, cycles, known)
    final = log.time_s.size - 1
    if broke is not None:
        text = "the motor spins on without its load"
        return _end("broke", log, cycles, broke, text)
    on = supply_on(log)
    if not on[final]:
        off = int(np.flatnonzero(on)[-1]) + 1
        at_end = [s for s in stalled if abs(s.last - off) <= END_ROWS]
        if at_end:
            text = f"a stall of {at_end[-1].duration_s:.1f} s, then the supply went off"
            return _end("stalled", log, cycles, at_end[-1].first, text)
        return _end("supply_off", log, cycles, off, "the supply went off")
    return _end("running", log, cycles, final, "the log ends with the rig still in use")


def _end(kind: str, log: RigLog, cycles: Cycles, row: int, text: str) -> End:
    return End(kind, int(cycles.of_row[row]), float(log.time_s[row]), int(log.line[row]), text)


def _break_row(log: RigLog, cycles: Cycles, known: Levels) -> int | None:
    """First row of the final stretch without load, or None.

    Counted are rows at which the motor spins, start-up peaks and the sensor's ceiling left out:
    row by row where the load stands out, else by the means of whole strokes.
    """
    current = log.current_mA
    peak = current >= known.overload_mA
    after_peak = peak | np.roll(peak, 1)
    spins = np.flatnonzero((current > known.spinning_mA) & ~after_peak & supply_on(log))
    if spins.size < 5 * LEAST_UNLOADED_ROWS:
        return None
    found = _break_by_rows(current[spins], spins, cycles, known)
    if found is None:
        found = _break_by_strokes(log.time_s[spins], current[spins], usual_step_s(log))
    return None if found is None else int(spins[found])


def _break_by_rows(
    values: np.ndarray, spins: np.ndarray, cycles: Cycles, known: Levels
) -> int | None:
    """The final unloaded stretch must either reach over a whole later start of the motor or be
    three times as long as any unloaded stretch before it."""
    smooth = median_filter(values, WINDOW, mode="nearest")
    held = np.flatnonzero(smooth >= _unloaded_level(smooth, known))
    if not held.size or held[-1] + 1 >= values.size:
        return None
    tail = spins[held[-1] + 1 :]
    before = np.diff(held) - 1
    longest = int(before.max()) if before.size else 0
    later_starts = int(np.sum(cycles.start > tail[0] + 1))
    enough = tail.size >= LEAST_UNLOADED_ROWS
    if enough and (later_starts >= 1 or tail.size >= LONGER * longest):
        near = int(held[-1]) + 1
        return _edge(values, max(near - 2 * WINDOW, 0), min(near + 2 * WINDOW, values.size))
    return None


def _break_by_strokes(time_s: np.ndarray, values: np.ndarray, step_s: float) -> int | None:
    """Strokes (rows without a stop between them) whose means all lie under those just before.

    Noise hides a light load in single rows, but not in the mean of a stroke.
    """
    first = np.append(0, np.flatnonzero(np.abs(np.diff(time_s)) > STOP * step_s) + 1)
    last = np.append(first[1:], values.size)
    kept = last - first >= LEAST_UNLOADED_ROWS
    first, last = first[kept], last[kept]
    mean = np.array([values[a:b].mean() for a, b in zip(first, last, strict=True)])
    # The stroke before the tail is the one in which the load went: it counts on neither side.
    for tail in range(LEAST_STROKES + 1, first.size):
        recent = mean[tail - 1 - LEAST_STROKES : tail - 1]
        if mean[tail:].max() < BELOW_ALL * recent.min():
            return _edge(values, int(first[tail - 1]), int(last[tail]))
    return None


def _edge(values: np.ndarray, low: int, high: int) -> int:
    """The index in low + 1 … high - 1 at which one step down fits best (least squares)."""
    piece = values[low:high]
    count = np.arange(1, piece.size)
    sums = np.cumsum(piece)[:-1]
    rest = piece.sum() - sums
    gain = sums**2 / count + rest**2 / (piece.size - count)
    falls = sums / count > rest / (piece.size - count)
    return low + 1 + int(np.argmax(np.where(falls, gain, -np.inf)))


def _unloaded_level(smooth: np.ndarray, known: Levels) -> float:
    """Below it the load is gone: half the usual load, or just under all that the first half of
    the log has shown, where a light load stands out little from none."""
    first = smooth[: max(smooth.size // 2, 1)]
    return max(UNLOADED * known.load_mA, BELOW_ALL * float(np.quantile(first, 0.01)))
