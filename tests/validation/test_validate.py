"""Every table of the paper, recomputed; what differs is known and stays listed."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from cli.main import run
from tsvision.validation.cells import FAILURES, bounded, recomputed
from tsvision.validation.life import ERRATA
from tsvision.validation.tables import TABLES, all_cells

CELLS = all_cells()


def test_all_tables_have_cells_and_none_fails() -> None:
    assert {cell.table for cell in CELLS} == set(TABLES)
    assert [cell for cell in CELLS if cell.status in FAILURES] == []


def test_all_sixteen_diameter_errors_agree() -> None:
    errors = [c for c in CELLS if c.table == "diameter" and c.column.endswith("_error_mm")]
    assert len(errors) == 16
    assert all(c.status == "agrees" and abs(c.difference) <= 0.0072 for c in errors)


def test_the_two_errata_are_still_errata() -> None:
    found = [c for c in CELLS if c.status == "erratum"]
    assert len(found) == len(ERRATA)
    assert sorted(round(c.difference, 1) for c in found) == [-98.4, -36.4]


def test_what_is_not_reproduced_says_why() -> None:
    assert all(c.reason for c in CELLS if c.status not in ("agrees",))


def test_end_points_alone_prove_the_order_of_the_models() -> None:
    order = [cell for cell in CELLS if cell.column.startswith("constant better")]
    assert [cell.row for cell in order] == ["N=2", "N=4", "N=6", "N=8"]
    assert all(cell.status == "agrees" and cell.computed == 1 for cell in order)


def test_a_wrong_cell_fails_and_an_outdated_erratum_hides_nothing() -> None:
    assert recomputed("t", "r", "c", 1.0, 1.02, 0.01).status == "differs"
    assert recomputed("t", "r", "c", 1.0, 1.0, 0.01, "old excuse").reason == ""
    assert bounded("t", "r", "c", 3.0, 1.0, (0.0, 2.0), "why").status == "outside_bounds"


def test_command_prints_json_and_exits_zero(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["validate", "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["ok"] and len(answer["cells"]) == len(CELLS)


def test_command_text_holds_every_table(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["validate"]) == 0
    text = capsys.readouterr().out
    assert all(f"({name})" in text for name in TABLES)


def test_unknown_table_is_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["validate", "--table", "nothing"]) == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_the_page_on_the_paper_counts_the_cells_as_the_command_does() -> None:
    page = (Path(__file__).parents[2] / "docs" / "explanation" / "paper.md").read_text()
    for status in {cell.status for cell in CELLS}:
        count = sum(cell.status == status for cell in CELLS)
        row = next(line for line in page.splitlines() if line.startswith(f"| {status} |"))
        assert row.endswith(f"| {count} |")
