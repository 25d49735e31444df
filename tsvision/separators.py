"""What parts the values of a text table: spreadsheets write what their language is used to."""

from __future__ import annotations


def separator_of(header: str) -> str:
    """Comma, semicolon or tab: which of them parts a table's first line most often."""
    return max(",;\t", key=header.count)
