"""`tsvision onsets`: the onsets of many recordings, together."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from cli.onset import Phase


def command(
    folders: Annotated[list[Path], typer.Argument(help="Folders that `measure` or `batch` wrote.")],
    phase: Annotated[Phase, typer.Option("--phase", help="The beginning of which phase.")] = (
        Phase.knot
    ),
    by: Annotated[
        str, typer.Option("--by", help="Groups: strings, load_N, string_diameter_mm or none.")
    ] = "strings",
    out: Annotated[
        Path | None,
        typer.Option("--out", help="Folder for onsets.csv, survival.csv, survival.html."),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Everything as JSON on stdout.")] = False,
) -> None:
    """Table with intervals, survival with censored recordings, and the paper's onsets beside it."""
    from tsvision.jsonable import to_json
    from tsvision.timeline import many

    grouping = _grouping(by)
    found = many.measured_folders(folders)
    table = many.onset_table(found, phase.value)
    tables: dict[str, Any] = {
        "onsets": table,
        "medians": many.medians(table, grouping),
        "survival": many.survival(table, grouping),
        "dependence": many.dependence(table),
        "paper": many.against_paper(many.onset_table(found, "overtwist")),
    }
    difference = many.group_difference(table, grouping) if grouping else None
    if out is not None:
        _write(out, phase.value, tables)
    if as_json:
        rows = {name: one.astype(object).to_dict("records") for name, one in tables.items()}
        print(to_json(rows | {"difference": difference}), end="")
        return
    _print(phase.value, tables, difference, by)


def _grouping(by: str) -> str | None:
    from tsvision.errors import InputError

    choices = ("strings", "load_N", "string_diameter_mm")
    if by == "none":
        return None
    if by not in choices:
        raise InputError(f"--by '{by}' is unknown; choose one of {', '.join(choices)}, none")
    return by


def _print(
    phase: str, tables: dict[str, Any], difference: dict[str, float] | None, by: str
) -> None:
    def show(table: Any) -> str:
        return str(table.to_string(index=False, float_format=lambda v: f"{v:.4g}", na_rep="–"))

    print(f"{phase.replace('_', ' ')} onset, turns")
    print(show(tables["onsets"]))
    open_ones = int((tables["onsets"]["status"] == "undetermined").sum())
    if open_ones:
        print(f"{open_ones} undetermined: in no curve and no median below")
    if len(tables["medians"]):
        print(f"\nmedian by {by} (Kaplan–Meier; recordings that ended first are in as censored)")
        print(show(tables["medians"]))
    if difference:
        print(f"log-rank over {by}: chi² {difference['chi_square']:.2f}, p = {difference['p']:.3g}")
    if len(tables["dependence"]):
        print("\nonset ∝ x^exponent (Weibull, censoring in; one x at a time)")
        print(show(tables["dependence"]))
    if tables["paper"]["recordings"].notna().any():
        print("\novertwist onset beside the paper's table")
        print(show(tables["paper"]))


def _write(out: Path, phase: str, tables: dict[str, Any]) -> None:
    from tsvision.atomic import telling_what_failed, write_text
    from tsvision.timeline.curves import survival_page

    with telling_what_failed(out):
        out.mkdir(parents=True, exist_ok=True)
    for name in ("onsets", "medians", "survival", "paper"):
        write_text(out / f"{name}.csv", tables[name].to_csv(index=False))
    write_text(out / "survival.html", survival_page(tables["survival"], phase))
