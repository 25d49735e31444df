"""Measuring a recording whose camera was bumped: stretch by stretch, each with its own view.

What stands still (plate, connector, axis) is learnt once a recording. After a bump that knowledge
is wrong, and numbers read with it are wrong without a sign. So a few pictures spread over the
recording are compared first; where the scene moved between two of them, the very frame is found by
bisection, and what lies before and after it is measured as recordings of their own.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise

from tsvision.flags import Flag, flags_from_text, flags_to_text
from tsvision.images.frames import iter_frames, part_of
from tsvision.images.steadiness import Edges, edges_of, shift_px
from tsvision.measures.recording import measure_frames
from tsvision.records import FrameResult, Recording

SAMPLES = 9
LEAST_FRAMES = 3  # a shorter stretch cannot be learnt from, and is left with its neighbour


def measure_steadily(
    recording: Recording, start: int = 0, stop: int | None = None
) -> Iterator[FrameResult]:
    """Results of the frames start..stop-1 in order, as `measure_frames` gives them; the first
    frame after each move of the camera carries CAMERA_MOVED."""
    total = len(recording.files)
    stop = total if stop is None else min(stop, total)
    cuts = [0, *moves(recording), total]
    for first, end in pairwise(cuts):
        low, high = max(start, first), min(stop, end)
        if low >= high:
            continue
        alone = recording if end - first == total else part_of(recording, first, end)
        for result in measure_frames(alone, start=low - first, stop=high - first):
            yield _placed(result, first, moved=first > 0 and result.row.frame == 0)


def _placed(result: FrameResult, first: int, moved: bool) -> FrameResult:
    row = replace(result.row, frame=result.row.frame + first)
    if moved:
        flags = flags_from_text(row.flags) | Flag.CAMERA_MOVED
        row = replace(row, flags=flags_to_text(flags))
    return replace(result, row=row)


def moves(recording: Recording) -> list[int]:
    """First frame after each move of the camera, in order; none in a steady recording."""
    total = len(recording.files)
    if total < 2 * LEAST_FRAMES:
        return []
    known: dict[int, Edges | None] = {}
    marks = sorted({round(k * (total - 1) / (SAMPLES - 1)) for k in range(SAMPLES)})
    marks = [i for i in marks if _edges(recording, i, known) is not None]
    found: list[int] = []
    for before, after in pairwise(marks):
        found += _bisect(recording, before, after, known)
    edges = [0, *found, total]
    return [m for k, m in enumerate(found, 1) if _long_enough(edges, k)]


def _long_enough(edges: list[int], k: int) -> bool:
    return min(edges[k] - edges[k - 1], edges[k + 1] - edges[k]) >= LEAST_FRAMES


def _bisect(
    recording: Recording, before: int, after: int, known: dict[int, Edges | None]
) -> list[int]:
    """The frames between two marks at which the scene moved for good (none or one)."""
    if not _moved(recording, before, after, known):
        return []
    low, high = before, after
    while (middle := _readable_between(recording, low, high, known)) is not None:
        if _moved(recording, low, middle, known):
            high = middle
        else:
            low = middle
    return [high]


def _readable_between(
    recording: Recording, low: int, high: int, known: dict[int, Edges | None]
) -> int | None:
    """The readable frame nearest to the middle of two; None if none lies between them."""
    inside = sorted(range(low + 1, high), key=lambda i: abs(2 * i - low - high))
    return next((i for i in inside if _edges(recording, i, known) is not None), None)


def _moved(recording: Recording, a: int, b: int, known: dict[int, Edges | None]) -> bool:
    before, after = _edges(recording, a, known), _edges(recording, b, known)
    return before is not None and after is not None and shift_px(before, after) != (0.0, 0.0)


def _edges(recording: Recording, index: int, known: dict[int, Edges | None]) -> Edges | None:
    if index not in known:
        known[index] = None
        for frame in iter_frames(recording, index, index + 1):
            if frame.pixels is not None:
                known[index] = edges_of(frame.pixels)
    return known[index]
