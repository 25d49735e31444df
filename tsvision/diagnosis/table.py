"""DATA for the diagnosis: a long-form (or wide) table, checked, as arrays.

Defaults for the inputs' tolerances (one standard deviation) where no `<constant>_sd` column says
otherwise are in `DEFAULT_TOLERANCE`.
"""

from __future__ import annotations

import csv
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from tsvision.diagnosis.arrange import arrange
from tsvision.diagnosis.observations import Table
from tsvision.diagnosis.rows import check_names, long_from_wide, parse
from tsvision.errors import InputError, why_unread
from tsvision.records import Rig
from tsvision.separators import separator_of


def read_table(path: Path, rig: Rig | None = None) -> Table:
    """Read DATA.csv. Raises InputError with the line and the mend where something is wrong."""
    header, rows = read_rows(path)
    return table_from_rows(header, rows, rig or Rig(), str(path))


def read_rows(path: Path) -> tuple[list[str], list[dict]]:
    """Header and rows of a CSV as text, names stripped; InputError when it cannot be read."""
    try:
        with open(path, newline="", encoding="utf-8-sig") as file:
            separator = separator_of(file.readline())
            file.seek(0)
            reader = csv.DictReader(file, delimiter=separator)
            rows = [{k.strip(): v for k, v in row.items() if k is not None} for row in reader]
            header = [name.strip() for name in reader.fieldnames or []]
    except (OSError, UnicodeDecodeError, csv.Error) as problem:
        raise InputError(
            f"cannot read '{path}' as CSV ({why_unread(problem)}); give a UTF-8 CSV"
        ) from problem
    if not rows:
        raise InputError(f"'{path}' holds no rows; give one observation a row")
    return header, rows


def table_from_rows(
    header: Sequence[str], rows: Iterable[Mapping[str, object]], rig: Rig, where: str = "the table"
) -> Table:
    """Rows of text or numbers (keys as in the interface note) to a `Table`."""
    names = [name.strip() for name in header]
    notes: list[str] = []
    records = [{k.strip(): v for k, v in row.items() if k is not None} for row in rows]
    if "observable" not in names or "value" not in names:
        names, records = long_from_wide(names, records, notes, where)
    check_names(names, notes, where)
    if "turns" not in names:
        raise InputError(f"{where} has no column 'turns'; add the motor turns of each observation")
    parsed = parse(names, records, rig, notes, where)
    return arrange(parsed, notes, where, rig)
