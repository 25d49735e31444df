"""`tsvision onset`: at which turn count knots (or another phase) begin."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Any

import typer

from cli.rig_options import with_rig_options

EXIT_CODES = {"observed": 0, "not_observed": 3, "undetermined": 4}


class Phase(StrEnum):
    """What may have an onset."""

    knot = "knot"
    overtwist = "overtwist"
    local_overtwist = "local_overtwist"
    irreversible = "irreversible"


@with_rig_options
def command(
    recording: str = typer.Argument(
        ..., help="Frames (folder, glob, TIFF, video), or a folder that `measure` wrote."
    ),
    phase: Phase = typer.Option(Phase.knot, "--phase", help="The beginning of which phase."),
    as_json: bool = typer.Option(False, "--json", help="The onset object alone on stdout."),
    turns: Path | None = typer.Option(None, "--turns", help="turns.csv, if not beside the frames."),
    turns_per_frame: float | None = typer.Option(None, help="Turns from frame to frame."),
    turns_from_name: str | None = typer.Option(None, help="Regular expression with one group."),
    rig_path: Path | None = None,
    overrides: dict[str, object] = {},  # noqa: B006 - read only
) -> None:
    """Print one line: the onset with its interval, or why there is none.

    Exit code 0: observed, 3: not observed (the recording ends first), 4: undetermined.
    """
    from tsvision.jsonable import to_json
    from tsvision.timeline.many import read_summary
    from tsvision.timeline.told import line

    told = (
        read_summary(Path(recording))
        if _is_measured(Path(recording))
        else _measure(recording, turns, turns_per_frame, turns_from_name, rig_path, overrides)
    )
    name = f"{phase.value}_onset"
    onset: Any = told[name]
    if as_json:
        print(to_json(onset), end="")
    else:
        print(line(name, told))
        for note in told.get("notes", []):
            typer.echo(f"note: {note}", err=True)
    raise typer.Exit(EXIT_CODES[onset["status"]])


def _is_measured(folder: Path) -> bool:
    return (folder / "summary.json").is_file() and (
        (folder / "frames.parquet").is_file() or (folder / "frames.csv").is_file()
    )


def _measure(
    source: str,
    turns: Path | None,
    turns_per_frame: float | None,
    turns_from_name: str | None,
    rig_path: Path | None,
    overrides: dict[str, object],
) -> dict[str, Any]:
    """Measure in memory; nothing is written."""

    from tsvision.images.frames import open_recording
    from tsvision.rig import find_rig, load_rig
    from tsvision.timeline.account import account
    from tsvision.timeline.tables import tables
    from tsvision.timeline.told import summary

    rig = load_rig(rig_path or find_rig(source), overrides)
    recording = open_recording(source, rig, turns, turns_per_frame, turns_from_name)

    from tsvision.timeline.steadily import measure_steadily  # heavy: after the input is known good

    frames, knots = tables(_with_progress(measure_steadily(recording), len(recording.files)))
    return summary(account(frames, knots, rig))


def _with_progress(results: Any, total: int) -> Any:
    """Pass results on, telling on stderr how far it is when someone watches."""
    import sys

    watched = sys.stderr.isatty()
    for number, result in enumerate(results, start=1):
        if watched:
            print(f"\rmeasured {number}/{total}", end="", file=sys.stderr)
        yield result
    if watched:
        print(file=sys.stderr)
