"""Learning what a live view looks like while the frames come.

A finished recording is sampled from end to end before the first frame is measured. Live, the first
picture is all there is, and at zero turns it shows no bundle yet. So the looks are learnt anew as
pictures with more turns come in, until the twist is seen frame after frame; then they stand, the
pictures so far are measured again with them, and only from then on may anything be decided. When
the camera is bumped, learning starts over.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import Protocol

import numpy as np

from tsvision.flags import Flag, flags_from_text, flags_to_text
from tsvision.images.steadiness import Edges, edges_of, shift_px
from tsvision.records import Frame, FrameResult

MOST_PICTURES = 12
APART_TURNS = 0.5  # pictures nearer than this add little
LEARN_AT = (1, 2, 4, 8)  # how many pictures were collected when the looks are learnt anew
SETTLED_AFTER = 4  # pictures, and as many frames in a row with a twist in them
ENOUGH = 24  # pictures after which the looks stand, twist or not


class Primable(Protocol):
    """A measurer that learns its looks from pictures."""

    def prime(self, pictures: list[np.ndarray], turns: Iterable[float] = ()) -> None: ...

    def measure(self, frame: Frame, turns: float) -> FrameResult: ...


class Learner:
    """Measures like the measurers that `make` gives, learning anew until the view is known.

    `settled` tells whether it is; `review()` then gives, once, the frames that were kept, measured
    again with the looks that stand.
    """

    def __init__(self, make: Callable[[], Primable]) -> None:
        self._make = make
        self._before: Edges | None = None
        self._start_over()

    def _start_over(self) -> None:
        self._measurer = self._make()
        self._kept: list[tuple[Frame, float]] = []
        self._collected = 0
        self._last_turns = float("nan")
        self._twist_seen: deque[bool] = deque(maxlen=SETTLED_AFTER)
        self._to_review = False
        self.settled = False

    def measure(self, frame: Frame, turns: float) -> FrameResult:
        """Measure one frame, having learnt from it first while the view is not known yet."""
        moved = self._camera_moved(frame)
        if moved:
            self._start_over()
        if not self.settled and frame.pixels is not None and self._adds(turns):
            self._collect(frame, turns)
        result = self._measurer.measure(frame, turns)
        self._twist_seen.append(bool(np.isfinite(result.row.pitch_px)))
        known = self._collected >= SETTLED_AFTER and sum(self._twist_seen) == SETTLED_AFTER
        if not self.settled and (known or self._collected >= ENOUGH):
            self.settled = self._to_review = True
        return _flagged(result) if moved else result

    def review(self) -> list[FrameResult]:
        """The frames kept while learning, measured with the looks that now stand; empty before
        the view is known and after the first call."""
        if not self._to_review:
            return []
        self._to_review = False
        kept, self._kept = self._kept, []
        self._measurer = self._make()
        self._prime(kept)
        return [self._measurer.measure(frame, turns) for frame, turns in kept]

    def _camera_moved(self, frame: Frame) -> bool:
        if frame.pixels is None:
            return False
        before, self._before = self._before, edges_of(frame.pixels)
        return before is not None and shift_px(before, self._before) != (0.0, 0.0)

    def _adds(self, turns: float) -> bool:
        far = abs(turns - self._last_turns) >= APART_TURNS
        return far or not np.isfinite(turns) or not np.isfinite(self._last_turns)

    def _collect(self, frame: Frame, turns: float) -> None:
        if len(self._kept) == MOST_PICTURES:
            self._kept = self._kept[::2]
        self._kept.append((frame, turns))
        self._collected += 1
        self._last_turns = turns
        if self._collected in LEARN_AT or self._collected % 8 == 0:
            self._measurer = self._make()
            self._prime(self._kept)

    def _prime(self, kept: list[tuple[Frame, float]]) -> None:
        pictures = [f.pixels for f, _ in kept if f.pixels is not None]
        self._measurer.prime(pictures, [turns for _, turns in kept])


def _flagged(result: FrameResult) -> FrameResult:
    flags = flags_from_text(result.row.flags) | Flag.CAMERA_MOVED
    return replace(result, row=replace(result.row, flags=flags_to_text(flags)))
