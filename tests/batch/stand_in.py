"""Stands in for the measuring of frames in worker processes, which import it by this name."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from tsvision.images.frames import iter_frames
from tsvision.records import FrameResult, FrameRow, KnotSighting, Profile, Recording

SLOWLY_S = 0.0005


def measure(recording: Recording, start: int, stop: int) -> Iterator[FrameResult]:
    """The mean grey level as a diameter; a profile and a knot now and then."""
    for frame in iter_frames(recording, start, stop, color=False):
        turns = float(recording.turns[frame.index])
        if frame.pixels is None:
            yield FrameResult(FrameRow(frame.index, frame.file, turns, flags="UNREADABLE"))
            continue
        level = float(frame.pixels.mean())
        row = FrameRow(
            frame.index, frame.file, turns, diameter_px=level, diameter_px_sd=0.1, diameter_mm=level
        )
        edge = frame.pixels[0].astype(float)
        profile = Profile(edge, edge, edge, -edge, np.full(len(edge), np.nan), edge)
        knots = (KnotSighting(level, 1.0, 2.0, level, 0.0),) if frame.index % 7 == 3 else ()
        yield FrameResult(row, profile, knots)


def measure_slowly(recording: Recording, start: int, stop: int) -> Iterator[FrameResult]:
    """The same numbers, with time to be killed in."""
    for result in measure(recording, start, stop):
        time.sleep(SLOWLY_S)
        yield result


def measure_held(recording: Recording, start: int, stop: int) -> Iterator[FrameResult]:
    """The second segment of a recording is not begun before it is released."""
    release = Path(os.environ["STAND_IN_RELEASE"])
    while start > 0 and not release.exists():
        time.sleep(0.01)
    yield from measure(recording, start, stop)


def measure_and_die_once(recording: Recording, start: int, stop: int) -> Iterator[FrameResult]:
    """The first process that measures this recording is killed midway."""
    mark = Path(os.environ["STAND_IN_MARK"])
    for i, result in enumerate(measure(recording, start, stop)):
        if i == 5 and not mark.exists() and recording.source.name == "film1":
            mark.touch()
            os.kill(os.getpid(), signal.SIGKILL)
        yield result


def measure_and_die_once_or_always(
    recording: Recording, start: int, stop: int
) -> Iterator[FrameResult]:
    """Every process that measures film2 dies, the first that measures film1 too."""
    if recording.source.name == "film2":
        os.kill(os.getpid(), signal.SIGKILL)
    yield from measure_and_die_once(recording, start, stop)


def measure_with_a_bug(recording: Recording, start: int, stop: int) -> Iterator[FrameResult]:
    """film1 meets a bug."""
    if recording.source.name == "film1":
        raise ZeroDivisionError("a bug\nin two lines")
    yield from measure(recording, start, stop)


def measure_forever(recording: Recording, start: int, stop: int) -> Iterator[FrameResult]:
    """Never ends."""
    for result in measure(recording, start, stop):
        yield result
        time.sleep(0.05 if result.row.frame < 3 else 1000)


def measure_b_forever(recording: Recording, start: int, stop: int) -> Iterator[FrameResult]:
    """Recording `b` never ends."""
    slow = recording.source.name == "b"
    yield from (measure_forever if slow else measure)(recording, start, stop)
