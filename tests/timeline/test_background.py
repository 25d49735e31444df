"""What stands out in a coiled bundle without a knot, and what a fibre tells of that: nothing."""

from __future__ import annotations

import numpy as np
import pandas as pd

from tests.timeline.series import KNOT_COLUMNS
from tsvision.live.believing import Live
from tsvision.measures.zone.knots import LOBE
from tsvision.records import FrameResult, FrameRow, KnotSighting, Rig
from tsvision.timeline.account import account
from tsvision.timeline.criteria import LEVEL_OF_ONSET

D, MM_PER_PX = 0.5, 0.025
TURNS = np.array([0.0, 5, 10, 15, 20, 25, 30, 34, 38, 42, 46, 50, 56, 62])
COILED, KNOTTED = 6, 9  # the first frames with a coil, and with a knot
RISES = (1.33, 1.25, 1.26)  # largest E over E0 between


def film(lobes: bool) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Frames and sightings of a coil that stands out here and there by RISES; if `lobes` that is
    seen to be no longer than a fibre is thick. A knot of 1.46 to 1.6 times E0 follows."""
    coil = np.maximum(np.arange(len(TURNS)) - COILED + 1, 0) * 0.06
    base = D * (1.0 + 2.0 * coil)
    rise = np.full(len(TURNS), 1.03)
    rise[COILED:KNOTTED] = RISES
    rise[KNOTTED:] = [1.46, 1.55, 1.6, 1.6, 1.6]
    frames = pd.DataFrame({"frame": np.arange(len(TURNS)), "turns": TURNS}).assign(
        diameter_mm=D,
        diameter_px=D / MM_PER_PX,
        coil_amplitude_mm=coil * D,
        baseline_envelope_mm=base,
        max_envelope_mm=rise * base,
        unevenness=np.where(TURNS >= 42, 0.2, 0.0),
        knot_count=(TURNS >= 42).astype(float),
        axis_x0_px=0.0,
        axis_y0_px=0.0,
        axis_x1_px=900.0,
        axis_y1_px=0.0,
        mm_per_px=MM_PER_PX,
        flags="",
    )
    knots = [(i, 11.5, 3.2, rise[i] * base[i], 0.98) for i in range(KNOTTED, len(TURNS))]
    short = [(i, 18.0 + i % 3, 0.25, rise[i] * base[i], LOBE) for i in range(COILED, KNOTTED)]
    rows = [
        (i, TURNS[i], c, length, size, c / MM_PER_PX, 0.0, sure, 2.0)
        for i, c, length, size, sure in (short if lobes else []) + knots
    ]
    return frames, pd.DataFrame(rows, columns=KNOT_COLUMNS)


def watched(lobes: bool) -> float:
    """What the same film, watched live, says in the end of the chance that there is a knot."""
    frames, seen = film(lobes)
    live = Live(Rig())
    for row in frames.assign(file="").to_dict("records"):
        here = seen[seen["frame"] == row["frame"]].drop(columns=["frame", "turns"])
        found = [KnotSighting(**one) for one in here.to_dict("records")]
        whole = tuple(one for one in found if one.confidence > LOBE)
        lone = tuple(one for one in found if one.confidence <= LOBE)
        state = live.push(FrameResult(FrameRow(**row), None, whole, lone))
    return state.there[LEVEL_OF_ONSET["knot_onset"]]


def test_a_fibre_across_the_coil_hides_no_knot() -> None:
    told = account(*film(lobes=True))
    assert told.onsets["knot_onset"].turns == TURNS[KNOTTED]
    assert len(told.knots) == len(TURNS) - KNOTTED


def test_where_the_coil_itself_stands_out_a_knot_must_stand_out_more() -> None:
    assert account(*film(lobes=False)).onsets["knot_onset"].status == "undetermined"


def test_nor_does_it_hide_one_from_who_watches() -> None:
    assert watched(lobes=True) > 0.99
    assert watched(lobes=False) < Live(Rig()).certainty
