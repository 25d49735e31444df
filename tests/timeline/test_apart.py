"""Two knots seen apart, then as one: cut for as long as a knot may hide, and no longer."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from tests.timeline.series import KNOT_COLUMNS
from tsvision.timeline.apart import HELD_FRAMES, told_apart
from tsvision.timeline.order import order_frames

D, MM_PER_PX = 0.5, 0.025
Sighting = tuple[float, float, float]  # centre, length, largest diameter, mm
APART: list[Sighting] = [(10.0, 1.4, 0.9), (12.0, 1.4, 1.1)]
JOINED: list[Sighting] = [(11.1, 3.6, 1.2)]


def tables(seen: list[list[Sighting]]) -> tuple[pd.DataFrame, pd.DataFrame]:
    """One frame a turn; the axis runs along y in the picture."""
    count = len(seen)
    frames = pd.DataFrame({"frame": np.arange(count), "turns": 40.0 + np.arange(count)})
    frames = frames.assign(
        diameter_mm=D,
        diameter_px=D / MM_PER_PX,
        mm_per_px=MM_PER_PX,
        axis_x0_px=200.0,
        axis_x1_px=200.0,
        axis_y0_px=50.0,
        axis_y1_px=1000.0,
    )
    rows = [
        (i, 40.0 + i, c, length, size, 200.0, 50.0 + c / MM_PER_PX, 0.9, 2.0)
        for i, some in enumerate(seen)
        for c, length, size in some
    ]
    return frames, pd.DataFrame(rows, columns=KNOT_COLUMNS)


def told(seen: list[list[Sighting]]) -> pd.DataFrame:
    frames, knots = tables(seen)
    return told_apart(frames, knots, order_frames(frames))


def test_two_that_look_like_one_stay_two() -> None:
    found = told([APART, APART, JOINED, APART])
    here = found[found["frame"] == 2]
    assert here["centre_mm"].tolist() == pytest.approx([10.0, 12.0])
    assert here["length_mm"].sum() == pytest.approx(3.6)
    assert here["max_diameter_mm"].tolist() == pytest.approx([0.9, 1.2])  # the larger one grew
    assert here["centre_x_px"].tolist() == pytest.approx([200.0, 200.0])
    assert here["centre_y_px"].tolist() == pytest.approx([450.0, 530.0])
    assert len(found) == 8


def test_what_stays_one_has_merged() -> None:
    found = told([APART, APART, *[JOINED] * 5])
    counts = found.groupby("frame").size().tolist()
    assert counts == [2, 2, *[2] * HELD_FRAMES, *[1] * (5 - HELD_FRAMES)]


def test_one_chance_sighting_cuts_no_knot() -> None:
    """The knot is hardly longer than before: not by as much as what showed beside it."""
    chance = [(10.0, 1.4, 0.9), (10.9, 0.6, 0.75)]
    assert len(told([APART[:1], APART[:1], chance, [(10.4, 1.9, 0.9)]])) == 5


def test_a_knot_that_grows_is_one() -> None:
    found = told([[(10.0, 1.0 + 0.5 * i, 0.9)] for i in range(6)])
    assert found["centre_mm"].tolist() == [10.0] * 6


def test_nothing_seen() -> None:
    assert told([[], [], []]).empty


SOLE: list[Sighting] = [(10.0, 1.6, 0.9)]
BESIDE: list[Sighting] = [(10.0, 1.6, 0.9), (12.0, 0.8, 1.1)]
PARTED: list[Sighting] = [(9.6, 0.6, 0.9), (10.45, 0.7, 0.9)]


def test_a_young_knot_that_showed_beside_another_but_once_is_not_swallowed() -> None:
    counts = told([SOLE, SOLE, BESIDE, JOINED, JOINED]).groupby("frame").size()
    assert counts.tolist() == [1, 1, 2, 2, 2]


def test_a_knot_once_seen_parted_is_whole_again() -> None:
    """Its parts' place moves by half its length, and both together are no longer than itself."""
    counts = told([SOLE, SOLE, PARTED, SOLE, SOLE]).groupby("frame").size()
    assert counts.tolist() == [1, 1, 2, 1, 1]
