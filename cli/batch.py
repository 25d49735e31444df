"""`tsvision batch`: many recordings, resumable, on all cores or a cluster."""

from __future__ import annotations

from pathlib import Path

import typer

from cli.rig_options import with_rig_options


@with_rig_options
def command(
    source: str = typer.Argument(
        ..., help="manifest.csv (column `recording`), a folder of recordings, or a glob."
    ),
    out: Path = typer.Option(..., "--out", "-o", help="Folder of the results."),
    engine: str = typer.Option(
        "local", "--engine", help="local (processes), dask, or here (one by one)."
    ),
    scheduler: str | None = typer.Option(
        None, "--scheduler", help="For dask: tcp://HOST:8786. Workers must see the same paths."
    ),
    workers: int | None = typer.Option(None, "--workers", help="Local processes; default: cores."),
    chunk_frames: int = typer.Option(
        1000, "--chunk-frames", help="Frames a job, rounded up to whole thousands."
    ),
    turns_per_frame: float | None = typer.Option(
        None, "--turns-per-frame", help="Motor turns from one frame to the next."
    ),
    turns_from_name: str | None = typer.Option(
        None, "--turns-from-name", help="Regular expression with one group: turns in file names."
    ),
    diagnose: bool = typer.Option(
        False, "--diagnose", help="Also write verdict.json of each recording (its own rig)."
    ),
    as_json: bool = typer.Option(False, "--json", help="What became of each recording, as JSON."),
    quiet: bool = typer.Option(False, "--quiet", "-q", help="No progress on stderr."),
    rig_path: Path | None = None,
    overrides: dict[str, object] = {},  # noqa: B006 - never changed
) -> None:
    """Measure many recordings. Killed or stopped, the same command goes on where it was.

    A manifest may also have the columns name, rig, turns_file, turns_per_frame, turns_from_name,
    frames (A:B), and any key of rig.toml such as strings.count. Exit 1 when a recording failed.
    """
    import os

    from cli.progress import batch_progress
    from tsvision.batch import run_batch
    from tsvision.batch.plan import plan
    from tsvision.jsonable import to_json
    from tsvision.run import Request

    base = Request(
        "", rig_path, overrides, turns_per_frame=turns_per_frame, turns_from_name=turns_from_name
    )
    items = plan(source, base)
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    with batch_progress(quiet) as progress:
        report = run_batch(
            items,
            out,
            engine,
            workers or cores or 1,
            scheduler,
            chunk_frames,
            progress,
            finish=write_verdict if diagnose else None,
        )
    if as_json:
        typer.echo(to_json(report), nl=False)
    else:
        typer.echo(
            f"{len(items)} recordings: {len(report.done)} measured, {len(report.kept)} already "
            f"done, {len(report.failed)} failed; results in {out}"
        )
        for note in report.notes:
            typer.echo(f"note: {note}", err=True)
        for name, problem in report.failed.items():
            typer.echo(f"failed: {name}: {problem}", err=True)
    if report.failed:
        raise SystemExit(1)


def write_verdict(folder: Path) -> None:
    """verdict.json of a measured recording, unless it has one of these data by these sources;
    InputError when its data do not allow a diagnosis, and then none is left that was."""
    from contextlib import suppress

    from tsvision.atomic import write_text
    from tsvision.diagnosis.sources import diagnose_sources
    from tsvision.errors import InputError
    from tsvision.jsonable import to_json
    from tsvision.records import Rig
    from tsvision.results.overview import VERDICT, read_verdict
    from tsvision.results.read import read_summary
    from tsvision.results.summary import diagnosis_key

    key = diagnosis_key(read_summary(folder))
    with suppress(InputError):  # a damaged one is none
        if read_verdict(folder).get("key") == key:
            return
    (folder / VERDICT).unlink(missing_ok=True)
    verdict = diagnose_sources([folder], Rig())
    write_text(folder / VERDICT, to_json({**verdict.to_json(), "key": key}))
