"""The reference data are what the manifest says, column by column."""

from __future__ import annotations

import hashlib
from pathlib import Path

import pytest
from tsvision.data import manifest, table

from tsvision.errors import InputError

DATA = Path(__file__).resolve().parents[2] / "data"
TABLES = manifest()["tables"]


@pytest.mark.parametrize("name", TABLES)
def test_file_units_and_checksum_agree_with_the_manifest(name: str) -> None:
    entry = TABLES[name]
    raw = (DATA / entry["file"]).read_bytes()
    assert hashlib.sha256(raw).hexdigest() == entry["sha256"]
    rows = table(name)
    assert len(rows) == entry["rows"]
    assert list(rows.columns) == list(entry["units"])


def test_every_csv_is_in_the_manifest() -> None:
    assert {p.name for p in DATA.glob("*.csv")} == {e["file"] for e in TABLES.values()}


def test_a_column_in_mm_says_so() -> None:
    for entry in TABLES.values():
        for column, unit in entry["units"].items():
            assert (unit == "mm") == column.endswith("_mm"), column


def test_unknown_table_lists_the_known() -> None:
    with pytest.raises(InputError, match="life_cycle"):
        table("lifecycle")
