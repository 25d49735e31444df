"""`tsvision validate`: the paper's tables against the models, cell by cell."""

from __future__ import annotations

import math
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cli import actuator_options as options

if TYPE_CHECKING:
    from tsvision.validation.cells import Cell
    from tsvision.validation.measured import Bundles, Support


def command(
    sources: Annotated[
        list[Path] | None,
        typer.Argument(help="With --measured: folders of `measure`, or CSVs of N, d, load, D, sd."),
    ] = None,
    measured: Annotated[
        bool, typer.Option("--measured", help="Weigh the bundle models on one's own diameters.")
    ] = False,
    table: Annotated[
        list[str] | None, typer.Option("--table", help="Only this table (may be repeated).")
    ] = None,
    strings: options.StringsOption = None,
    string_diameter: options.StringDiameterOption = None,
    as_json: options.JsonOption = False,
) -> None:
    """Published, computed, difference of every cell; exit 1 when one that should agree does not."""
    from tsvision.errors import InputError
    from tsvision.jsonable import to_json

    if measured:
        if not sources:
            raise InputError("--measured needs folders that `tsvision measure` wrote, or CSV files")
        print(_measured(sources, strings, string_diameter, as_json), end="")
        return
    if sources:
        raise InputError(f"'{sources[0]}' was given without --measured; add it")
    from tsvision.validation.cells import FAILURES
    from tsvision.validation.tables import all_cells

    cells = all_cells(tuple(table or ()))
    failed = [cell for cell in cells if cell.status in FAILURES]
    print(to_json(_as_data(cells)) if as_json else _as_text(cells) + "\n", end="")
    if failed:
        raise typer.Exit(1)


def _measured(
    sources: list[Path], strings: int | None, string_diameter: float | None, as_json: bool
) -> str:
    from tsvision.jsonable import to_json
    from tsvision.validation.bundles import read_bundles
    from tsvision.validation.measured import judge

    bundles, notes = read_bundles(sources, strings, string_diameter)
    support = judge(bundles)
    if as_json:
        answer = {
            "bundles": [
                {
                    "source": bundles.source[k],
                    "strings": bundles.strings[k],
                    "string_diameter_mm": bundles.string_diameter_mm[k],
                    "load_N": bundles.load_N[k],
                    "diameter_mm": bundles.diameter_mm[k],
                    "sd_mm": bundles.sd_mm[k],
                }
                for k in range(bundles.strings.size)
            ],
            "notes": notes,
            "models": support.verdicts,
            "supports": support.verdicts[0].model if support.decided else None,
            "odds": support.odds,
            "rival": support.rival,
            "load_slope": support.load_slope,
        }
        return to_json(answer)
    return "\n".join(_measured_text(bundles, support, notes)) + "\n"


def _measured_text(bundles: Bundles, support: Support, notes: list[str]) -> list[str]:
    lines = [f"note: {note}" for note in notes]
    names = [v.model for v in support.verdicts]
    lines.append(f"{'':<26}{'N':>3}{'d mm':>8}{'load N':>8}{'D mm':>9}{'sd':>7}  model - measured")
    for k, source in enumerate(bundles.source):
        errors = "  ".join(
            f"{v.predicted_mm[k] - bundles.diameter_mm[k]:+.3f} {v.model}" for v in support.verdicts
        )
        load = "-" if math.isnan(bundles.load_N[k]) else f"{bundles.load_N[k]:.1f}"
        lines.append(
            f"{source:<26}{bundles.strings[k]:>3.0f}{bundles.string_diameter_mm[k]:>8.3f}"
            f"{load:>8}{bundles.diameter_mm[k]:>9.4f}{bundles.sd_mm[k]:>7.4f}  {errors}"
        )
    lines += ["", f"{'bundle model':<28}{'RMSE mm':>9}{'bias':>9}{'left out':>10}{'weight':>9}"]
    for v in support.verdicts:
        left = "-" if math.isnan(v.left_out_mm) else f"{v.left_out_mm:.4f}"
        fitted = "".join(f"  {name} = {value:.3g}" for name, value in v.fitted.items())
        numbers = f"{v.rmse_mm:>9.4f}{v.bias_mm:>+9.4f}{left:>10}{v.weight:>9.3f}"
        lines.append(f"{v.model:<28}{numbers}{fitted}")
    verdict = (
        f"supported: {names[0]}, {support.odds:.3g} times as likely as {support.rival}"
        if support.decided
        else f"undecided: {names[0]} is only {support.odds:.2g} times as likely as {support.rival}"
    )
    lines += ["", verdict]
    slope, low, high = support.load_slope
    if not math.isnan(slope):
        lines.append(
            f"D against the best model per tenfold load: {100 * slope:+.1f} % "
            f"[{100 * low:+.1f}, {100 * high:+.1f}]"
        )
    return lines


def _as_data(cells: list[Cell]) -> dict[str, object]:
    from tsvision.validation.cells import FAILURES, STATUS

    counts = {status: sum(c.status == status for c in cells) for status in STATUS}
    return {
        "ok": not any(c.status in FAILURES for c in cells),
        "counts": counts,
        "status_meaning": STATUS,
        "cells": [{**asdict(cell), "difference": cell.difference} for cell in cells],
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
