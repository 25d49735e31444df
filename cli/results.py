"""`tsvision results`: one table over the recordings of a batch."""

from __future__ import annotations

from pathlib import Path

import typer

_SHORT = (
    "recording, strings, load_N, round(diameter_mm, 4) as diameter_mm, "
    "round(helix_angle_deg, 2) as helix_angle_deg, handedness, knot_status, knot_turns, "
    "knot_turns_low, knot_turns_high, knot_last_turns, verdict, causes, rmse_base_mm, "
    "frames_measured, frames_flagged, flags"
)


def command(
    folder: Path = typer.Argument(..., help="A batch's --out, or a folder of measurements."),
    query: str | None = typer.Option(
        None,
        "--sql",
        help="DuckDB SQL over the views recordings, frames, profiles, knots.",
    ),
    as_json: bool = typer.Option(False, "--json", help="All columns as JSON, one object a row."),
    as_csv: bool = typer.Option(False, "--csv", help="CSV on stdout (all columns)."),
) -> None:
    """One row a recording: N, load, D, angle, onsets, what was flagged."""
    from tsvision.jsonable import to_json
    from tsvision.results.table import query_results

    wide = as_json or as_csv
    sql = query or f"select {'*' if wide else _SHORT} from recordings order by recording"
    table = query_results(folder, sql)
    if as_json:
        typer.echo(to_json(table.to_pylist()), nl=False)
    elif as_csv:
        typer.echo(table.to_pandas().to_csv(index=False, lineterminator="\n"), nl=False)
    else:
        shown = table.to_pandas().astype(object)
        shown = shown.where(shown.notna(), "-")
        typer.echo(shown.to_string(index=False) if len(shown) else "no rows")
