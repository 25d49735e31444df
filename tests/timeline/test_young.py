"""A lobe counts where a knot shows in the frame after, or showed in the one before; not else."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from tests.timeline.series import KNOT_COLUMNS
from tsvision.measures.zone.knots import LOBE
from tsvision.records import FrameResult, FrameRow, KnotSighting
from tsvision.timeline.order import order_frames
from tsvision.timeline.tables import tables as as_tables
from tsvision.timeline.young import with_young

D, MM_PER_PX, COUNT, FIRST = 0.5, 0.025, 20, 12


def told(
    lobes: list[tuple[int, float]], last: int = COUNT - 1, turns_apart: float = 1.0
) -> list[tuple[int, float]]:
    """(frame, centre) of what counts before and after a knot that shows at 10 mm in the frames
    from FIRST to `last`; lobes: (frame, centre in mm)."""
    turns = 40.0 + turns_apart * np.arange(COUNT)
    frames = pd.DataFrame({"frame": np.arange(COUNT), "turns": turns})
    frames = frames.assign(
        diameter_mm=D,
        diameter_px=D / MM_PER_PX,
        coil_amplitude_mm=0.4 * D,
        baseline_envelope_mm=1.8 * D,
        max_envelope_mm=1.9 * D,
        knot_count=0.0,
        axis_x0_px=0.0,
        axis_y0_px=0.0,
        axis_x1_px=900.0,
        axis_y1_px=0.0,
    )
    knot = [(i, 10.0, 1.4, 2.8 * D, 0.98) for i in range(FIRST, last + 1)]
    short = [(i, centre, 0.2, 2.1 * D, LOBE) for i, centre in lobes]
    rows = [
        (i, turns[i], c, length, size, c / MM_PER_PX, 0.0, sure, 2.0)
        for i, c, length, size, sure in sorted(knot + short)
    ]
    knots = pd.DataFrame(rows, columns=KNOT_COLUMNS)
    found = with_young(frames, knots, order_frames(frames))
    assert (found["confidence"] > LOBE).all()
    outside = found[(found["frame"] < FIRST) | (found["frame"] > last)]
    assert len(found) == len(knot) + len(outside)
    return list(zip(outside["frame"].tolist(), outside["centre_mm"].tolist(), strict=True))


def test_a_knot_is_followed_back_lobe_by_lobe_to_where_none_shows() -> None:
    seen = told([(FIRST - 1, 10.2), (FIRST - 2, 9.9), (FIRST - 4, 10.0)])
    assert seen == [(FIRST - 2, 9.9), (FIRST - 1, 10.2)]


def test_a_knot_that_dissolves_is_followed_on() -> None:
    assert told([(16, 10.1), (18, 10.0)], last=15) == [(16, 10.1)]


@pytest.mark.parametrize("lobe", [(FIRST - 1, 12.0), (FIRST - 2, 10.0), (FIRST + 2, 16.0)])
def test_a_lobe_elsewhere_in_place_or_time_is_none(lobe: tuple[int, float]) -> None:
    assert told([lobe]) == []


def test_frames_many_turns_apart_do_not_show_one_young_knot_twice() -> None:
    """A path-traced film in steps of four turns: a crest of the coil passed for the knot's lobe."""
    assert told([(FIRST - 1, 10.0)], turns_apart=4.0) == []


def test_the_tables_hold_lobes_beside_knots() -> None:
    knot = KnotSighting(10.0, 1.4, 1.4, 400.0, 0.0, 0.98)
    lobe = KnotSighting(6.0, 0.2, 1.1, 240.0, 0.0, LOBE)
    _, knots = as_tables([FrameResult(FrameRow(3, "a.png"), None, (knot,), (lobe,))])
    assert knots["confidence"].tolist() == [0.98, LOBE]
    assert knots["frame"].tolist() == [3, 3]
