"""Motor turns (and time, displacement, load, cycle) of each frame.

A row that is merely missing leaves NaN, which the measurement flags; whatever could shift turns
against frames without anyone noticing is refused.
"""

from __future__ import annotations

import csv
import difflib
import math
import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TextIO

import numpy as np

from tsvision.errors import InputError
from tsvision.separators import has_decimal_comma, separator_of

COLUMNS = ("turns", "time_s", "displacement_mm", "load_N", "cycle")
_EMPTY = {"", "nan", "na", "n/a", "none", "null", "-"}
_NUMBER = r"[-+]?[0-9]*[.,]?[0-9]+"


@dataclass(frozen=True)
class TurnColumns:
    """One float array (n,) a column, NaN where unknown."""

    turns: np.ndarray
    time_s: np.ndarray
    displacement_mm: np.ndarray
    load_N: np.ndarray
    cycle: np.ndarray
    notes: tuple[str, ...] = ()


def beside(source: Path) -> Path | None:
    """The turns table that belongs to a recording: `film.turns.csv`, else `turns.csv`."""
    folder = source if source.is_dir() else source.parent
    named = [] if source.is_dir() else [folder / f"{source.stem}.turns.csv"]
    for candidate in [*named, folder / "turns.csv"]:
        if candidate.is_file():
            return candidate
    return None


def names_in(table: Path) -> list[str]:
    """The `file` column of a turns table; empty when it has none."""
    return [row["file"] for _, row in _rows(table) if row.get("file")]


def read_turns(
    table: Path | None,
    files: tuple[str, ...],
    turns_per_frame: float | None = None,
    turns_from_name: str | None = None,
    single: bool = False,
) -> TurnColumns:
    """Columns for `files`, from the table (None: all NaN) and the two options, which win over it.

    `single`: one picture was named out of a folder, so a table without its name says nothing.
    """
    if turns_per_frame is not None and turns_from_name is not None:
        raise InputError("--turns-per-frame and --turns-from-name: give one of them, not both")
    columns = _blank(len(files)) if table is None else _from_table(table, files, single)
    if turns_per_frame is not None:
        if not math.isfinite(turns_per_frame) or turns_per_frame == 0:
            raise InputError(f"--turns-per-frame {turns_per_frame}: must be a number other than 0")
        columns = replace(columns, turns=turns_per_frame * np.arange(len(files), dtype=float))
    elif turns_from_name is not None:
        columns = replace(columns, turns=_from_names(files, turns_from_name))
    missing = int(np.isnan(columns.turns).sum())
    if missing > 0:
        where = (
            "no frame has" if missing == len(files) else f"{missing} of {len(files)} frames lack"
        )
        note = f"{where} motor turns; such rows are flagged NO_TURNS"
        columns = replace(columns, notes=(*columns.notes, note))
    return columns


def _blank(count: int) -> TurnColumns:
    nothing = np.full(count, np.nan)
    return TurnColumns(nothing.copy(), nothing.copy(), nothing.copy(), nothing.copy(), nothing)


def name_pattern(expression: str) -> re.Pattern[str]:
    """The expression that finds a turn count in a file's name; InputError unless it marks one."""
    try:
        pattern = re.compile(expression)
    except re.error as error:
        raise InputError(
            f"--turns-from-name {expression!r}: no regular expression ({error})"
        ) from None
    if pattern.groups != 1:
        raise InputError(
            f"--turns-from-name {expression!r}: has {pattern.groups} groups; "
            r"mark the number with one, such as 't([0-9.]+)'"
        )
    return pattern


def number_in_name(pattern: re.Pattern[str], name: str) -> float:
    """The turn count in a file's name, NaN where the pattern does not match."""
    match = pattern.search(name)
    if not match or match[1] is None:
        return math.nan
    if not re.fullmatch(_NUMBER, match[1]):
        raise InputError(f"--turns-from-name: {match[1]!r} in {name!r} is not a number")
    return float(match[1].replace(",", "."))


def _from_names(files: tuple[str, ...], expression: str) -> np.ndarray:
    pattern = name_pattern(expression)
    turns = np.array([number_in_name(pattern, name) for name in files])
    if np.isnan(turns).all():
        raise InputError(
            f"--turns-from-name {expression!r}: matches no file, e.g. not {files[0]!r}"
        )
    return turns


# ------------------------------------------------------------------ the table


def _from_table(table: Path, files: tuple[str, ...], single: bool) -> TurnColumns:
    rows = list(_rows(table))
    if not rows:
        raise InputError(f"{table}: has no rows; write one a frame, or take the file away")
    must_hold_turns(table, list(rows[0][1]))
    places, notes = _places(table, rows, files, single)
    columns = _blank(len(files))
    first_line: dict[int, tuple[int, dict[str, float]]] = {}
    for (line, row), place in zip(rows, places, strict=True):
        if place is None:
            continue
        values = {name: number(table, line, name, row.get(name, "")) for name in COLUMNS}
        if place in first_line:
            earlier_line, earlier = first_line[place]
            if repr(earlier) != repr(values):  # NaN equals NaN here
                raise InputError(
                    f"{table}: lines {earlier_line} and {line} give frame {place} "
                    "different values; keep one of them"
                )
            continue
        first_line[place] = (line, values)
        for name in COLUMNS:
            getattr(columns, name)[place] = values[name]
    return replace(columns, notes=notes)


