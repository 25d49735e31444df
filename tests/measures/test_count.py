"""The number of strands from outlines alone, on pictures drawn by the renderer's tubes."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from tests.bench.pictures48_draw import cases, draw
from tsvision.flags import Flag, flags_from_text
from tsvision.measures import count
from tsvision.measures.recording import Measurer
from tsvision.records import Camera, Frame, Rig, Strings, View

UNTOLD = View(separator_side="none")


@pytest.mark.parametrize("strings", [2, 4, 6, 8])
@pytest.mark.parametrize("number", [10, 28])  # dark on bright 15 degrees, and 25, 5 % noise
def test_the_number_of_strands_is_told_by_the_outline(strings: int, number: int) -> None:
    case = cases(strings)[number]
    row = Measurer(Rig(view=UNTOLD)).measure(Frame(0, "a.png", draw(case))).row
    assert row.strand_count == strings
    assert row.strand_count_confidence > 0.75
    assert Flag.STRAND_COUNT_GUESSED in flags_from_text(row.flags)
    assert row.pitch_px == pytest.approx(case.pitch_px, rel=0.02)


@pytest.mark.slow
def test_a_known_string_diameter_raises_the_confidence() -> None:
    case = replace(cases(4)[5], noise=0.05)
    found = [
        Measurer(Rig(view=UNTOLD, strings=strings, camera=Camera(mm_per_px=0.02)))
        .measure(Frame(0, "a.png", draw(case)))
        .row
        for strings in (Strings(), Strings(diameter_mm=0.02 * case.diameter_px / (1 + np.sqrt(3))))
    ]
    assert [row.strand_count for row in found] == [4.0, 4.0]
    assert found[1].strand_count_confidence > found[0].strand_count_confidence


@pytest.mark.parametrize(
    ("frames", "expected"), [(4, [0, 1, 2, 3]), (5, [0, 1, 3, 4]), (7, [0, 2, 4, 6])]
)
def test_frames_all_over_the_recording_are_asked(
    frames: int, expected: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of 5 to 7 frames the first four were: the least twisted, which may show legs alone."""
    asked: list[object] = []
    monkeypatch.setattr(count, "learn_shading", lambda cuts, _: None)
    monkeypatch.setattr(count, "near_window", lambda cut, _: asked.append(cut))
    told = count.count_strands(list(range(frames)), SimpleNamespace(width_px=20.0))  # type: ignore[arg-type]
    assert asked == expected
    assert told == (2, 0.5)
