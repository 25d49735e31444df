"""`tsvision demo`: render a recording, measure it, say where knots begin, write the report."""

from __future__ import annotations

import json
import time
from pathlib import Path
from typing import Any

import typer

TURNS = "0:68:1"
SEED = 7


def command(
    out: Path = typer.Option(Path("demo"), "--out", "-o", help="Folder to write."),
    overwrite: bool = typer.Option(False, "--overwrite", help="Replace an earlier demo."),
    quiet: bool = typer.Option(False, "--quiet", "-q", help="No progress on stderr."),
) -> None:
    """Render two strings from 0 to 68 turns, measure the frames, compare with the truth.

    Writes OUT/recording (frames and truth) and OUT/measured (tables and report.html).
    """
    from tsvision.errors import InputError

    started = time.monotonic()
    if out.exists() and not overwrite:
        raise InputError(f"{out} exists; choose another folder or give --overwrite")
    _refuse_foreign(out, overwrite)
    recording = _render(out / "recording", overwrite, quiet)
    measured = _measure(recording, out / "measured", overwrite, quiet)
    page = _report(measured, recording)
    _tell(recording, measured)
    print(f"report: {page}")
    print(f"done in {time.monotonic() - started:.0f} s")


def _refuse_foreign(out: Path, overwrite: bool) -> None:
    """Before any work: only what an earlier demo wrote is replaced."""
    from synth.recording import RECORDING
    from tsvision.results.files import MEASUREMENT
    from tsvision.staging import check_out

    check_out(out / "recording", RECORDING, overwrite)
    check_out(out / "measured", MEASUREMENT, overwrite)


def _render(folder: Path, overwrite: bool, quiet: bool) -> Path:
    from cli.progress import frame_progress
    from synth.build import make_settings, parse_turns
    from synth.recording import write_recording

    settings = make_settings(parse_turns(TURNS), "bench", SEED, "bright_on_dark")
    with frame_progress("rendering", quiet) as progress:
        return write_recording(folder, settings, overwrite, progress)


def _measure(recording: Path, folder: Path, overwrite: bool, quiet: bool) -> Path:
    from cli.progress import frame_progress
    from tsvision.run import measure_to_folder

    with frame_progress("measuring", quiet) as progress:
        return measure_to_folder(recording, folder, overwrite=overwrite, progress=progress)


def _report(measured: Path, recording: Path) -> Path:
    from tsvision.images.frames import open_recording
    from tsvision.report.page import write_report
    from tsvision.rig import load_rig

    rig = load_rig(recording / "rig.toml")
    return write_report(measured, open_recording(recording, rig))


def _tell(recording: Path, measured: Path) -> None:
    """The measured onset beside the rendered one."""
    found: dict[str, Any] = json.loads((measured / "summary.json").read_text())["knot_onset"]
    truth: dict[str, Any] = json.loads((recording / "truth.json").read_text())["onsets"][
        "knot_onset"
    ]
    if found["status"] == "observed":
        print(
            f"knots begin at {found['turns']:g} turns "
            f"({found['level']:.0%} interval {found['low']:.4g} to {found['high']:.4g})"
        )
    else:
        print(f"knot onset: {found['status']} up to {found['last_turns']:g} turns")
    print(
        f"rendered truth: first frame with a knot at {truth['turns']:g} turns "
        f"(exactly at {truth['exact_turns']:.2f})"
    )


__all__ = ["command"]