def must_hold_turns(table: Path, header: list[str]) -> None:
    """InputError for a table without a column `turns`."""
    if "turns" not in header:
        near = difflib.get_close_matches("turns", header, n=1, cutoff=0.5)
        hint = f"rename '{near[0]}'" if near else f"it has {', '.join(header)[:80]}"
        raise InputError(f"{table}: no column 'turns'; {hint}")


def _places(
    table: Path, rows: list[tuple[int, dict[str, str]]], files: tuple[str, ...], single: bool
) -> tuple[list[int | None], tuple[str, ...]]:
    """The frame that each row speaks of (None: a frame that is not here), and notes."""
    header = rows[0][1]
    if "file" in header:
        places, unknown = _places_by_file(table, rows, files)
        if len(unknown) < len(rows) or single:
            return places, _note_unknown(table, unknown, files)
        if "frame" not in header:
            raise InputError(
                f"{table}: none of its files is in the recording (e.g. {unknown[0]!r}, where the "
                f"recording has {files[0]!r}); mend the names or use a 'frame' column"
            )
    if single:
        return [None] * len(rows), (f"{table.name} does not name this picture",)
    if "frame" in header:
        return _places_by_frame(table, rows, len(files)), ()
    if len(rows) != len(files):
        raise InputError(
            f"{table}: {len(rows)} rows for {len(files)} frames and neither a 'frame' nor a "
            "'file' column to tell which is which; add one"
        )
    return list(range(len(rows))), ()


def _places_by_file(
    table: Path, rows: list[tuple[int, dict[str, str]]], files: tuple[str, ...]
) -> tuple[list[int | None], list[str]]:
    exact = {name: i for i, name in enumerate(files)}
    short: dict[str, int | None] = {}  # bare names, None where two folders hold the same
    for i, name in enumerate(files):
        bare = bare_name(name)
        short[bare] = None if bare in short else i
    places: list[int | None] = []
    unknown: list[str] = []
    for line, row in rows:
        name = row.get("file", "").strip()
        if not name:
            raise InputError(f"{table}, line {line}: 'file' is empty; name the picture")
        place = exact.get(name, short.get(bare_name(name)))
        places.append(place)
        if place is None:
            unknown.append(name)
    return places, unknown


def bare_name(name: str) -> str:
    """A file's name without its folders, whichever way they are parted."""
    return name.replace("\\", "/").rsplit("/", 1)[-1]


def _note_unknown(table: Path, unknown: list[str], files: tuple[str, ...]) -> tuple[str, ...]:
    if not unknown or len(files) == 1:
        return ()
    return (f"{table.name} names {len(unknown)} file(s) not in the recording, e.g. {unknown[0]!r}",)


def _places_by_frame(
    table: Path, rows: list[tuple[int, dict[str, str]]], count: int
) -> list[int | None]:
    places: list[int | None] = []
    for line, row in rows:
        place = frame_number(table, line, row)
        if place >= count:
            raise InputError(
                f"{table}, line {line}: frame {place} but the recording has {count} frames "
                f"(0 to {count - 1}); frames count from 0, and where pictures were taken out "
                "a 'file' column keeps turns and pictures together"
            )
        places.append(place)
    return places


def frame_number(table: Path, line: int, row: dict[str, str]) -> int:
    """The frame that a row names by its number."""
    text = row.get("frame", "").strip()
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not value.is_integer() or value < 0:
        raise InputError(f"{table}, line {line}: frame {text!r} is no whole number from 0 on")
    return int(value)


def number(table: Path, line: int, column: str, text: str) -> float:
    """What a cell holds; NaN where it is empty."""
    text = text.strip()
    if text.lower() in _EMPTY:
        return math.nan
    try:
        value = float(text)
    except ValueError:
        value = math.inf
    if math.isinf(value):
        hint = "write a decimal point" if has_decimal_comma(text) else "write a number"
        raise InputError(
            f"{table}, line {line}: {column} {text[:40]!r} is no number; {hint} or leave it empty"
        )
    return value


def _rows(table: Path) -> Iterator[tuple[int, dict[str, str]]]:
    """(line number, row) of a file."""
    try:
        with table.open(encoding="utf-8-sig", newline="") as file:
            yield from rows_in(table, file)
    except OSError as error:
        raise InputError(f"{table}: cannot be read ({error.strerror}); mend the path") from None


def rows_in(table: Path, file: TextIO) -> Iterator[tuple[int, dict[str, str]]]:
    """(line number, row) of an open CSV with a header; comma, semicolon or tab."""
    try:
        head = file.readline(65536)
        delimiter = separator_of(head)
        header = [name.strip() for name in next(csv.reader([head], delimiter=delimiter), [])]
        doubled = {name for name in header if header.count(name) > 1}
        if doubled:
            raise InputError(f"{table}: column '{min(doubled)}' is there twice; keep one")
        reader = csv.reader(file, delimiter=delimiter)
        for cells in reader:
            if not any(cell.strip() for cell in cells):
                continue
            if len(cells) > len(header):
                raise InputError(
                    f"{table}, line {reader.line_num + 1}: {len(cells)} values under "
                    f"{len(header)} columns; mend the line"
                )
            yield reader.line_num + 1, dict(zip(header, cells, strict=False))
    except (UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"{table}: no readable CSV in UTF-8 ({error})") from None
