"""`tsvision measure`: a recording to its output folder."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from cli.rig_options import with_rig_options

if TYPE_CHECKING:
    from tsvision.run import Request


@with_rig_options
def command(
    recording: list[str] = typer.Argument(
        ..., help="A folder of frames, a glob, a video, a multi-page TIFF, or pictures."
    ),
    out: Path | None = typer.Option(
        None, "--out", "-o", help="Folder to write; default NAME-measured here."
    ),
    overwrite: bool = typer.Option(False, "--overwrite", help="Replace an earlier measurement."),
    turns_file: Path | None = typer.Option(
        None, "--turns-file", help="Motor turns of each frame; default turns.csv beside the frames."
    ),
    turns_per_frame: float | None = typer.Option(
        None, "--turns-per-frame", help="Motor turns from one frame to the next; frame 0 is 0."
    ),
    turns_from_name: str | None = typer.Option(
        None, "--turns-from-name", help="Regular expression with one group: turns in file names."
    ),
    frames: str | None = typer.Option(None, "--frames", help="A:B measures frames A to B-1 only."),
    uncertainty_budget: bool = typer.Option(
        False, "--uncertainty-budget", help="Where each uncertainty comes from; writes budget.csv."
    ),
    video: bool = typer.Option(False, "--video", help="Also write overlay.mp4."),
    as_json: bool = typer.Option(False, "--json", help="Print summary.json on stdout."),
    quiet: bool = typer.Option(False, "--quiet", "-q", help="No progress on stderr."),
    rig_path: Path | None = None,
    overrides: dict[str, object] = {},  # noqa: B006 - never changed
) -> None:
    """Measure diameter, pitch, helix angle, knots and phases beside the separator.

    Writes frames, profiles, knots and summary.json to --out, whole or not at all.
    """
    from cli.progress import frame_progress
    from tsvision.jsonable import to_json
    from tsvision.results.read import read_summary
    from tsvision.run import Request, measure_to_folder

    source: Any = recording[0] if len(recording) == 1 else recording
    part = parse_range(frames)
    name = recording_name(recording)
    out = Path(f"{name}-measured") if out is None else out
    with frame_progress(name, quiet) as progress:
        measure_to_folder(
            source,
            out,
            rig_path,
            overrides,
            overwrite,
            turns_file,
            turns_per_frame,
            turns_from_name,
            part,
            progress,
            uncertainty_budget=uncertainty_budget,
        )
    summary = read_summary(out)
    if video:
        given = (turns_file, turns_per_frame, turns_from_name)
        _write_video(out, Request(source, rig_path, overrides, *given, frames=part))
    if as_json:
        typer.echo(to_json(summary), nl=False)
        return
    for note in summary["notes"]:
        typer.echo(f"{name}: {note}", err=True)
    typer.echo(describe(name, summary))
    if uncertainty_budget:
        typer.echo(budget_in_words(out))
    typer.echo(f"written to {out}")


def _write_video(out: Path, request: Request) -> None:
    """The overlay on the pictures as they were measured: under the same rig, lens and all."""
    from tsvision.report.video import write_overlay_video
    from tsvision.run import open_request

    recording, _ = open_request(request)
    typer.echo(write_overlay_video(out, recording), err=True)


def recording_name(sources: list[str]) -> str:
    """A short name for a recording: its folder's or file's, without the ending."""
    first = Path(sources[0])
    if len(sources) == 1 and first.is_dir():
        return first.resolve().name or "recording"
    if len(sources) == 1 and first.is_file():
        return first.stem
    return Path(os.path.abspath(first)).parent.name or "recording"  # which follows no links


def parse_range(text: str | None) -> tuple[int, int | None] | None:
    """`A:B`, `A:` or `:B` to (A, B or None)."""
    from tsvision.errors import InputError

    if text is None:
        return None
    try:
        start, stop = text.split(":")
        return (int(start) if start else 0), (int(stop) if stop else None)
    except ValueError:
        raise InputError(f"--frames {text!r}: write A:B, such as 0:100 or 50:") from None


def describe(name: str, summary: dict[str, Any]) -> str:
    """A few lines for people."""
    lines = [
        f"{name}: {summary['frames_total']} frames, {summary['frames_measured']} measured, "
        f"{summary['frames_flagged']} flagged"
    ]
    from tsvision.timeline.constancy import constancy_in_words

    unit = "mm" if summary["diameter_mm"]["value"] is not None else "px"
    diameter, angle = summary[f"diameter_{unit}"], summary["helix_angle_deg"]
    if diameter["value"] is not None:
        lines.append(f"bundle diameter beside the separator {_with_sd(diameter)} {unit}")
    if "NO_SCALE" in summary["flags"]:
        lines.append("no scale is known, so no millimetres: give --mm-per-px or --scale-from")
    if angle["value"] is not None:
        hand = f", {summary['handedness']} laid" if summary["handedness"] else ""
        lines.append(f"helix angle {_with_sd(angle)} degrees ({angle['over']}){hand}")
    lines += [
        f"{key.removesuffix('_onset').replace('_', ' ')}: {_onset_in_words(summary[key])}"
        for key in ("overtwist_onset", "local_overtwist_onset", "knot_onset", "irreversible_onset")
        if key in summary
    ]
    lines += constancy_in_words(summary.get("near_separator", {}))
    return "\n".join(lines)


def budget_in_words(out: Path) -> str:
    """The typical frame's uncertainty by source."""
    import pandas as pd

    from tsvision.results.budget import typical_budget

    typical = typical_budget(pd.read_csv(out / "budget.csv"))
    lines = ["where the uncertainty of the typical frame comes from:"]
    for row in typical.itertuples():
        lines.append(
            f"  {row.quantity} {row.value:.4g} {row.unit}: {row.source} ± {row.sd:.2g} {row.unit} "
            f"({row.share_percent:.0f} % of the variance)"
        )
    return "\n".join(lines)


def _with_sd(quantity: dict[str, Any]) -> str:
    value, sd = quantity["value"], quantity["sd"]
    return f"{value:.4g}" if not sd else f"{value:.5g} ± {sd:.2g}"


def _onset_in_words(onset: dict[str, Any]) -> str:
    last = "" if onset["last_turns"] is None else f" up to {onset['last_turns']:g} turns"
    if onset["status"] == "observed":
        low, high = onset["low"], onset["high"]
        between = "" if low is None or high is None else f" ({low:.4g} to {high:.4g})"
        return f"from {onset['turns']:.4g} turns{between}"
    return f"none seen{last}" if onset["status"] == "not_observed" else f"undetermined{last}"
