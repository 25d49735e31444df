"""One recording from its files to its output folder.

open → measure frame by frame → account → tables and summary, written beside and renamed. Frames
stream through: memory holds one picture, a row group of profiles and the rows.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import pandas as pd

from tsvision.atomic import write_text
from tsvision.errors import InputError
from tsvision.images.frames import input_files, open_recording, part_of
from tsvision.jsonable import to_json
from tsvision.records import FrameResult, Recording
from tsvision.results.budget import write_budget
from tsvision.results.files import MEASUREMENT, PROFILES, SUMMARY
from tsvision.results.read import read_table
from tsvision.results.summary import make_summary, sha256_of
from tsvision.results.tables import (
    KnotCollector,
    ProfileWriter,
    RowCollector,
    write_frames,
    write_knots,
)
from tsvision.results.unread import unread
from tsvision.rig import find_rig, load_rig
from tsvision.run_guard import Measure, without_losing_rows
from tsvision.staging import check_out, staged

_BYTES_A_FRAME = 40_000  # profiles of a 1920 px wide picture, compressed
SEGMENT_FRAMES = 1000
"""Measuring starts afresh at each multiple of this, in one go as in chunks on many machines, so
that both give the same bytes."""
Progress = Callable[[int, int], None]  # frames done, frames in all


@dataclass(frozen=True)
class Request:
    """What to measure and with which words about it; the same for one recording or a batch."""

    source: str | Path | Sequence[str | Path]
    rig_path: Path | None = None
    overrides: Mapping[str, object] | None = None
    turns_file: Path | None = None
    turns_per_frame: float | None = None
    turns_from_name: str | None = None
    frames: tuple[int, int | None] | None = None


def measure_to_folder(
    source: str | Path | Sequence[str | Path],
    out: Path,
    rig_path: Path | None = None,
    overrides: Mapping[str, object] = {},
    overwrite: bool = False,
    turns_file: Path | None = None,
    turns_per_frame: float | None = None,
    turns_from_name: str | None = None,
    frames: tuple[int, int | None] | None = None,
    progress: Progress | None = None,
    measure: Measure | None = None,
    uncertainty_budget: bool = False,
) -> Path:
    """Measure a recording into the folder `out` and return it.

    `frames` = (A, B) measures frames A..B-1 only. `rig_path` None takes the rig.toml beside the
    recording. `measure` replaces the measuring of frames (for tests). `uncertainty_budget` adds
    budget.csv. Raises InputError before any work when the input is not usable or `out` cannot be
    written.
    """
    out = Path(out)
    request = Request(
        source, rig_path, overrides, turns_file, turns_per_frame, turns_from_name, frames
    )
    recording, first = open_request(request)
    check_out(out, MEASUREMENT, overwrite, need_bytes=_BYTES_A_FRAME * len(recording.files))
    with staged(out, MEASUREMENT) as folder:
        write_measurement(folder, recording, measure or measuring(), first, progress)
        if uncertainty_budget:
            write_budget(folder, read_table(folder / "frames.parquet"))
    return out


def measuring() -> Measure:
    """The measuring of frames, imported only when it is needed."""
    from tsvision.timeline.steadily import measure_steadily

    return measure_steadily


def open_request(request: Request) -> tuple[Recording, int]:
    """The recording that is meant, cut to the frames asked for, and the number of its first."""
    rig = load_rig(_rig_path(request), request.overrides or {})
    recording = open_recording(
        request.source,
        rig,
        request.turns_file,
        request.turns_per_frame,
        request.turns_from_name,
    )
    if request.frames is None:
        return recording, 0
    start, stop = request.frames
    stop = len(recording.files) if stop is None else stop
    if not 0 <= start < stop <= len(recording.files):
        raise InputError(
            f"--frames {start}:{stop}: outside the recording's frames 0:{len(recording.files)}"
        )
    return part_of(recording, start, stop), start


def _rig_path(request: Request) -> Path | None:
    if request.rig_path is not None:
        return request.rig_path
    source = request.source
    return find_rig(source if isinstance(source, str | Path) else source[0]) if source else None


def segments(count: int) -> list[tuple[int, int]]:
    """(start, stop) of the stretches that are measured one by one."""
    return [(a, min(a + SEGMENT_FRAMES, count)) for a in range(0, count, SEGMENT_FRAMES)]


def write_measurement(
    folder: Path,
    recording: Recording,
    measure: Measure,
    first: int = 0,
    progress: Progress | None = None,
) -> None:
    """Everything a measured recording leaves in `folder`. `first` is added to frame numbers."""
    digests = Digests(input_files(recording))
    total = len(recording.files)
    with Stretch(folder / PROFILES, first) as stretch:
        for start, stop in segments(total):
            results = without_losing_rows(measure)(recording, start, stop)
            for done, result in enumerate(results, start=start + 1):
                stretch.add(result)
                if progress is not None:
                    progress(done, total)
            stretch.end_segment()
    frames, knots = stretch.tables()
    write_tables(folder, recording, frames, knots, digests.get(), first)


class Stretch:
    """What the frames of a recording, or of a part of it, have given so far."""

    def __init__(self, profiles: Path, first: int = 0) -> None:
        self._rows, self._sightings = RowCollector(), KnotCollector()
        self._profiles = ProfileWriter(profiles)
        self._first = first

    def __enter__(self) -> Stretch:
        return self

    def __exit__(self, kind: object, *problem: object) -> None:
        if kind is None:
            self._profiles.close()
        else:
            self._profiles.abandon()

    def add(self, result: FrameResult) -> None:
        """Take up one frame."""
        row = replace(result.row, frame=result.row.frame + self._first)
        self._rows.add(row)
        self._sightings.add(row, result.sightings)
        if result.profile is not None:
            self._profiles.add(row.frame, result.profile)

    def end_segment(self) -> None:
        """Close the row group, so that a segment's profiles do not depend on its neighbours."""
        self._profiles.end_group()

    def tables(self) -> tuple[pd.DataFrame, pd.DataFrame]:
        """Rows and sightings."""
        return self._rows.table(), self._sightings.table()


def write_tables(
    folder: Path,
    recording: Recording,
    frames: pd.DataFrame,
    knots: pd.DataFrame,
    digests: Mapping[Path, str],
    first: int = 0,
) -> None:
    """The account of what was measured, the tables and the summary."""
    from tsvision.timeline.account import account
    from tsvision.timeline.scatter import with_scatter

    if len(frames) != len(recording.files):
        raise RuntimeError(f"{len(recording.files)} frames gave {len(frames)} rows")
    notes = unread(recording, frames)
    told = account(frames, knots, recording.rig)
    rows = with_scatter(told.frames)
    write_frames(folder, rows)
    write_knots(folder, told.knots)
    more: dict[str, Any] = {"onset_reasons": told.reasons, **told.extras}
    summary = make_summary(recording, rows, told.onsets, digests, more, first)
    summary["notes"] = [*recording.notes, *notes, *told.notes]
    write_text(folder / SUMMARY, to_json(summary))


class Digests:
    """sha256 of the input files, computed beside the measuring (the hash lets others run)."""

    def __init__(self, paths: Sequence[Path]) -> None:
        self._found: dict[Path, str] = {}
        self._paths = paths
        self._thread = threading.Thread(target=self._work, name="sha256", daemon=True)
        self._thread.start()

    def _work(self) -> None:
        for path in self._paths:
            self._found[path] = sha256_of(path)

    def get(self) -> dict[Path, str]:
        """Wait for the rest; the digests in the files' order."""
        self._thread.join()
        return self._found
