"""Read a rig's log as it is: nothing is dropped in silence, everything odd is listed.

Expected are a time in s, a cycle counter, a motor current in mA and optionally a supply in mV,
under any of the names in `NAMES`.
"""

from __future__ import annotations

import csv
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tsvision.errors import InputError, why_unread
from tsvision.separators import separator_of

NAMES: dict[str, tuple[str, ...]] = {
    "time_s": ("timestamp", "time_s", "time", "t", "seconds"),
    "cycle": ("cyclecount", "cycle_count", "cycle", "cycles", "count"),
    "current_mA": ("current", "current_ma", "i_ma", "motor_current_ma"),
    "supply_mV": ("voltage", "supply_mv", "voltage_mv", "supply", "v_mv"),
}
NEEDED = ("time_s", "current_mA")
LEAST_ROWS = 20


@dataclass(frozen=True)
class Finding:
    """Something odd in a log: `kind`, how often, the first line (1-based, header = 1), in words."""

    kind: str
    count: int
    line: int
    text: str


@dataclass(frozen=True)
class RigLog:
    """A log in its own order; arrays of shape (n,). `cycle` and `supply_mV` are NaN throughout
    where the log has no such column. `line` is each row's line in the file."""

    source: str
    time_s: np.ndarray
    cycle: np.ndarray
    current_mA: np.ndarray
    supply_mV: np.ndarray
    line: np.ndarray
    findings: tuple[Finding, ...]


def read_log(path: Path) -> RigLog:
    """Parse a CSV log. Raises InputError when no usable log is in it."""
    try:
        text = path.read_text(encoding="utf-8-sig", errors="replace")
    except OSError as problem:
        raise InputError(f"cannot read '{path}' ({why_unread(problem)}); give a CSV log") from None
    written = [line.replace("\0", "") for line in text.splitlines()]
    rows = list(csv.reader(written, delimiter=separator_of(written[0] if written else "")))
    if not rows:
        raise InputError(f"'{path}' is empty; give a log with time and current")
    where = _columns(rows[0], path)
    values, lines, findings = _parse(rows, where)
    if len(values) < LEAST_ROWS:
        raise InputError(
            f"'{path}' holds {len(values)} readable rows; {LEAST_ROWS} are needed at least"
            + _unreadable(rows, findings)
        )
    if text and not text.endswith("\n"):
        findings.append(Finding("cut_short", 1, len(rows), "the last line has no end: cut short?"))
    table = np.array(values)
    if not np.any(np.diff(table[:, 0]) > 0):
        raise InputError(f"the time in '{path}' never advances; check its time column")
    findings += _stamps(table[:, 0], np.array(lines))
    findings += _saturation(table[:, 2], np.array(lines))
    return RigLog(
        path.name, table[:, 0], table[:, 1], table[:, 2], table[:, 3], np.array(lines),
        tuple(findings),
    )  # fmt: skip


def _unreadable(rows: list[list[str]], findings: list[Finding]) -> str:
    """The first row that is no numbers, as an example of what is to be mended."""
    for found in findings:
        if found.kind == "unreadable_rows" and found.line <= len(rows):
            cells = ", ".join(repr(cell[:20]) for cell in rows[found.line - 1][:6])
            return f" (line {found.line} holds {cells}); write numbers with decimal points"
    return ""


def _columns(header: list[str], path: Path) -> dict[str, int]:
    names = [name.strip().lower() for name in header]
    found = {
        column: names.index(next(alias for alias in aliases if alias in names))
        for column, aliases in NAMES.items()
        if any(alias in names for alias in aliases)
    }
    for column in NEEDED:
        if column not in found:
            raise InputError(
                f"'{path}' has no {column} column among {', '.join(header)}; "
                f"name it one of {', '.join(NAMES[column])}"
            )
    return found


def _parse(
    rows: list[list[str]], where: dict[str, int]
) -> tuple[list[list[float]], list[int], list[Finding]]:
    """Numbers of each readable row as (time, cycle, current, supply), and what was not readable."""
    values: list[list[float]] = []
    lines: list[int] = []
    headers: list[int] = []
    broken: list[int] = []
    for line, row in enumerate(rows[1:], start=2):
        if not any(cell.strip() for cell in row):
            broken.append(line)
            continue
        if [cell.strip() for cell in row] == [cell.strip() for cell in rows[0]]:
            headers.append(line)
            continue
        try:
            found = [float(row[where[name]]) if name in where else np.nan for name in NAMES]
        except (ValueError, IndexError):
            broken.append(line)
            continue
        if not np.isfinite([found[0], found[2]]).all():
            broken.append(line)
            continue
        values.append(found)
        lines.append(line)
    findings = []
    if headers:
        text = "the header again: the logger was started anew"
        findings.append(Finding("repeated_header", len(headers), headers[0], text))
    if broken:
        text = "rows without readable numbers, left out"
        findings.append(Finding("unreadable_rows", len(broken), broken[0], text))
    return values, lines, findings


def _stamps(time_s: np.ndarray, line: np.ndarray) -> list[Finding]:
    step = np.diff(time_s)
    found = []
    for kind, where, text in (
        ("repeated_stamp", step == 0, "time stamps equal to the one before; rows kept"),
        ("clock_back", step < 0, "the clock goes back: the logger was started anew"),
    ):
        if where.any():
            first = int(line[1:][where][0])
            found.append(Finding(kind, int(where.sum()), first, text))
    return found


def _saturation(current_mA: np.ndarray, line: np.ndarray) -> list[Finding]:
    """A ceiling that is met again and again exactly is the sensor's, not the motor's."""
    top = saturated_level(current_mA)
    if not np.isfinite(top):
        return []
    at = current_mA >= top
    text = f"current at the sensor's ceiling of {top:g} mA; true values are higher and unknown"
    return [Finding("saturated", int(at.sum()), int(line[at][0]), text)]


def saturated_level(current_mA: np.ndarray) -> float:
    """The sensor's ceiling, or inf where the largest reading is not a ceiling."""
    top = current_mA.max()
    often = np.sum(current_mA == top) >= max(5, 0.001 * current_mA.size)
    return float(top) if often and top > 0 else np.inf
