"""One picture on which the program fails must not cost the film: its row stays, flagged FAILED."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator

import numpy as np

from tsvision.errors import InputError
from tsvision.flags import Flag, flags_to_text
from tsvision.records import FrameResult, FrameRow, Recording

Measure = Callable[[Recording, int, int], Iterator[FrameResult]]  # frames start..stop-1
_LOG = logging.getLogger("tsvision")
_IN_A_ROW = 3  # a program that fails on every picture is broken, and says so


def without_losing_rows(measure: Measure) -> Measure:
    """`measure` that goes on behind a frame on which it fails; such a frame is empty, and the
    error is logged. The third failure in a row is raised, as is every error that is not about a
    picture: bad input, the disk, memory."""

    def guarded(recording: Recording, start: int, stop: int) -> Iterator[FrameResult]:
        at, failures = start, 0
        while at < stop:
            try:
                for result in measure(recording, at, stop):
                    yield result
                    at, failures = result.row.frame + 1, 0
                return
            except (InputError, OSError, MemoryError):
                raise
            except Exception as error:
                failures += 1
                if failures == _IN_A_ROW:
                    raise
                reason = " ".join(str(error).split())[:200]
                _LOG.warning("frame %d: %s: %s", at, type(error).__name__, reason)
                yield _empty(recording, at)
                at += 1

    return guarded


def _empty(recording: Recording, index: int) -> FrameResult:
    turns = float(recording.turns[index])
    flags = Flag.FAILED if np.isfinite(turns) else Flag.FAILED | Flag.NO_TURNS
    row = FrameRow(
        frame=index,
        file=recording.files[index],
        turns=turns,
        time_s=float(recording.time_s[index]),
        displacement_mm=float(recording.displacement_mm[index]),
        load_N=float(recording.load_N[index]),
        cycle=float(recording.cycle[index]),
        flags=flags_to_text(flags),
    )
    return FrameResult(row)
