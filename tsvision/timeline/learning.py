"""Learning what a live view looks like while the frames come.

A finished recording is sampled from end to end before the first frame is measured. Live, the first
picture is all there is, and at zero turns it shows no bundle yet. So the looks are learnt anew as
pictures with more turns come in, until the twist is seen frame after frame; then they stand.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import Protocol

import numpy as np

from tsvision.records import Frame, FrameResult

MOST_PICTURES = 8
APART_TURNS = 0.5  # pictures nearer than this add little
LEARN_AT = (1, 2, 4, 8)  # how many pictures were collected when the looks are learnt anew
SETTLED_AFTER = 4  # pictures, and as many frames in a row with a twist in them


class Primable(Protocol):
    """A measurer that learns its looks from pictures."""

    def prime(self, pictures: list[np.ndarray]) -> None: ...

    def measure(self, frame: Frame, turns: float) -> FrameResult: ...


class Learner:
    """Measures like the measurers that `make` gives, learning anew until the view is known."""

    def __init__(self, make: Callable[[], Primable]) -> None:
        self._make = make
        self._measurer = make()
        self._pictures: list[np.ndarray] = []
        self._collected = 0
        self._last_turns = float("nan")
        self._twist_seen: deque[bool] = deque(maxlen=SETTLED_AFTER)
        self.settled = False

    def measure(self, frame: Frame, turns: float) -> FrameResult:
        """Measure one frame, having learnt from it first while the view is not known yet."""
        if not self.settled and frame.pixels is not None and self._adds(turns):
            self._collect(frame.pixels, turns)
        result = self._measurer.measure(frame, turns)
        self._twist_seen.append(bool(np.isfinite(result.row.pitch_px)))
        if self._collected >= SETTLED_AFTER and sum(self._twist_seen) == SETTLED_AFTER:
            self.settled, self._pictures = True, []
        return result

    def _adds(self, turns: float) -> bool:
        far = abs(turns - self._last_turns) >= APART_TURNS
        return far or not np.isfinite(turns) or not np.isfinite(self._last_turns)

    def _collect(self, picture: np.ndarray, turns: float) -> None:
        if len(self._pictures) == MOST_PICTURES:
            self._pictures = self._pictures[::2]
        self._pictures.append(picture)
        self._collected += 1
        self._last_turns = turns
        if self._collected in LEARN_AT or self._collected % MOST_PICTURES == 0:
            self._measurer = self._make()
            self._measurer.prime(self._pictures)
