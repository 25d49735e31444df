"""`tsvision diagnose DATA`: what the model gets wrong, why, and what mending it gains."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Annotated

import typer


def command(
    data: Annotated[
        list[Path],
        typer.Argument(metavar="DATA...", help="A CSV, or folders that `tsvision measure` wrote."),
    ],
    rig: Annotated[Path | None, typer.Option("--rig", help="rig.toml for what DATA lacks.")] = None,
    model: Annotated[
        str | None,
        typer.Option(
            "--model",
            "-m",
            help="The model that is questioned: constant_radius (the default), variable_radius or"
            " separator_no_offset; of a table of diameters against N the section, pair_core (the"
            " default) or ring.",
        ),
    ] = None,
    out: Annotated[
        Path | None, typer.Option("--out", help="Also write the JSON here (predict can use it).")
    ] = None,
    page: Annotated[
        Path | None,
        typer.Option("--page", help="Also write a page: residuals, signatures, evidence, gain."),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="JSON on stdout.")] = False,
    pictures: Annotated[
        Path | None,
        typer.Option(
            "--pictures",
            help="Instead: frames beside the renderer's best reconstruction, written to this folder"
            " (needs --recording).",
        ),
    ] = None,
    recording: Annotated[
        Path | None, typer.Option("--recording", help="The recording that DATA was measured from.")
    ] = None,
    frame: Annotated[
        list[int] | None, typer.Option("--frame", help="Which frame; may be repeated.")
    ] = None,
) -> None:
    """Name what the model gets wrong about measured data, or say that it cannot be told.

    Status: explained, ambiguous (a class that the data cannot part), unexplained, no_discrepancy.
    """
    # Small matrices: threads only wait for each other. Has no effect once NumPy is loaded.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    if pictures is not None:
        _show_pictures(data, recording, pictures, frame or [])
        return
    from tsvision.atomic import check_place, write_text
    from tsvision.diagnosis.sources import diagnose_sources
    from tsvision.jsonable import to_json
    from tsvision.records import Rig

    known = Rig()
    if rig is not None:
        from tsvision.rig import load_rig

        known = load_rig(rig)
    for place in (out, page):
        if place is not None:
            check_place(place)
    verdict = diagnose_sources(data, known, model)
    for note in verdict.notes:
        print(f"note: {note}", file=sys.stderr)
    answer = verdict.to_json()
    if out is not None:
        write_text(out, to_json(answer))
        print(f"verdict: {out}", file=sys.stderr)
    if page is not None:
        from tsvision.diagnosis.page import page as page_of

        write_text(page, page_of(answer))
        print(f"page: {page}", file=sys.stderr)
    if as_json:
        print(to_json(answer), end="")
        return
    print(f"{verdict.status.replace('_', ' ')}\n\n{verdict.paragraph}\n")
    for item in verdict.evidence[:8]:
        print(f"  {' + '.join(item['causes']):<45} log evidence gain {item['log_evidence_gain']:g}")


def _show_pictures(data: list[Path], recording: Path | None, out: Path, frames: list[int]) -> None:
    from tsvision.errors import InputError

    if recording is None or len(data) != 1:
        raise InputError("--pictures takes one measured folder and its --recording")
    from cli.side_by_side import side_by_side, told

    for shown in side_by_side(data[0], recording, out, frames):
        print(told(shown))
        print(f"  {shown.file}", file=sys.stderr)
    print(out / "reconstruction.csv")
