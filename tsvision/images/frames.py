"""A recording from a folder, a glob, a list of pictures, a multi-page TIFF or a video.

`open_recording` finds the frames and what is known of each; `iter_frames` decodes them, one at a
time, in order. A picture that cannot be decoded keeps its place with `pixels=None`.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from tsvision.errors import InputError
from tsvision.images.frames_ahead import ahead as decode_ahead
from tsvision.images.frames_find import Found, find_frames
from tsvision.images.frames_picture import Unreadable, read_picture, split_page
from tsvision.images.frames_video import index_video, iter_video
from tsvision.images.turns import TurnColumns, beside, names_in, read_turns
from tsvision.records import Frame, Recording, Rig


def open_recording(
    source: str | Path | Sequence[str | Path],
    rig: Rig = Rig(),
    turns_file: str | Path | None = None,
    turns_per_frame: float | None = None,
    turns_from_name: str | None = None,
) -> Recording:
    """Find the frames of `source` and the motor turns of each.

    No picture is decoded here, unless the scale is to be taken from a board or a ruler in them.

    Turns come from `turns_file`, else a `turns.csv` beside the frames; `turns_per_frame` (turns
    are that times the frame's number) or `turns_from_name` (a regular expression with one group)
    win: a table that only happens to lie beside is then left out, a named one gives the rest of
    its columns. Raises InputError on an empty source and on turns that are ambiguous.
    """
    chosen = turns_per_frame is not None or turns_from_name is not None
    table = Path(turns_file) if turns_file is not None else None
    if table is None and not chosen:
        table = beside(_first(source))
    found = find_frames(source, names_in(table) if table is not None else None)
    if table is None and not chosen:
        table = beside(found.source)
    files, time_s = _named(found)
    columns = read_turns(
        table, files, turns_per_frame, turns_from_name, single=_is_single(source, found)
    )
    if time_s is not None and not np.isfinite(columns.time_s).any():
        columns = replace(columns, time_s=time_s)
    recording = _recording(found, files, columns, rig)
    if rig.camera.scale_from in ("charuco", "ruler") and math.isnan(rig.camera.mm_per_px):
        from tsvision.images.calibration_recording import with_scale_from_pictures

        return with_scale_from_pictures(recording, iter_frames(recording, ahead=0))
    return recording


def open_pictures(source: Path, rig: Rig, names: Iterable[str]) -> Recording:
    """The frames of `source` alone, whatever table lies beside them: turns and the like are NaN.

    `names` are those of the files that are meant, where a folder holds frames in several formats.
    Raises InputError on an empty source.
    """
    found = find_frames(source, names)
    files, _ = _named(found)
    return _recording(found, files, read_turns(None, files), rig)


def _named(found: Found) -> tuple[tuple[str, ...], np.ndarray | None]:
    """A name for each frame, and the times that a video tells."""
    if found.kind != "video":
        return found.files, None
    index = index_video(found.source)
    return tuple(f"{found.source.name}#{i}" for i in range(index.count)), index.time_s


def _recording(found: Found, files: tuple[str, ...], columns: TurnColumns, rig: Rig) -> Recording:
    return Recording(
        source=found.source,
        kind=found.kind,
        files=files,
        turns=columns.turns,
        time_s=columns.time_s,
        displacement_mm=columns.displacement_mm,
        load_N=columns.load_N,
        cycle=columns.cycle,
        rig=rig,
        notes=found.notes + columns.notes,
    )


def iter_frames(
    recording: Recording,
    start: int = 0,
    stop: int | None = None,
    color: bool = True,
    ahead: int = 3,
    threads: int = 0,
) -> Iterator[Frame]:
    """Frames start..stop-1 in order, each file one Frame, `index` counted from the recording's
    first frame.

    `color=False` gives luma only (the Y plane of a video, taken as it is, which is the fastest).
    `ahead` frames are decoded in advance in a thread (0: none); `threads` is the video decoder's
    own number of threads (0: its choice). Undecodable frames come with `pixels=None`. Where the
    rig knows the lens, frames come undistorted.
    """
    total = len(recording.files)
    stop = total if stop is None else min(stop, total)
    if not 0 <= start <= stop:
        raise InputError(f"frames {start}:{stop}: outside the recording's {total} frames")

    def make() -> Iterator[Frame]:
        if recording.kind == "video":
            found = iter_video(recording.source, recording.files, start, stop, color, threads)
        else:
            found = _iter_pictures(recording, start, stop, color)
        if not recording.rig.camera.lens:
            return found
        from tsvision.images.calibration_recording import undistorted  # scipy loads slowly

        return undistorted(found, recording.rig.camera.lens)

    yield from decode_ahead(make, ahead)


def part_of(recording: Recording, start: int, stop: int) -> Recording:
    """Frames start..stop-1 as a recording of their own; its frames count from 0 again."""
    cut = slice(start, stop)
    return replace(
        recording,
        files=recording.files[cut],
        turns=recording.turns[cut],
        time_s=recording.time_s[cut],
        displacement_mm=recording.displacement_mm[cut],
        load_N=recording.load_N[cut],
        cycle=recording.cycle[cut],
    )


def path_of(recording: Recording, index: int) -> Path:
    """The file that holds a frame."""
    if recording.kind != "folder":
        return recording.source
    return recording.source / split_page(recording.files[index])[0]


def input_files(recording: Recording) -> tuple[Path, ...]:
    """Every file that the frames come from, each once, in order."""
    return tuple(dict.fromkeys(path_of(recording, i) for i in range(len(recording.files))))


def _iter_pictures(recording: Recording, start: int, stop: int, color: bool) -> Iterator[Frame]:
    for index in range(start, stop):
        name = recording.files[index]
        try:
            pixels = read_picture(path_of(recording, index), split_page(name)[1], color)
        except Unreadable as problem:
            yield Frame(index, name, None, str(problem))
        else:
            yield Frame(index, name, pixels)


def _first(source: str | Path | Sequence[str | Path]) -> Path:
    if isinstance(source, str | Path):
        return Path(source)
    if not source:
        raise InputError("no file was named; name a folder, a glob, a video or pictures")
    return Path(source[0])


def _is_single(source: object, found: Found) -> bool:
    """Whether one picture was named out of a folder whose table may speak of all its pictures."""
    return found.kind == "folder" and len(found.files) == 1 and not Path(str(source)).is_dir()
