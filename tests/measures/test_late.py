"""Films of which most frames show legs alone."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import cast

import cv2
import numpy as np
import pytest

from tests.images.test_sight import few_turns
from tsvision.images.frames import open_recording
from tsvision.measures import alone, late
from tsvision.measures.late import by_twist, shown_late
from tsvision.measures.looks import Looks
from tsvision.measures.recording import Measurer, sample_pictures
from tsvision.records import Frame, Rig, Scale, Strings

D_PX = 16.0


@pytest.mark.slow
def test_a_bundle_that_comes_into_view_late_is_measured() -> None:
    """Six of eight frames show legs that meet beyond the view: a line between them, or a leg, was
    taken for the bundle's, and no frame was measured (`--wild 580`, `611`, `738`)."""
    film = [few_turns(apex) for apex in (1.9, 1.8, 1.7, 1.6, 1.5, 1.4, 0.7, 0.6)]
    measurer = Measurer(Rig(strings=Strings(count=2)))
    measurer.prime(film)
    widths = [measurer.measure(Frame(i, "", p)).row.diameter_px for i, p in enumerate(film)]
    assert np.isnan(widths[:6]).all()
    assert np.abs(np.array(widths[6:]) - D_PX).max() < 0.4


def test_the_last_frames_teach_where_all_together_describe_hardly_any(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    film = [np.full((4, 4), i, np.uint8) for i in range(8)]
    asked: list[list[int]] = []
    taught = ["late", "late", "none", "one", "one"]
    describes = {"all": {0, 1, 2, 3, 4}, "late": {5, 6, 7}, "none": set(), "one": {7}}

    def learn(pictures: list[np.ndarray], *_: object) -> str:
        asked.append([int(p[0, 0]) for p in pictures])
        return taught[len(asked) - 1]

    monkeypatch.setattr(late, "learn_looks", learn)
    monkeypatch.setattr(
        late, "is_described", lambda looks, p, _flags: int(p[0, 0]) in describes[looks]
    )

    def shown(looks: str | None, pictures: list[np.ndarray] = film) -> Looks | None:
        return shown_late(pictures, Rig(), Scale(), looks)  # type: ignore[arg-type]

    assert shown("all") == "late"  # a leg, in frames of few turns
    assert shown(None) == "late"
    assert asked == [[4, 5, 6, 7]] * 2
    assert shown("late") == "late"
    assert shown("all", film[:3]) == "all"  # too few
    assert len(asked) == 2  # nothing to be learnt
    assert shown("all") == "all"
    assert shown(None) is None
    assert shown("none", film[4:]) == "none"  # one of two may show a bundle by chance


def test_pictures_come_in_order_of_their_turns() -> None:
    pictures = [np.full((2, 2), i, np.uint8) for i in range(4)]
    order = [int(p[0, 0]) for p in by_twist(pictures, [3.0, -9.0, 0.0, 5.0])]
    assert order == [2, 0, 3, 1]
    assert by_twist(pictures, [3.0, float("nan"), 0.0, 5.0]) == pictures


def test_a_film_that_unwinds_is_sampled_from_its_end(tmp_path: Path) -> None:
    for i in range(4):
        cv2.imwrite(str(tmp_path / f"{i}.png"), np.tile(np.uint8([0, 50 + i]), (40, 20)))
    recording = open_recording(tmp_path, Rig())
    recording = replace(recording, turns=np.array([9.0, 6.0, 4.0, 1.0]))
    assert [int(p.max()) - 50 for p in sample_pictures(recording, 8)] == [3, 2, 1, 0]


def test_a_picture_that_cannot_be_measured_shows_no_bundle(monkeypatch: pytest.MonkeyPatch) -> None:
    """It ended the program before any frame was measured."""

    def fails(*_: object) -> None:
        raise np.linalg.LinAlgError("Array must not contain infs or NaNs.")

    monkeypatch.setattr(alone, "measure_frame", fails)
    assert not alone.is_described(cast(Looks, None), np.zeros((40, 60), np.uint8))
