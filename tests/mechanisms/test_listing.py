"""docs/diagnosis.md lists what is on the shelf."""

from __future__ import annotations

from pathlib import Path

from tsvision.mechanisms.listing import listing

PAGE = Path(__file__).resolve().parents[2] / "docs" / "diagnosis.md"


def test_the_page_holds_the_shelf_as_it_is() -> None:
    """If not: paste the output of `python -m tsvision.mechanisms.listing` between the marks."""
    text = PAGE.read_text(encoding="utf-8")
    between = text.split("<!-- shelf -->")[1]
    assert between.strip() == listing().strip()
