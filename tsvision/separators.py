"""What parts the values of a text table: spreadsheets write what their language is used to."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

from tsvision.errors import InputError, why_unread

if TYPE_CHECKING:
    import pandas as pd

_DECIMAL_COMMA = re.compile(r"\s*[-+]?\d*,\d+\s*")


def separator_of(header: str) -> str:
    """Comma, semicolon or tab: which of them parts a table's first line most often."""
    return max(",;\t", key=header.count)


def has_decimal_comma(text: object) -> bool:
    """Whether a cell holds a number as languages of decimal commas write it."""
    return _DECIMAL_COMMA.fullmatch(str(text)) is not None


def read_frame(path: Path) -> pd.DataFrame:
    """A text table with a header, all cells as text, names stripped; InputError when it cannot be
    read."""
    import pandas as pd  # loads slowly, and most who ask for a separator need none of it

    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            separator = separator_of(file.readline())
            file.seek(0)
            data = pd.read_csv(file, sep=separator, dtype=str)
    except (OSError, ValueError) as problem:
        raise InputError(
            f"cannot read '{path}' as CSV ({why_unread(problem)}); give a CSV file"
        ) from None
    data = data.rename(columns=str.strip)
    if data.columns.has_duplicates:
        doubled = data.columns[data.columns.duplicated()][0]
        raise InputError(f"{path}: column '{doubled}' is there twice; keep one")
    return data
