"""The view is learnt until the twist is seen, and anew after a bump."""

from __future__ import annotations

from collections.abc import Iterable

import cv2
import numpy as np

from tsvision.live.learning import Learner
from tsvision.records import Frame, FrameResult, FrameRow


class Pupil:
    """Sees the twist only when it has learnt from a picture with enough turns in it."""

    made = 0

    def __init__(self) -> None:
        Pupil.made += 1
        self.best = 0.0

    def prime(self, pictures: list[np.ndarray], turns: Iterable[float] = ()) -> None:
        self.best = max(float(p.max()) for p in pictures)

    def measure(self, frame: Frame, turns: float) -> FrameResult:
        pitch = 20.0 if self.best >= 2.0 else float("nan")
        return FrameResult(FrameRow(frame.index, frame.file, turns=turns, pitch_px=pitch))


def test_the_view_is_learnt_anew_until_the_twist_is_seen_and_then_stands() -> None:
    Pupil.made = 0
    learner = Learner(Pupil)
    seen = []
    for i in range(12):
        frame = Frame(i, f"f{i}", np.full((4, 4), float(i)))
        seen.append(np.isfinite(learner.measure(frame, float(i)).row.pitch_px))
    assert seen == [False] * 3 + [True] * 9
    assert learner.settled
    assert Pupil.made == 4  # at first, and with 1, 2 and 4 pictures; not again once it is known
    again = learner.review()
    assert [r.row.frame for r in again] == [0, 1, 2, 3, 4, 5, 6]
    assert all(np.isfinite(r.row.pitch_px) for r in again)
    assert learner.review() == []


def test_a_bumped_camera_is_flagged_and_learnt_anew() -> None:
    scene = np.random.default_rng(3).integers(0, 255, (90, 160)).astype(np.uint8)
    scene = cv2.resize(cv2.GaussianBlur(scene, (0, 0), 2.0), (640, 360))
    learner = Learner(Pupil)
    flags = []
    for i in range(14):
        shown = scene if i < 9 else np.roll(scene, (6, 9), axis=(0, 1))
        shown = np.maximum(shown, np.uint8(i))
        flags.append(learner.measure(Frame(i, f"f{i}", shown), float(i)).row.flags)
    assert flags == ["CAMERA_MOVED" if i == 9 else "" for i in range(14)]
    assert next(r.row.frame for r in learner.review()) == 9
