"""The sense of a frame that shows little or none of it, by others of the same twist."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from tests.images.test_sight import few_turns
from tsvision.measures import looks as looks_module
from tsvision.measures import sense
from tsvision.measures.recording import Measurer
from tsvision.measures.sense import NO_RIDGES, Ridges, Sense, sense_by_others, sense_of
from tsvision.records import Frame, Rig, Strings


def looks(slope_sum: float, way: int = 0) -> SimpleNamespace:
    return SimpleNamespace(slope_sum=slope_sum, way=way, diameter_px=20.0)


def told(
    monkeypatch: pytest.MonkeyPatch, slope: float, turns: float, before: Ridges, learnt: float = 0.0
) -> tuple[Sense, Ridges]:
    """Of a frame whose ridges have this slope."""
    monkeypatch.setattr(sense, "slope_between", lambda *_: slope)
    return sense_of(None, None, looks(learnt, 1), turns, before)  # type: ignore[arg-type]


@pytest.mark.slow
def test_a_frame_of_legs_has_the_sense_of_the_bundle_that_comes_into_view(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Three turns that meet beyond the view: the first frame of a close view (photoreal's devQ)
    told no sense, though the motor had turned the strings as in all others."""
    film = [few_turns(apex) for apex in (1.9, 1.8, 0.7, 0.6)]  # flat strands, without ridges
    monkeypatch.setattr(looks_module, "_slope_sum", lambda *_: 2.0)

    def first(turns: float, primed: list[float]) -> str:
        measurer = Measurer(Rig(strings=Strings(count=2)))
        measurer.prime(film, primed)
        row = measurer.measure(Frame(0, "", film[0]), turns).row
        assert np.isnan(row.diameter_px)
        return row.handedness

    assert first(3.0, [3.0, 4.0, 8.0, 9.0]) == "Z"
    assert first(-3.0, [-3.0, -4.0, -8.0, -9.0]) == "Z"
    # Wound to the other side, or hardly at all, or nobody knows which way: none.
    assert first(-3.0, [3.0, 4.0, 8.0, 9.0]) == ""
    assert first(-3.0, [-3.0, -4.0, 8.0, 9.0]) == ""
    assert first(0.5, [0.5, 4.0, 8.0, 9.0]) == ""
    assert first(float("nan"), []) == ""


def test_what_was_seen_is_forgotten_once_the_motor_turns_the_other_way(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Wound to one side, then to the other: faint ridges were told by those of the first side."""
    _, ridges = told(monkeypatch, 0.5, 6.0, NO_RIDGES)
    faint, _ = told(monkeypatch, -0.1, 7.0, ridges)
    assert faint.handedness == "Z"
    unwound, other = told(monkeypatch, -0.1, -6.0, ridges, learnt=3.0)
    assert unwound.handedness == "S"
    assert other == Ridges(-0.1, -1)
    unknown, _ = told(monkeypatch, -0.1, float("nan"), ridges)
    assert unknown.handedness == "Z"


@pytest.mark.parametrize(
    ("slope_sum", "turns", "hand"),
    [(2.0, 3.0, "Z"), (-2.0, 3.0, "S"), (0.05, 3.0, ""), (2.0, 0.9, ""), (2.0, -3.0, "")],
)
def test_others_tell_a_sense_only_where_they_are_sure_of_it(
    slope_sum: float, turns: float, hand: str
) -> None:
    one = sense_by_others(looks(slope_sum, 1), turns, NO_RIDGES)  # type: ignore[arg-type]
    assert one.handedness == hand
    assert (one.confidence > 0.95) if hand else np.isnan(one.confidence)
