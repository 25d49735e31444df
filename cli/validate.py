"""`tsvision validate`: the paper's tables against the models, cell by cell."""

from __future__ import annotations

import json
import math
from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated

import typer

from cli import actuator_options as options

if TYPE_CHECKING:
    from tsvision.validation.cells import Cell


def command(
    table: Annotated[
        list[str] | None, typer.Option("--table", help="Only this table (may be repeated).")
    ] = None,
    as_json: options.JsonOption = False,
) -> None:
    """Published, computed, difference of every cell; exit 1 when one that should agree does not."""
    from tsvision.validation.cells import FAILURES
    from tsvision.validation.tables import all_cells

    cells = all_cells(tuple(table or ()))
    failed = [cell for cell in cells if cell.status in FAILURES]
    print(json.dumps(_as_data(cells), indent=2) if as_json else _as_text(cells))
    if failed:
        raise typer.Exit(1)


def _as_data(cells: list[Cell]) -> dict[str, object]:
    from tsvision.validation.cells import FAILURES, STATUS

    rows = []
    for cell in cells:
        row = {**asdict(cell), "difference": cell.difference}
        rows.append(
            {k: None if isinstance(v, float) and math.isnan(v) else v for k, v in row.items()}
        )
    counts = {status: sum(c.status == status for c in cells) for status in STATUS}
    return {
        "ok": not any(c.status in FAILURES for c in cells),
        "counts": counts,
        "status_meaning": STATUS,
        "cells": rows,
    }


def _as_text(cells: list[Cell]) -> str:
    from tsvision.data import manifest

    from tsvision.validation.cells import STATUS

    lines: list[str] = []
    for name in dict.fromkeys(cell.table for cell in cells):
        entry = manifest()["tables"][name]
        number = entry["table"]
        title = f"Table {number} ({name})" if len(number) <= 4 else f"Running text ({name})"
        lines += ["", f"{title}: {entry['description']}"]
        lines.append(
            f"  {'row':<38}{'column':<26}{'published':>10}{'computed':>11}{'diff':>10}  status"
        )
        lines += [_line(cell) for cell in cells if cell.table == name]
    reasons: dict[tuple[str, str], list[str]] = {}
    for cell in cells:
        if cell.reason and cell.status != "input":
            reasons.setdefault((cell.table, cell.reason), []).append(cell.row)
    lines += ["", "Not recomputed to the published rounding, and why:"]
    lines += [f"  {t} ({_rows(rows)}): {reason}" for (t, reason), rows in reasons.items()]
    counts = [(s, sum(c.status == s for c in cells)) for s in STATUS]
    lines += ["", *[f"{n:4d} {s}: {STATUS[s]}" for s, n in counts if n]]
    return "\n".join(lines).lstrip("\n")


def _line(cell: Cell) -> str:
    def show(value: float) -> str:
        return "-" if math.isnan(value) else f"{value:.6g}" if abs(value) < 1e6 else f"{value:.0f}"

    difference = "-" if math.isnan(cell.difference) else f"{round(cell.difference, 9):+.3g}"
    bounds = "" if math.isnan(cell.low) else f" [{cell.low:.4g}, {cell.high:.4g}]"
    head = f"  {cell.row:<38}{cell.column:<26}"
    numbers = f"{show(cell.published):>10}{show(cell.computed):>11}{difference:>10}"
    return f"{head}{numbers}  {cell.status}{bounds}"


def _rows(rows: list[str]) -> str:
    return "; ".join(rows) if len(rows) <= 4 else f"{len(rows)} rows"
