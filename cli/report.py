"""`tsvision report DIR [DIR …]`: one page a recording, and one over many."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Annotated, Any

import typer

from tsvision.errors import InputError


def command(
    folders: Annotated[
        list[Path], typer.Argument(metavar="DIR...", help="Folders that `tsvision measure` wrote.")
    ],
    recording: Annotated[
        Path | None,
        typer.Option(help="The frames, or the folder they lie in; else looked for beside DIR."),
    ] = None,
    verdict: Annotated[
        Path | None, typer.Option(help="JSON of `tsvision diagnose` (one DIR only).")
    ] = None,
    video: Annotated[bool, typer.Option("--video", help="Also write overlay.mp4.")] = False,
    sheet: Annotated[bool, typer.Option("--sheet", help="Also write sheet.jpg.")] = False,
    viewer: Annotated[
        bool, typer.Option("--viewer", help="Also open it in Rerun (extra `viewer`).")
    ] = False,
    viewer_file: Annotated[
        bool, typer.Option("--viewer-file", help="Also write measured.rrd for Rerun.")
    ] = False,
    out: Annotated[
        Path | None, typer.Option(help="Page over many recordings (default: overview.html).")
    ] = None,
) -> None:
    """Write report.html into each measured folder; with several also one page over all.

    A DIR may also be a batch's --out: then each recording in it is meant.
    """
    from tsvision.report.page import write_report
    from tsvision.results.table import measured_below

    meant = [place for folder in folders for place in measured_below(folder).values() or [folder]]
    if len(meant) > 1 and verdict:
        raise InputError("--verdict goes with one DIR; give them one at a time")
    if len(meant) > 1 and recording and not recording.is_dir():
        raise InputError(f"{recording}: with several DIRs, name the folder that holds the films")
    answer = _read_verdict(verdict) if verdict else None
    done, problems = [], []
    for folder in meant:
        try:
            found = _recording(folder, recording, several=len(meant) > 1)
            print(write_report(folder, found, answer or _own_verdict(folder)))
            _more(folder, found, video, sheet, viewer, viewer_file)
            done.append(folder)
        except InputError as problem:
            if len(meant) == 1:
                raise
            problems.append(str(problem))
    if len(meant) > 1 and done:
        from tsvision.report.many import write_overview

        place = folders[0] if len(folders) == 1 else Path()
        print(write_overview(done, out or place / "overview.html"))
    if problems:
        raise InputError(f"{len(problems)} of {len(meant)} failed: {'; '.join(problems)}")


def _more(
    folder: Path, found: Any, video: bool, sheet: bool, viewer: bool, viewer_file: bool
) -> None:
    """What is made of the frames themselves."""
    if found is None and (video or sheet or viewer or viewer_file):
        raise InputError(f"{folder}: no frames to draw on; name them with --recording")
    if video:
        from tsvision.report.video import write_overlay_video

        print(write_overlay_video(folder, found))
    if sheet:
        from tsvision.report.sheet import write_sheet

        print(write_sheet(folder, found))
    if viewer_file:
        from tsvision.report.viewer import write_viewer_file

        print(write_viewer_file(folder, found))
    if viewer:
        from tsvision.report.viewer import open_viewer

        open_viewer(folder, found)


def _recording(folder: Path, given: Path | None, several: bool) -> Any:
    """The recording to take pictures from; None, with a word on stderr, when it is gone."""
    from tsvision.images.frames import open_pictures
    from tsvision.records import Camera, Rig
    from tsvision.report.measured import find_source, read_measured

    measured = read_measured(folder)
    inside = find_source(measured, given) if given else None
    source = inside or (None if several and given else given) or find_source(measured)
    if source is None:
        print(
            f"{folder}: the frames were not found, so the page has no pictures; "
            "name them with --recording",
            file=sys.stderr,
        )
        return None
    known = measured.summary.get("rig") or {}
    # What is drawn was found without the lens's distortion; turns and times are those that were
    # measured with, not what a table beside the frames says by now.
    rig = Rig(camera=Camera(lens=tuple(known.get("camera.lens") or ())))
    return open_pictures(source, rig, tuple(measured.frames["file"].astype(str)))


def _own_verdict(folder: Path) -> dict[str, Any] | None:
    path = folder / "verdict.json"
    return _read_verdict(path) if path.is_file() else None


def _read_verdict(path: Path) -> dict[str, Any]:
    try:
        value = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as problem:
        raise InputError(
            f"{path}: no verdict ({problem.__class__.__name__}); give the JSON that "
            "`tsvision diagnose --json` prints"
        ) from None
    if not isinstance(value, dict):
        raise InputError(f"{path}: a verdict is one JSON object; give `tsvision diagnose --json`'s")
    return value
