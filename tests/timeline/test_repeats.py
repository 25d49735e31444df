"""Sightings that show again at the same place count for more; what falls anywhere does not."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from tests.timeline.series import KNOT_COLUMNS
from tsvision.records import Actuator, Rig
from tsvision.timeline.account import Account, account
from tsvision.timeline.repeats import SEEN_AGAIN, extent_in_diameters, repeat_odds

D, MM = 0.48, 0.03
RIG = Rig(actuator=Actuator(twisting_zone_mm=23.2, hole_diameter_mm=1.6))


def test_a_repeat_says_the_less_the_more_there_is_to_meet() -> None:
    alone = repeat_odds(1, 1.5, 40.0)
    assert alone == pytest.approx(np.log(SEEN_AGAIN / 0.075))
    assert repeat_odds(3, 1.5, 40.0) < alone
    assert repeat_odds(40, 1.5, 40.0) == 0.0


def test_the_extent_is_that_of_the_axis() -> None:
    frames = pd.DataFrame(
        {"axis_x0_px": [0.0], "axis_y0_px": [3.0], "axis_x1_px": [400.0], "axis_y1_px": [303.0]}
    )
    assert extent_in_diameters(frames.assign(diameter_px=[10.0])) == pytest.approx(50.0)
    assert extent_in_diameters(frames) > 10.0


def recording(places_mm: list[float]) -> Account:
    """40 frames a turn apart whose E(s) is read unevenly throughout (largest E 1.12 to 1.36 of E0),
    with weak sightings at these places in the last frames."""
    count = 40
    random = np.random.default_rng(3)
    turns = 20.0 + np.arange(count)
    base = np.full(count, 1.8 * D)
    top = base * random.uniform(1.12, 1.36, count)
    first = count - len(places_mm)
    top[first:] = 1.37 * base[0]
    frames = pd.DataFrame(
        {
            "frame": np.arange(count),
            "turns": turns,
            "diameter_mm": D,
            "diameter_px": D / MM,
            "coil_amplitude_mm": 0.4 * D,
            "baseline_envelope_mm": base,
            "max_envelope_mm": top,
            "unevenness": 0.1,
            "string_length_mm": 24.0 + 0.5 * np.arange(count),
            "knot_count": [0.0] * first + [1.0] * len(places_mm),
            "axis_x0_px": 0.0,
            "axis_y0_px": 0.0,
            "axis_x1_px": 23.2 / MM,
            "axis_y1_px": 0.0,
            "flags": "",
        }
    )
    rows = [
        (first + i, turns[first + i], s, 0.9, 1.37 * base[0], s / MM, 0.0, 0.97, 2.0)
        for i, s in enumerate(places_mm)
    ]
    return account(frames, pd.DataFrame(rows, columns=KNOT_COLUMNS), RIG)


def test_what_stays_where_it_is_is_a_knot_and_what_jumps_about_is_none() -> None:
    stays = recording([11.0 + 0.05 * i for i in range(10)])
    assert stays.onsets["knot_onset"].status == "observed"
    assert stays.onsets["knot_onset"].turns == pytest.approx(50.0, abs=2.0)
    jumps = recording([4.0, 19.0, 8.0, 15.0, 3.0, 21.0, 11.0, 17.0, 6.0, 13.0])
    assert jumps.onsets["knot_onset"].status != "observed"
    assert jumps.knots.empty
